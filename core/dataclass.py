"""The standard library's ``dataclass``, which does not compile methods before they are called.

The standard one makes six methods of a frozen class by compiling the text of each, which takes 0.4 ms. A command loads
300 classes, and of most it calls none of these methods. Here those that look the same for every class are shared, and
``__init__`` is compiled when the first object is made. All else is as in the standard library (fields, slots, equality,
hash, ``repr``, pickling, ``replace``, ``asdict``), and type checkers are told that it is the standard one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import MISSING, FrozenInstanceError
from inspect import get_annotations
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any, cast

__all__ = ["dataclass"]

#: What a class that is made here may ask for; with anything else it is left to the standard library.
_KNOWN = frozenset({"frozen", "slots", "eq", "kw_only"})
_absent = object()

if TYPE_CHECKING:
    from dataclasses import dataclass
else:

    def dataclass(cls=None, /, **options):
        """As ``dataclasses.dataclass``; only frozen classes with slots and without bases are made here."""

        def made(kind):
            return _made(kind, **options) if _is_plain(kind, options) else dataclasses.dataclass(**options)(kind)

        return made if cls is None else made(cls)


def _is_plain(cls: type, options: dict[str, Any]) -> bool:
    return (
        bool(options.get("frozen") and options.get("slots"))
        and options.keys() <= _KNOWN
        and cls.__bases__ == (object,)
        and cls.__doc__ is not None  # the standard library writes one from the signature
        and not any("InitVar" in str(kind) for kind in get_annotations(cls).values())
    )


def _made(cls: type, *, eq: bool = True, kw_only: bool = False, **_: object) -> type:
    """The class with its fields and slots, and methods that are shared or compiled later."""
    own = frozenset(cls.__dict__)
    made: Any = dataclasses.dataclass(init=False, repr=False, eq=False, slots=True, kw_only=kw_only)(cls)
    params = made.__dataclass_params__  # what heirs read
    params.init, params.repr, params.eq, params.frozen = True, True, eq, True
    fields = dataclasses.fields(made)
    _check_order(fields)
    methods: dict[str, Callable[..., Any]] = {
        "__init__": _first_init(made),
        "__repr__": _repr,
        "__getstate__": _state,
        "__setstate__": _take_state,
    }
    if eq:
        methods["__eq__"] = _equality(_values_of([field.name for field in fields if field.compare]))
        hashed = [field.name for field in fields if (field.compare if field.hash is None else field.hash)]
        methods["__hash__"] = _hashing(_values_of(hashed))
    for name, method in methods.items():
        if name not in own or (name == "__hash__" and cls.__dict__[name] is None and "__eq__" in own):
            setattr(made, name, method)
    made.__setattr__, made.__delattr__ = _set, _delete
    return cast(type, made)


def _check_order(fields: tuple[dataclasses.Field[Any], ...]) -> None:
    """Raise TypeError, as the standard library does, where a field without default follows one with a default."""
    before = None
    for field in fields:
        if not field.init or field.kw_only:
            continue
        if field.default is not MISSING or field.default_factory is not MISSING:
            before = field.name
        elif before is not None:
            raise TypeError(f"non-default argument {field.name!r} follows default argument {before!r}")


def _first_init(cls: Any) -> Callable[..., None]:
    def __init__(self: object, *args: Any, **kwargs: Any) -> None:  # noqa: N807 (it stands for the compiled one)
        compiled = _compiled_init(cls)
        cls.__init__ = compiled
        compiled(self, *args, **kwargs)

    __init__.__qualname__ = f"{cls.__qualname__}.__init__"
    return __init__


def _compiled_init(cls: Any) -> Callable[..., None]:
    """``__init__`` of the class's fields, in the order of the standard library: those by keyword last."""
    fields = dataclasses.fields(cls)
    known: dict[str, Any] = {"__set__": object.__setattr__, "__absent__": _absent}  # names that no field has
    positional: list[str] = []
    keyword: list[str] = []
    lines: list[str] = []
    for k, field in enumerate(fields):
        value = field.name
        if field.default_factory is not MISSING:
            known[f"__make{k}__"] = field.default_factory
            value = f"__make{k}__() if {field.name} is __absent__ else {field.name}" if field.init else f"__make{k}__()"
        elif field.default is not MISSING:
            known[f"__default{k}__"] = field.default
            value = field.name if field.init else f"__default{k}__"
        elif not field.init:
            continue
        lines.append(f"__set__(__self__, {field.name!r}, {value})")
        if field.init:
            made, given = f"__make{k}__" in known, f"__default{k}__" in known
            default = "=__absent__" if made else f"=__default{k}__" if given else ""
            (keyword if field.kw_only else positional).append(field.name + default)
    if hasattr(cls, "__post_init__"):
        lines.append("__self__.__post_init__()")
    stars = ["*", *keyword] if keyword else []
    text = f"def __init__({', '.join(['__self__', *positional, *stars])}):\n  " + ("\n  ".join(lines) or "pass")
    exec(text, known)
    compiled: Callable[..., None] = known["__init__"]
    compiled.__qualname__, compiled.__module__ = f"{cls.__qualname__}.__init__", cls.__module__
    compiled.__annotations__ = {field.name: field.type for field in fields if field.init} | {"return": None}
    return compiled


def _values_of(names: list[str]) -> Callable[[Any], tuple[Any, ...]]:
    """What gives the values of these fields of an object: a tuple, of one or none as well."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda self: tuple(getattr(self, name) for name in names)


def _equality(compared: Callable[[Any], Any]) -> Callable[[Any, object], bool]:
    def __eq__(self: Any, other: object) -> bool:  # noqa: N807
        return bool(compared(self) == compared(other)) if other.__class__ is self.__class__ else NotImplemented

    return __eq__


def _hashing(hashed: Callable[[Any], Any]) -> Callable[[Any], int]:
    def __hash__(self: Any) -> int:  # noqa: N807
        return hash(hashed(self))

    return __hash__


@recursive_repr()
def _repr(self: Any) -> str:
    shown = (field.name for field in dataclasses.fields(self) if field.repr)
    return f"{self.__class__.__qualname__}({', '.join(f'{name}={getattr(self, name)!r}' for name in shown)})"


def _is_field(self: Any, name: str) -> bool:
    """Whether a name is a field's; heirs that are no dataclasses may have other attributes."""
    return "__dataclass_fields__" in type(self).__dict__ or name in self.__dataclass_fields__


def _set(self: Any, name: str, value: object) -> None:
    if _is_field(self, name):
        raise FrozenInstanceError(f"cannot assign to field {name!r}")
    object.__setattr__(self, name, value)


def _delete(self: Any, name: str) -> None:
    if _is_field(self, name):
        raise FrozenInstanceError(f"cannot delete field {name!r}")
    object.__delattr__(self, name)


def _state(self: Any) -> list[Any]:
    return [getattr(self, field.name) for field in dataclasses.fields(self)]


def _take_state(self: Any, state: list[Any]) -> None:
    for field, value in zip(dataclasses.fields(self), state, strict=True):
        object.__setattr__(self, field.name, value)
