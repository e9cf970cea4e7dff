"""The schema in words: what a key accepts, and which keys a table has."""

from __future__ import annotations

import re
import types
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date
from pathlib import Path, PurePath
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import msgspec
from msgspec import Meta

from collaudit.core.config.config_table import ConfigTable
from collaudit.core.config.schema import Config
from collaudit.core.config.toml_text import to_toml
from collaudit.core.friction_laws.law_registry import NameOfLaw

_PLAIN = {
    str: "text",
    bool: "true or false",
    Path: "a file name",
    PurePath: "a file name",
    date: "a date",
    float: "a number",
    int: "a whole number",
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
    holder: type[ConfigTable]
    table: type[ConfigTable] | None
    shape: Literal["value", "table", "array", "by-name"]

    @property
    def dotted(self) -> str:
        """The path as in TOML."""
        return ".".join(self.path)


def keys_of(model: type[ConfigTable], front: tuple[str, ...] = ()) -> tuple[Key, ...]:
    """The keys of one table, in the order of the schema."""
    return tuple(_key((*front, field.name), field, model) for field in msgspec.structs.fields(model))


def all_keys(model: type[ConfigTable] = Config, front: tuple[str, ...] = ()) -> Iterator[Key]:
    """Every key of the configuration, tables before what is in them."""
    for key in keys_of(model, front):
        yield key
        if key.table is not None:
            yield from all_keys(key.table, key.path)


def value_text(key: Key) -> str:
    """What a key accepts, in words: ``a number above 0, or a table of them by name``."""
    return _type_text(key.field.type)


def choices_of_laws(annotation: Any) -> tuple[str, ...]:
    """The names that a key or field of a friction law accepts; none when it is not one."""
    if isinstance(annotation, NameOfLaw):
        return annotation.choices
    return next((found for part in get_args(annotation) if (found := choices_of_laws(part))), ())


def _key(path: tuple[str, ...], field: msgspec.structs.FieldInfo, holder: type[ConfigTable]) -> Key:
    annotation = _bare(field.type)
    if _is_table(annotation):
        return Key(path, field, holder, annotation, "table")
    inner = get_args(annotation)[-1:]
    if inner and _is_table(inner[0]):
        if get_origin(annotation) is list:
            return Key(path, field, holder, inner[0], "array")
        if get_origin(annotation) is dict:
            return Key(path, field, holder, inner[0], "by-name")
    return Key(path, field, holder, None, "value")


def _is_table(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, ConfigTable)


def _bare(annotation: Any) -> Any:
    """Without notes, and of a table that may be absent the table."""
    if get_origin(annotation) is Annotated:
        return _bare(get_args(annotation)[0])
    if get_origin(annotation) in (Union, types.UnionType):
        tables = [kind for kind in get_args(annotation) if _is_table(kind)]
        return tables[0] if tables else annotation
    return annotation


def _type_text(annotation: Any) -> str:
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        if named := choices_of_laws(annotation):
            return " or ".join(to_toml(choice) for choice in named)
        return _bounded(_type_text(inner[0]), inner[1:])
    if origin is Literal:
        return " or ".join(to_toml(value) for value in inner)
    if origin in (Union, types.UnionType):
        return ", or ".join(_type_text(kind) for kind in inner if kind is not type(None))
    if origin is tuple:
        return f"[{', '.join(_type_text(kind).removeprefix('a ') for kind in inner)}]"
    if origin is list:
        kinds = get_args(inner[0]) if get_origin(inner[0]) in (Union, types.UnionType) else inner  # one kind in a list
        return ", or ".join(f"a list of {_plural(_type_text(kind))}" for kind in kinds)
    if origin is dict:
        return f"a table of name = {_type_text(inner[1])}"
    if _is_table(annotation):
        return "a table"
    return _PLAIN.get(annotation, str(annotation))


def _plural(text: str) -> str:
    noun = re.match(r"an? (whole number|number|file name|table)", text)
    return f"{noun.group(1)}s{text[noun.end() :]}" if noun else text


def _bounded(text: str, notes: tuple[Any, ...]) -> str:
    limits = [
        form.format(limit)
        for item in notes
        if isinstance(item, Meta)
        for name, form in _BOUNDS
        if (limit := getattr(item, name)) is not None
    ]
    shortest = max((item.min_length or 0 for item in notes if isinstance(item, Meta)), default=0)
    if shortest:
        limits.append("that is not empty" if shortest == 1 else f"of at least {shortest} characters")
    return f"{text} {' and '.join(limits)}" if limits else text
