"""Wire types: the shape of a message as its definition states it, which the log or a folder of .msg files holds."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from collaudit.core.errors import ConfigError
from collaudit.core.logs.storage.records import MAX_SCHEMA_BYTES
from collaudit.core.small_files import read_small

_SEPARATOR = "=" * 80
_MAX_DEPTH = 32

#: NumPy type codes of the primitive types of ROS messages.
PRIMITIVES = {
    "bool": "u1", "byte": "u1", "char": "u1", "octet": "u1", "int8": "i1", "uint8": "u1",
    "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8",
    "float32": "f4", "float64": "f8",
}  # fmt: skip


class SchemaError(Exception):
    """A message definition cannot be understood; the reason is the message."""


@dataclass(frozen=True, slots=True)
class Number:
    """A number of NumPy type ``code`` (without byte order)."""

    code: str


@dataclass(frozen=True, slots=True)
class Text:
    """A string."""


@dataclass(frozen=True, slots=True)
class Struct:
    """A message: named fields in order."""

    name: str
    fields: tuple[tuple[str, WireType], ...]


@dataclass(frozen=True, slots=True)
class Repeated:
    """``count`` items, or a counted sequence when ``count`` is None."""

    item: WireType
    count: int | None


WireType = Number | Text | Struct | Repeated


def definitions_of(type_name: str, encoding: str, text: str) -> Mapping[str, Any]:
    """Definitions in one text, by type name, as rosbags parses them.

    Raises:
        SchemaError: the text cannot be understood.
    """
    from rosbags.typesys import TypesysError, get_types_from_idl, get_types_from_msg

    try:
        if encoding == "ros2idl":
            return get_types_from_idl(_idl(text))
        even = re.sub(r"(?m)^={20,}[ \t]*\r?$", _SEPARATOR, text.replace("\r\n", "\n"))
        return get_types_from_msg(even, type_name)
    except (TypesysError, RecursionError, ValueError, AssertionError, KeyError, IndexError) as error:
        first = (str(error).strip() or type(error).__name__).splitlines()[0]
        raise SchemaError(f"the definition of {type_name} cannot be parsed: {first[:200]}") from error


def _idl(text: str) -> str:
    """IDL files one after the other, as bags hold them, as one text: without their titles and what they include."""
    parts = re.sub(r"(?m)^={20,}[ \t]*\n(IDL:.*)?$", "", text.replace("\r\n", "\n"))
    return re.sub(r"(?m)^[ \t]*#[ \t]*(include|pragma|ifndef|ifdef|define|endif)\b.*$", "", parts)


@lru_cache(maxsize=4)
def _store(encoding: str) -> Mapping[str, Any]:
    """The common ROS types, for files that do not hold their definitions."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS1_NOETIC if encoding == "ros1" else Stores.ROS2_HUMBLE).fielddefs


def typesdict_of(
    type_name: str, message_encoding: str, schema_encoding: str, schema: bytes, extra: Mapping[str, Any] = {}
) -> dict[str, Any]:
    """Definitions of a type and of all it refers to, as rosbags parses them.

    Args:
        type_name: three-part ROS type name.
        message_encoding: ``cdr`` or ``ros1``.
        schema_encoding: ``ros1msg``, ``ros2msg``, ``ros2idl`` or "".
        schema: definition text; what it lacks is taken from ROS's own common types.
        extra: further definitions by name.

    Raises:
        SchemaError: a definition is missing or cannot be understood.
    """
    if len(schema) > MAX_SCHEMA_BYTES:
        raise SchemaError(f"the definition of {type_name} is {len(schema)} bytes long")
    types = dict(extra)
    if schema.strip():
        types.update(definitions_of(type_name, schema_encoding, schema.decode("utf-8", errors="replace")))
    out: dict[str, Any] = {}
    wanted = [type_name]
    while wanted:
        name = wanted.pop()
        if name in out:
            continue
        found = types.get(name) or _store(message_encoding).get(name)
        if found is None:
            raise SchemaError(f"the definition of {name} is missing")
        out[name] = found
        wanted += [item for _, desc in found[1] if (item := _referred(desc)) is not None]
    return out


def _referred(desc: Any) -> str | None:
    while int(desc[0]) in (3, 4):
        desc = desc[1][0]
    return desc[1] if int(desc[0]) == 2 else None


@dataclass(slots=True)
class _Builder:
    types: Mapping[str, Any]
    ros1: bool

    def struct(self, name: str, depth: int = 0) -> Struct:
        if depth > _MAX_DEPTH:
            raise SchemaError(f"{name} is nested more than {_MAX_DEPTH} deep")
        fields = tuple((key, self.wire(desc, depth + 1)) for key, desc in self.types[name][1])
        if not fields and not self.ros1:  # an empty ROS 2 message is one byte on the wire
            fields = (("structure_needs_at_least_one_member", Number("u1")),)
        return Struct(name, fields)

    def wire(self, desc: Any, depth: int) -> WireType:
        kind, value = int(desc[0]), desc[1]
        if kind == 1:
            return self.base(value[0])
        if kind == 2:
            return self.struct(value, depth)
        item = self.wire(value[0], depth)
        return Repeated(item, int(value[1]) if kind == 3 else None)

    def base(self, name: str) -> WireType:
        if name == "string":
            return Text()
        if name not in PRIMITIVES:
            raise SchemaError(f"fields of type {name} cannot be read")
        return Number(PRIMITIVES[name])


@lru_cache(maxsize=64)
def _parsed(type_name: str, message_encoding: str, schema_encoding: str, schema: bytes) -> Struct:
    types = typesdict_of(type_name, message_encoding, schema_encoding, schema)
    return _Builder(types, message_encoding == "ros1").struct(type_name)


def parse_schema(
    type_name: str, message_encoding: str, schema_encoding: str, schema: bytes, extra: Mapping[str, Any] = {}
) -> Struct:
    """The wire type of a channel; arguments and errors as :func:`typesdict_of`."""
    if not extra:
        return _parsed(type_name, message_encoding, schema_encoding, schema)
    types = typesdict_of(type_name, message_encoding, schema_encoding, schema, extra)
    return _Builder(types, message_encoding == "ros1").struct(type_name)


def smallest_size(kind: WireType) -> int:
    """A lower bound of the bytes a value takes on the wire, used to refuse impossible lengths."""
    if isinstance(kind, Number):
        return int(kind.code[1])
    if isinstance(kind, Text):
        return 4
    if isinstance(kind, Struct):
        return sum(smallest_size(item) for _, item in kind.fields)
    return 4 if kind.count is None else kind.count * smallest_size(kind.item)


@lru_cache(maxsize=8)
def _folder(folder: Path) -> dict[str, Any]:
    if not folder.is_dir():
        raise ConfigError("there is no such folder of message definitions", where=str(folder), hint="see --msg-path")
    files = sorted(folder.rglob("*.msg"))
    if not files:
        raise ConfigError("the folder holds no .msg files", where=str(folder), expected="PACKAGE/msg/Type.msg")
    found: dict[str, Any] = {}
    for file in files:
        found.update(_one(file))
    return found


def _one(file: Path) -> dict[str, Any]:
    """The definitions of one file; its package is the folder that holds ``msg``, or the folder itself."""
    holder = file.resolve().parent
    package = holder.parent.name if holder.name == "msg" else holder.name
    try:
        text = read_small(file, MAX_SCHEMA_BYTES).decode("utf-8", errors="replace")
        return dict(definitions_of(f"{package}/msg/{file.stem}", "ros2msg", text))
    except SchemaError as error:
        raise ConfigError(f"cannot be read as a message definition: {error}", where=str(file)) from error
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", where=str(file)) from error


def read_definitions(folders: Sequence[Path]) -> dict[str, Any]:
    """Definitions by type name.

    Args:
        folders: each holds PACKAGE/msg/Type.msg at any depth, of ROS 1 or ROS 2.

    Raises:
        ConfigError: a folder is missing or empty, or a file is no message definition.
    """
    found: dict[str, Any] = {}
    for folder in folders:
        found.update(_folder(folder))
    return found
