"""Messages of values (JSON, protobuf) laid into bytes: their fields are found as those of ROS messages are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from collaudit.core.logs.messages.layout import Chars, Layout, LayoutError, Node, Numbers
from collaudit.core.logs.messages.message_schema import SchemaError
from collaudit.core.logs.storage.records import Channel

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
