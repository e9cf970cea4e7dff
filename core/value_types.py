"""``dataclass`` whose methods are not compiled for each class while a program starts.

The standard decorator writes the source of six methods for every class and compiles it: 0.4 ms a class in Python 3.11,
0.13 s for the three hundred classes that judging a log imports. Only a constructor has to be compiled to take its
arguments quickly, and most classes of a run are constructed a few times or never. So a constructor is compiled for
classes of which many are made, and the other methods are closures over the names of the fields. What they answer is
what the standard ones answer.

Type checkers see the standard decorator; ``field``, ``fields``, ``replace`` and ``asdict`` are the standard ones.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable
from dataclasses import MISSING, Field, FrozenInstanceError
from functools import partial
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any, TypeVar

__all__ = ["dataclass"]

T = TypeVar("T")

#: Objects of a class that are made without a compiled constructor: compiling takes as long as making forty so.
_COMPILED_AFTER = 20
_Decorator = Callable[[type[T]], type[T]]


class _Factory:
    """The default of an argument that a factory makes, as signatures show it."""

    def __repr__(self) -> str:
        return "<factory>"


_FACTORY = _Factory()


def value_type(
    *, frozen: bool = False, slots: bool = False, eq: bool = True, kw_only: bool = False, order: bool = False
) -> _Decorator[Any]:
    """As :func:`dataclasses.dataclass`, for classes without ``InitVar``.

    Classes with an order are left to the standard decorator.
    """

    def decorated(cls: type[Any]) -> type[Any]:
        if order:
            return dataclasses.dataclass(frozen=frozen, slots=slots, eq=eq, kw_only=kw_only, order=True)(cls)
        if (
            cls.__doc__ is None
        ):  # else the standard decorator makes one of the signature, which takes half a millisecond
            cls.__doc__ = cls.__name__
        made = dataclasses.dataclass(init=False, repr=False, eq=False, slots=slots, kw_only=kw_only)(cls)
        _complete(made, frozen, slots, eq)
        return made

    return decorated


def _complete(cls: type[Any], frozen: bool, slots: bool, eq: bool) -> None:
    """Give a class the methods that the standard decorator would have compiled."""
    fields = dataclasses.fields(cls)
    methods: dict[str, Any] = {"__init__": _Constructor(cls, frozen)}
    methods["__repr__"] = _shown(tuple(item.name for item in fields if item.repr))
    if eq:
        methods["__eq__"] = _equal(_values(item.name for item in fields if item.compare))
        hashed = (item.name for item in fields if (item.compare if item.hash is None else item.hash))
        methods["__hash__"] = _hashed(_values(hashed)) if frozen else None
    if frozen:
        methods |= _unchangeable(cls, frozenset(item.name for item in fields))
    if frozen and slots:  # a constructor of pickle would set attributes
        methods["__getstate__"], methods["__setstate__"] = _state, _set_state
    for name, method in methods.items():
        if name not in cls.__dict__ or (name == "__hash__" and cls.__dict__[name] is None):
            setattr(cls, name, method)


class _Constructor:
    """Stands for ``__init__``; gives its place to a compiled one when many are made, or when it is looked at."""

    __slots__ = ("_cls", "_defaults", "_frozen", "_left", "_names")

    def __init__(self, cls: type[Any], frozen: bool) -> None:
        self._cls, self._frozen = cls, frozen
        fields = dataclasses.fields(cls)
        plain = not hasattr(cls, "__post_init__") and all(item.init and not item.kw_only for item in fields)
        self._left = _COMPILED_AFTER if plain else 0
        self._names = tuple(item.name for item in fields)
        self._defaults = [f for f in fields if f.default is not MISSING or f.default_factory is not MISSING]

    def __get__(self, instance: object, owner: type[Any] | None = None) -> Any:
        if instance is not None and self._left > 0:
            self._left -= 1
            return partial(self._fill, instance)
        made = _constructor(self._cls, self._frozen)
        self._cls.__init__ = made
        return made if instance is None else made.__get__(instance)

    def _fill(self, instance: object, /, *args: Any, **named: Any) -> None:
        """Set all fields; the compiled constructor is handed what does not fit, and says why."""
        values = {**dict(zip(self._names, args, strict=False)), **named}
        clear = len(values) == len(args) + len(named)
        for item in self._defaults if len(values) < len(self._names) else ():
            if item.name not in values:
                values[item.name] = item.default if item.default_factory is MISSING else item.default_factory()
        if not clear or len(values) != len(self._names) or not values.keys() <= set(self._names):
            _constructor(self._cls, self._frozen)(instance, *args, **named)
            return
        for name, value in values.items():
            object.__setattr__(instance, name, value)


def _constructor(cls: type[Any], frozen: bool) -> Any:
    """``__init__`` of a class, with the defaults and annotations of its fields."""
    fields = dataclasses.fields(cls)
    taken = [item for item in fields if item.init]
    names = [_parameter(item) for item in taken if not item.kw_only]
    only = [_parameter(item) for item in taken if item.kw_only]
    lines = [line for item in fields for line in _assignment(item, frozen)]
    if hasattr(cls, "__post_init__"):
        lines.append("self.__post_init__()")
    known = {"_set": object.__setattr__, "_FACTORY": _FACTORY}
    for item in fields:
        known[f"_default_{item.name}"] = item.default
        known[f"_factory_{item.name}"] = item.default_factory
    source = f"""def make({", ".join(known)}):
 def __init__({", ".join(["self", *names, *(["*", *only] if only else [])])}):
  {"; ".join(lines) or "pass"}
 return __init__"""
    made: dict[str, Any] = {}
    exec(source, vars(sys.modules[cls.__module__]), made)
    function = made["make"](**known)
    function.__qualname__ = f"{cls.__qualname__}.__init__"
    function.__annotations__ = {item.name: item.type for item in taken} | {"return": None}
    return function


def _parameter(item: Field[Any]) -> str:
    if item.default is not MISSING:
        return f"{item.name}=_default_{item.name}"
    return item.name if item.default_factory is MISSING else f"{item.name}=_FACTORY"


def _assignment(item: Field[Any], frozen: bool) -> list[str]:
    """The statements that set a field; none for one that ``__post_init__`` sets."""
    value = item.name
    if item.default_factory is not MISSING:
        value = f"_factory_{item.name}()" + (f" if {item.name} is _FACTORY else {item.name}" if item.init else "")
    elif not item.init:
        if item.default is MISSING:
            return []
        value = f"_default_{item.name}"
    return [f"_set(self, {item.name!r}, {value})" if frozen else f"self.{item.name} = {value}"]


def _values(names: Any) -> Callable[[Any], tuple[Any, ...]]:
    """What takes these attributes of an object, as a tuple."""
    known = tuple(names)
    if len(known) > 1:
        return attrgetter(*known)
    return lambda value: tuple(getattr(value, name) for name in known)


def _shown(names: tuple[str, ...]) -> Any:
    @recursive_repr()
    def __repr__(self: Any) -> str:  # noqa: N807
        return f"{type(self).__qualname__}({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"

    return __repr__


def _equal(values: Callable[[Any], tuple[Any, ...]]) -> Any:
    def __eq__(self: Any, other: object) -> Any:  # noqa: N807
        return values(self) == values(other) if other.__class__ is self.__class__ else NotImplemented

    return __eq__


def _hashed(values: Callable[[Any], tuple[Any, ...]]) -> Any:
    def __hash__(self: Any) -> int:  # noqa: N807
        return hash(values(self))

    return __hash__


def _unchangeable(cls: type[Any], names: frozenset[str]) -> dict[str, Any]:
    def __setattr__(self: Any, name: str, value: object) -> None:  # noqa: N807
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:  # noqa: N807
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    return {"__setattr__": __setattr__, "__delattr__": __delattr__}


def _state(self: Any) -> list[Any]:
    return [getattr(self, item.name) for item in dataclasses.fields(self)]


def _set_state(self: Any, state: list[Any]) -> None:
    for item, value in zip(dataclasses.fields(self), state, strict=True):
        object.__setattr__(self, item.name, value)


if TYPE_CHECKING:
    from dataclasses import dataclass
else:
    dataclass = value_type
