"""The shape of a message as its definition states it, which the log or a folder of .msg files holds."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias

from collaudit.core.errors import ConfigError
from collaudit.core.logs.storage.readers import MAX_SCHEMA_BYTES
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


#: A field's type as rosbags parses it: a kind of those below, and what that kind needs.
FieldType: TypeAlias = tuple[int, Any]
#: Kinds of fields: a primitive (name, bound), a message (name), an array (item, count), a sequence (item, bound).
PRIMITIVE, MESSAGE, ARRAY, SEQUENCE = 1, 2, 3, 4
#: An empty ROS 2 message is one byte on the wire.
_EMPTY = (("structure_needs_at_least_one_member", (PRIMITIVE, ("uint8", 0))),)


@dataclass(frozen=True, slots=True, eq=False)
class Schema:
    """A type of message with all types that it refers to.

    Attributes:
        name: of the type.
        encoding: ``cdr`` or ``ros1``.
        stated: definitions by type name, as rosbags parses them; what they lack is taken from ROS's own common types.
        least: bytes that a message of each type takes at least on the wire, as far as they were asked for.
    """

    name: str
    encoding: str
    stated: Mapping[str, Any]
    least: dict[str, int] = field(default_factory=dict)

    def fields(self, name: str) -> Sequence[tuple[str, FieldType]]:
        """Names and types of the fields of a type, in order.

        Raises:
            SchemaError: its definition is missing.
        """
        found = self.stated.get(name) or _store(self.encoding).get(name)
        if found is None:
            raise SchemaError(f"the definition of {name} is missing")
        return found[1] or (() if self.encoding == "ros1" else _EMPTY)

    def smallest_size(self, kind: FieldType, depth: int = 0) -> int:
        """A lower bound of the bytes a value takes on the wire, used to refuse impossible lengths.

        Raises:
            SchemaError: a definition is missing, a field is of no type that is read, or a message is nested too deeply,
                as one that holds itself is.
        """
        what, content = kind
        if what == PRIMITIVE:
            if content[0] != "string" and content[0] not in PRIMITIVES:
                raise SchemaError(f"fields of type {content[0]} cannot be read")
            return 4 if content[0] == "string" else int(PRIMITIVES[content[0]][1])
        if what == MESSAGE:
            if depth > _MAX_DEPTH:
                raise SchemaError(f"{content} is nested more than {_MAX_DEPTH} deep")
            if content not in self.least:
                self.least[content] = sum(self.smallest_size(inner, depth + 1) for _, inner in self.fields(content))
            return self.least[content]
        item, count = content
        size = self.smallest_size(item, depth + 1)
        return count * size if what == ARRAY else 4


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


def parse_schema(
    type_name: str, message_encoding: str, schema_encoding: str, schema: bytes, extra: Mapping[str, Any] = {}
) -> Schema:
    """A type and all that it refers to.

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
    parsed = Schema(type_name, message_encoding, types)
    parsed.smallest_size((MESSAGE, type_name))
    return parsed


@lru_cache(maxsize=8)
def _folder(folder: Path) -> dict[str, Any]:
    files = sorted(folder.rglob("*.msg"))
    if not files:
        problem = "the folder holds no .msg files" if folder.is_dir() else "there is no such folder"
        raise ConfigError(problem, where=str(folder), expected="PACKAGE/msg/Type.msg", hint="see [log] msg_path")
    return {name: fields for file in files for name, fields in _one(file).items()}


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
    return {name: fields for folder in folders for name, fields in _folder(folder).items()}
