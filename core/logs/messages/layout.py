"""The layout compiler: where every field of one message lies, and which bytes prove that another has the same layout.

A message's layout depends on its type and on the lengths it holds (of strings and sequences). Two messages
of one type and equal size have the same layout when all their length words are equal: the first length word
stands at a fixed place, and each one fixes the place of the next.

CDR (OMG formal/02-06-51, 15.3): a four-byte encapsulation header, whose second byte tells the byte order; each
primitive is aligned to its size counted from the end of that header; an empty sequence takes no padding;
strings are counted with their terminating NUL. ROS 1 has no header, no alignment and no NUL.

Messages of values (JSON, protobuf) are laid into bytes: their fields are found as those of ROS messages are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from collaudit.core.logs.messages.message_schema import (
    MESSAGE,
    PRIMITIVE,
    PRIMITIVES,
    SEQUENCE,
    FieldType,
    Schema,
    SchemaError,
)
from collaudit.core.logs.storage.readers import Channel

MAX_LEAVES = 200_000


class LayoutError(Exception):
    """A message does not have the shape of its type; the reason is the message."""


@dataclass(frozen=True, slots=True)
class Numbers:
    """``count`` numbers side by side from byte ``offset``; ``code`` is a NumPy type with byte order."""

    offset: int
    code: str
    count: int

    @property
    def stop(self) -> int:
        """The byte after them."""
        return self.offset + self.count * int(self.code[2:])


#: Stands for a number that one item of a sequence lacks and others have.
MISSING = Numbers(0, "<f8", 0)


@dataclass(frozen=True, slots=True)
class Chars:
    """The ``size`` bytes of a string from ``offset``, its NUL not counted."""

    offset: int
    size: int


#: A field: a message by the names of its fields, a sequence of messages or strings, an array or a number, a string.
Node = dict[str, Any] | list[Any] | Numbers | Chars


@dataclass(frozen=True, slots=True)
class Layout:
    """Where the fields of a message lie.

    Attributes:
        data: the message.
        root: its fields.
        guards: (start, stop) of the bytes that must agree for a message to share this layout.
    """

    data: bytes
    root: Node | None
    guards: tuple[tuple[int, int], ...] = ()


@dataclass(slots=True)
class _Walk:
    schema: Schema
    data: bytes
    pos: int = 0
    origin: int = 0
    order: str = "<"
    aligned: bool = False
    guards: list[tuple[int, int]] = field(default_factory=list)
    leaves: int = 0

    def encapsulation(self) -> None:
        """Read the header of CDR: plain CDR of version 1, big (0) or little endian (1)."""
        if len(self.data) < 4:
            raise LayoutError("it is too short for an encapsulation header")
        kind = int.from_bytes(self.data[:2], "big")
        if kind not in (0, 1):
            raise LayoutError(f"its CDR encapsulation 0x{kind:04x} is not plain CDR")
        self.order = "<" if kind & 1 else ">"
        self.aligned = True
        self.guards.append((0, 2))
        self.pos = self.origin = 4

    def align(self, size: int) -> None:
        if self.aligned:
            self.pos += -(self.pos - self.origin) % size

    def take(self, count: int) -> int:
        start = self.pos
        self.pos += count
        if self.pos > len(self.data):
            raise LayoutError(f"it ends at byte {len(self.data)}, inside a field that needs {self.pos}")
        return start

    def length(self) -> int:
        self.align(4)
        start = self.take(4)
        self.guards.append((start, start + 4))
        return int.from_bytes(self.data[start : start + 4], "little" if self.order == "<" else "big")

    def value(self, field: FieldType) -> Node:
        self.leaves += 1
        if self.leaves > MAX_LEAVES:
            raise LayoutError(f"it has more than {MAX_LEAVES} fields")
        kind, content = field
        if kind == MESSAGE:
            return {name: self.value(inner) for name, inner in self.schema.fields(content)}
        if kind == PRIMITIVE:
            return self.text() if content[0] == "string" else self.run(content[0], 1)
        item, count = content
        if kind == SEQUENCE:
            count = self.count(item)
        if item[0] == PRIMITIVE and item[1][0] != "string":
            return self.run(item[1][0], count)
        return [self.value(item) for _ in range(count)]

    def run(self, primitive: str, count: int) -> Numbers:
        code = PRIMITIVES[primitive]
        size = int(code[1])
        if count:
            self.align(size)
        return Numbers(self.take(count * size), self.order + code, count)

    def text(self) -> Chars:
        size = self.length()
        return Chars(self.take(size), max(size - 1, 0) if self.aligned else size)

    def count(self, item: FieldType) -> int:
        count = self.length()
        if count * max(self.schema.smallest_size(item), 1) > len(self.data) - self.pos:
            raise LayoutError(f"a sequence claims {count} items, more than the message can hold")
        return count


def walk(schema: Schema, data: bytes, *, cdr: bool) -> Layout:
    """Locate every field of one message.

    Args:
        schema: the message's type.
        data: its bytes.
        cdr: True for ROS 2's CDR with its encapsulation header, False for ROS 1.

    Raises:
        LayoutError: the bytes do not have the shape of the type. CDR may end in up to three bytes of padding.
    """
    state = _Walk(schema, data)
    if cdr:
        state.encapsulation()
    root = state.value((MESSAGE, schema.name))
    slack = len(data) - state.pos
    if slack > (3 if cdr else 0):
        raise LayoutError(f"it is {slack} bytes longer than its type")
    return Layout(data, root, tuple(state.guards))


Deserializer = Callable[[bytes], Any]


def _json(channel: Channel) -> Deserializer:
    import json

    def deserialize(data: bytes) -> Any:
        try:
            return json.loads(data)
        except (ValueError, RecursionError) as error:
            raise LayoutError(f"it is not JSON: {error}") from error

    return deserialize


def _protobuf(channel: Channel) -> Deserializer:
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
    from google.protobuf.message import DecodeError

    try:
        files = descriptor_pb2.FileDescriptorSet.FromString(channel.schema)
        pool = descriptor_pool.DescriptorPool()
        for file in files.file:
            pool.Add(file)
        kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(channel.type))
    except (DecodeError, TypeError, KeyError) as error:
        raise SchemaError(f"the protobuf definition of {channel.type} cannot be understood: {error}") from error

    def deserialize(data: bytes) -> Any:
        try:
            return kind.FromString(data)
        except DecodeError as error:
            raise LayoutError(f"it is not a {channel.type}: {error}") from error

    return deserialize


_DESERIALIZERS = {"json": _json, "protobuf": _protobuf}


class _Laid:
    """Values laid into bytes side by side, so that a message of values has a layout as one of bytes has."""

    def __init__(self) -> None:
        self.data = bytearray()

    def node(self, value: Any) -> Node | None:
        """Lay a value and all that is in it; None of what the message leaves out."""
        if isinstance(value, str):
            text = value.encode("utf-8", "surrogatepass")
            self.data += text
            return Chars(len(self.data) - len(text), len(text))
        if isinstance(value, int | float):
            return self.numbers([value], "<f8" if isinstance(value, float) else "<i8" if value < 1 << 63 else "<u8")
        if isinstance(value, dict):
            return {name: self.node(item) for name, item in value.items()}
        if hasattr(value, "DESCRIPTOR"):
            held = [one.name for one in value.DESCRIPTOR.fields if not one.has_presence or value.HasField(one.name)]
            return {name: self.node(getattr(value, name)) for name in held}
        if value is None or isinstance(value, bytes):
            return None
        items = list(value)
        if all(item is None or isinstance(item, int | float) for item in items):
            return self.numbers([np.nan if item is None else item for item in items], "<f8")
        return [self.node(item) for item in items]

    def numbers(self, values: list[float], code: str) -> Numbers:
        """Lay a row of numbers."""
        self.data += np.array(values, dtype=code).tobytes()
        return Numbers(len(self.data) - 8 * len(values), code, len(values))


def value_layouts(channel: Channel) -> Callable[[bytes], Layout]:
    """What lays one message of values out; it raises :class:`LayoutError` for a message that cannot be read.

    Raises:
        SchemaError: the channel's definition cannot be understood.
    """
    deserialize = _DESERIALIZERS[channel.encoding](channel)

    return lambda data: lay_out(deserialize(data))


def lay_out(message: Any) -> Layout:
    """The layout of a message of values: numbers, texts, and mappings or sequences of them.

    Raises:
        LayoutError: it is nested too deeply.
    """
    laid = _Laid()
    try:
        root = laid.node(message)
    except OverflowError as error:
        raise LayoutError("a number in it is beyond 64 bits") from error
    except RecursionError as error:
        raise LayoutError("it is nested too deeply") from error
    return Layout(bytes(laid.data), root)
