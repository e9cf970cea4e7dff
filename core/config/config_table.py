"""What all sections of the configuration share: strict, frozen tables, and types with bounds.

Annotations of the tables are objects (no ``from __future__ import annotations``): msgspec would evaluate each text.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache, partial
from pathlib import Path, PurePath
from typing import Annotated, Any, Self

import msgspec
import numpy as np
from msgspec import Meta

from collaudit.core.numeric.arrays import LARGEST

Vec3 = tuple[float, float, float]
Vec6 = tuple[float, float, float, float, float, float]
Interval = tuple[float, float]
Positive = Annotated[float, Meta(gt=0)]
NonNegative = Annotated[float, Meta(ge=0)]
#: One kind in a list, which :meth:`ConfigTable.check_kinds` sees to: msgspec tells kinds of lists apart no further.
ListOfColumns = list[int | str]
ColumnPattern = str | ListOfColumns


def about(text: str) -> Meta:
    """What a key means: shown in the reference page and in the published schema."""
    return Meta(description=text)


class KeyedError(ValueError):
    """What a table finds out about one of its keys.

    Attributes:
        key: the key.
        text: what is wrong; None where the value is none that the key accepts.
    """

    def __init__(self, key: str, text: str | None = None) -> None:
        super().__init__(f"{key}: {text or 'a value that cannot be used'}")
        self.key = key
        self.text = text


class ConfigTable(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, dict=True):
    """A table of the configuration: unknown keys are errors, and it remembers which keys were given."""

    @classmethod
    def of(cls, data: Mapping[str, Any], base_dir: Path = Path()) -> Self:
        """The table of decoded TOML.

        Args:
            data: its keys and values.
            base_dir: folder that files start from; a ``Path`` in the table is found from the working folder, a
                ``PurePath`` stays as it is written.

        Raises:
            msgspec.ValidationError: it does not fit; the first problem.
        """
        table = msgspec.convert(data, cls, dec_hook=partial(_path, base_dir))
        beyond = _out_of_range(data)
        if beyond is not None:
            raise msgspec.ValidationError(f"Expected a finite number - at `${beyond}`")
        _note_given(table, data)
        return table

    @property
    def given(self) -> frozenset[str]:
        """Keys that a file or a flag stated; of a table made otherwise, those that differ from their defaults."""
        stated: frozenset[str] | None = self.__dict__.get("given")
        if stated is not None:
            return stated
        return frozenset(field.name for field in _fields(type(self)) if getattr(self, field.name) != _default(field))

    def changed(self, values: Mapping[str, Any]) -> Self:
        """A copy with other values, which count as given."""
        table = msgspec.structs.replace(self, **values)
        table.__dict__["given"] = self.given | values.keys()
        return table

    def plain(self) -> dict[str, Any]:
        """The table as dictionaries, lists, text and numbers."""
        values: dict[str, Any] = msgspec.to_builtins(self, enc_hook=_builtin)
        return values

    def check_kinds(self, *keys: str) -> None:
        """See that no list of these keys mixes text with numbers, or numbers with lists.

        Raises:
            KeyedError: one does.
        """
        for key in keys:
            value = getattr(self, key)
            if isinstance(value, list) and len({float if isinstance(x, int | float) else type(x) for x in value}) > 1:
                raise KeyedError(key)

    def __copy__(self) -> Self:
        """Nothing of it changes, so it stands for its copies."""
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        """With the keys that were given, which msgspec's own way leaves out."""
        values = tuple(getattr(self, name) for name in self.__struct_fields__)
        return _rebuilt, (type(self), values, self.__dict__.get("given"))


def toml_values(value: Any) -> Any:
    """Values from code as TOML would give them: names, lists, text, numbers; what TOML has no word for stays."""
    if isinstance(value, Mapping):
        return {str(name): toml_values(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [toml_values(inner) for inner in value]
    if isinstance(value, PurePath | str):
        return str(value)
    return value.item() if isinstance(value, np.generic) else value


def _out_of_range(value: object, place: str = "") -> str | None:
    """Where decoded TOML has ``inf``, ``nan`` or a number beyond :data:`LARGEST`, which no key accepts."""
    if isinstance(value, float | int):
        return None if abs(value) <= LARGEST else place
    inside: Iterable[tuple[str, object]] = ()
    if isinstance(value, Mapping):
        inside = ((f"{place}.{name}", inner) for name, inner in value.items())
    elif isinstance(value, list | tuple):
        inside = ((f"{place}[{number}]", inner) for number, inner in enumerate(value))
    return next((found for at, inner in inside if (found := _out_of_range(inner, at)) is not None), None)


def _rebuilt(kind: type[ConfigTable], values: tuple[object, ...], given: frozenset[str] | None) -> ConfigTable:
    table = kind(**dict(zip(kind.__struct_fields__, values, strict=True)))
    if given is not None:
        table.__dict__["given"] = given
    return table


def _note_given(value: object, data: object) -> None:
    """Note the keys of a converted value's tables, wherever they lie in it."""
    if isinstance(value, ConfigTable) and isinstance(data, Mapping):
        value.__dict__["given"] = frozenset(data)
        for name, inner in data.items():
            _note_given(getattr(value, name), inner)
    elif isinstance(value, dict) and isinstance(data, Mapping):
        for name, inner in data.items():
            _note_given(value[name], inner)
    elif isinstance(value, list) and isinstance(data, list | tuple):
        for item, inner in zip(value, data, strict=True):
            _note_given(item, inner)


def _builtin(value: object) -> str | float:
    """What msgspec leaves to us: file names, and numbers of NumPy."""
    return float(value) if isinstance(value, float) else str(value)


@cache  # msgspec reads the annotations of the class each time it is asked
def _fields(kind: type[ConfigTable]) -> tuple[msgspec.structs.FieldInfo, ...]:
    return msgspec.structs.fields(kind)


def _default(field: msgspec.structs.FieldInfo) -> object:
    return field.default_factory() if field.default_factory is not msgspec.NODEFAULT else field.default


def _path(base_dir: Path, kind: type, value: object) -> PurePath:
    """File names, which msgspec leaves to us; it adds the place to the error."""
    if isinstance(value, str | PurePath):
        return base_dir / value if kind is Path else PurePath(value)
    raise TypeError(f"Expected a file name, got {type(value).__name__}")
