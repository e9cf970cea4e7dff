"""The schema in words: what a key accepts, and which keys a table has."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal, get_args

import msgspec
from msgspec import inspect

from collaudit.core.config.schema import Config
from collaudit.core.config.toml_text import to_toml
from collaudit.core.friction_laws.law_registry import NameOfLaw

_PLAIN: dict[type[inspect.Type], str] = {
    inspect.StrType: "text",
    inspect.BoolType: "true or false",
    inspect.CustomType: "a file name",
    inspect.DateType: "a date",
    inspect.FloatType: "a number",
    inspect.IntType: "a whole number",
    inspect.StructType: "a table",
}
_BOUNDS = (
    ("gt", "above {:g}"),
    ("ge", "{:g} or more"),
    ("lt", "below {:g}"),
    ("le", "at most {:g}"),
)


@dataclass(frozen=True, slots=True)
class Key:
    """One key of the configuration.

    Attributes:
        path: its name with the tables it is in; an array of tables stands as its name.
        field: the field of its table.
        holder: the class of that table.
        table: the class, when the key is a table or holds tables.
        shape: a ``value``, a ``table``, an ``array`` of tables, or tables ``by-name``.
    """

    path: tuple[str, ...]
    field: msgspec.structs.FieldInfo
    holder: type[msgspec.Struct]
    table: type[msgspec.Struct] | None
    shape: Literal["value", "table", "array", "by-name"]

    @property
    def dotted(self) -> str:
        """The path as in TOML."""
        return ".".join(self.path)


def keys_of(model: type[msgspec.Struct], front: tuple[str, ...] = ()) -> tuple[Key, ...]:
    """The keys of one table, in the order of the schema."""
    return tuple(_key((*front, field.name), field, model) for field in msgspec.structs.fields(model))


def all_keys(model: type[msgspec.Struct] = Config, front: tuple[str, ...] = ()) -> Iterator[Key]:
    """Every key of the configuration, tables before what is in them."""
    for key in keys_of(model, front):
        yield key
        if key.table is not None:
            yield from all_keys(key.table, key.path)


def value_text(key: Key) -> str:
    """What a key accepts, in words: ``a number above 0, or a table of them by name``."""
    laws = choices_of_laws(key.field.type)
    return " or ".join(map(to_toml, laws)) if laws else _text(inspect.type_info(key.field.type))


def choices_of_laws(annotation: Any) -> tuple[str, ...]:
    """The names that a key or field of a friction law accepts; none when it is not one."""
    if isinstance(annotation, NameOfLaw):
        return annotation.choices
    return next((found for part in get_args(annotation) if (found := choices_of_laws(part))), ())


def _key(path: tuple[str, ...], field: msgspec.structs.FieldInfo, holder: type[msgspec.Struct]) -> Key:
    kind = _bare(inspect.type_info(field.type))
    if isinstance(kind, inspect.StructType):
        return Key(path, field, holder, kind.cls, "table")
    if isinstance(kind, inspect.ListType) and isinstance(kind.item_type, inspect.StructType):
        return Key(path, field, holder, kind.item_type.cls, "array")
    if isinstance(kind, inspect.DictType) and isinstance(kind.value_type, inspect.StructType):
        return Key(path, field, holder, kind.value_type.cls, "by-name")
    return Key(path, field, holder, None, "value")


def _bare(kind: inspect.Type) -> inspect.Type:
    """Without notes, and of a table that may be absent the table."""
    while isinstance(kind, inspect.Metadata):
        kind = kind.type
    kinds = kind.types if isinstance(kind, inspect.UnionType) else ()
    return next((one for one in kinds if isinstance(one, inspect.StructType)), kind)


def _text(kind: inspect.Type) -> str:
    if isinstance(kind, inspect.Metadata):
        return _text(kind.type)
    if isinstance(kind, inspect.LiteralType):
        return " or ".join(map(to_toml, kind.values))
    if isinstance(kind, inspect.UnionType):
        return ", or ".join(_text(one) for one in kind.types if not isinstance(one, inspect.NoneType))
    if isinstance(kind, inspect.TupleType):
        return f"[{', '.join(_text(one).removeprefix('a ') for one in kind.item_types)}]"
    if isinstance(kind, inspect.ListType):
        item = kind.item_type
        kinds = item.types if isinstance(item, inspect.UnionType) else (item,)  # one kind in a list
        return ", or ".join(f"a list of {_plural(_text(one))}" for one in kinds)
    if isinstance(kind, inspect.DictType):
        return f"a table of name = {_text(kind.value_type)}"
    limits = [form.format(limit) for name, form in _BOUNDS if (limit := getattr(kind, name, None)) is not None]
    if shortest := getattr(kind, "min_length", None):
        limits.append("that is not empty" if shortest == 1 else f"of at least {shortest} characters")
    return f"{_PLAIN[type(kind)]} {' and '.join(limits)}".rstrip()


def _plural(text: str) -> str:
    noun = re.match(r"an? (whole number|number|file name|table)", text)
    return f"{noun.group(1)}s{text[noun.end() :]}" if noun else text
