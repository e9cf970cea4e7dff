"""The schema in words: what a key accepts, and which keys a table has."""

from __future__ import annotations

import re
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from collaudit.core.config.schema import Config
from collaudit.core.config.toml_text import to_toml
from collaudit.core.dataclass import dataclass
from collaudit.core.friction_laws.law_registry import NameOfLaw

_PLAIN = {str: "text", bool: "true or false", Path: "a file name", float: "a number", int: "a whole number"}
_BOUNDS = (("gt", "above {:g}"), ("ge", "{:g} or more"), ("lt", "below {:g}"), ("le", "at most {:g}"))


@dataclass(frozen=True, slots=True)
class Key:
    """One key of the configuration.

    Attributes:
        path: its name with the tables it is in; an array of tables stands as its name.
        info: pydantic's field.
        table: the model, when the key is a table or holds tables.
        shape: a ``value``, a ``table``, an ``array`` of tables, or tables ``by-name``.
    """

    path: tuple[str, ...]
    info: FieldInfo
    table: type[BaseModel] | None
    shape: Literal["value", "table", "array", "by-name"]

    @property
    def dotted(self) -> str:
        """The path as in TOML."""
        return ".".join(self.path)

    @property
    def header(self) -> str:
        """The table's header as in TOML."""
        return {"array": f"[[{self.dotted}]]", "by-name": f"[{self.dotted}.NAME]"}.get(self.shape, f"[{self.dotted}]")


def keys_of(model: type[BaseModel], front: tuple[str, ...] = ()) -> tuple[Key, ...]:
    """The keys of one table, in the order of the schema."""
    return tuple(_key((*front, name), info) for name, info in model.model_fields.items())


def all_keys(model: type[BaseModel] = Config, front: tuple[str, ...] = ()) -> Iterator[Key]:
    """Every key of the configuration, tables before what is in them."""
    for key in keys_of(model, front):
        yield key
        if key.table is not None:
            yield from all_keys(key.table, key.path)


def find_key(path: tuple[str | int, ...]) -> Key | None:
    """The key a data path leads to; paths into a key's own value lead to that key. None when there is none."""
    model: type[BaseModel] | None = Config
    found: Key | None = None
    name_follows = False
    for part in path:
        if isinstance(part, int) or name_follows:
            name_follows = False
            continue
        if model is None:
            break
        match = [key for key in keys_of(model, found.path if found else ()) if key.path[-1] == part]
        if not match:
            return None
        found = match[0]
        model = found.table
        name_follows = found.shape == "by-name"
    return found


def value_text(info: FieldInfo) -> str:
    """What a key accepts, in words: ``a number above 0, or a table of them by name``."""
    return _type_text(Annotated[(info.annotation, *info.metadata)] if info.metadata else info.annotation)


def default_text(info: FieldInfo) -> str:
    """The default as TOML, or ``absent``, or ``required``."""
    if info.is_required():
        return "required"
    value = info.get_default(call_default_factory=True)
    if isinstance(value, BaseModel):
        value = value.model_dump(mode="json", exclude_none=True)
    return "absent" if value is None else to_toml(value)


def _key(path: tuple[str, ...], info: FieldInfo) -> Key:
    annotation = info.annotation
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return Key(path, info, annotation, "table")
    inner = get_args(annotation)[-1:]
    if inner and isinstance(inner[0], type) and issubclass(inner[0], BaseModel):
        if get_origin(annotation) is list:
            return Key(path, info, inner[0], "array")
        if get_origin(annotation) is dict:
            return Key(path, info, inner[0], "by-name")
    return Key(path, info, None, "value")


def _type_text(annotation: Any) -> str:
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        named = [item for item in inner[1:] if isinstance(item, NameOfLaw)]
        if named:
            return " or ".join(to_toml(choice) for choice in named[0].choices)
        return _bounded(_type_text(inner[0]), inner[1:])
    if origin is Literal:
        return " or ".join(to_toml(value) for value in inner)
    if origin in (Union, types.UnionType):
        return ", or ".join(_type_text(kind) for kind in inner if kind is not type(None))
    if origin is tuple:
        return f"[{', '.join(_type_text(kind).removeprefix('a ') for kind in inner)}]"
    if origin is list:
        return f"a list of {_plural(_type_text(inner[0]))}"
    if origin is dict:
        return f"a table of name = {_type_text(inner[1])}"
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return "a table"
    return _PLAIN.get(annotation, str(annotation))


def _plural(text: str) -> str:
    noun = re.match(r"an? (whole number|number|file name|table)", text)
    return f"{noun.group(1)}s{text[noun.end() :]}" if noun else text


def _bounded(text: str, metadata: tuple[Any, ...]) -> str:
    limits: list[str] = []
    for item in metadata:
        for part in item.metadata if isinstance(item, FieldInfo) else (item,):
            limits += [form.format(getattr(part, name)) for name, form in _BOUNDS if hasattr(part, name)]
    return f"{text} {' and '.join(limits)}" if limits else text
