"""The generic decoder: one message at a time, as the fallback, as the reference in tests, and for JSON and protobuf."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from collaudit.core.logs.messages.column_extraction import check_counts, choice_of, usable_counts
from collaudit.core.logs.messages.decoded_columns import GroupKey
from collaudit.core.logs.messages.layout import LayoutError
from collaudit.core.logs.messages.message_schema import SchemaError, typesdict_of
from collaudit.core.logs.messages.profiles import Profile
from collaudit.core.logs.storage.records import NS_PER_S, Channel
from collaudit.core.numeric.arrays import FloatArray, IntArray

Columns = dict[str, IntArray | FloatArray]
Deserializer = Callable[[bytes], Any]
_MAX_STAMP = (1 << 63) - 1


def _ros(channel: Channel, extra: Mapping[str, Any]) -> Deserializer:
    from rosbags.serde import SerdeError
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.EMPTY)
    store.register(typesdict_of(channel.type, channel.encoding, channel.schema_encoding, channel.schema, extra))
    decode = store.deserialize_cdr if channel.encoding == "cdr" else store.deserialize_ros1

    def deserialize(data: bytes) -> Any:
        try:
            return decode(data, channel.type)
        except (SerdeError, AssertionError, IndexError, MemoryError) as error:
            raise LayoutError(f"the generic decoder refuses it: {error}") from error

    return deserialize


def _json(channel: Channel, extra: Mapping[str, Any]) -> Deserializer:
    import json

    def deserialize(data: bytes) -> Any:
        try:
            return json.loads(data)
        except (ValueError, RecursionError) as error:
            raise LayoutError(f"it is not JSON: {error}") from error

    return deserialize


def _protobuf(channel: Channel, extra: Mapping[str, Any]) -> Deserializer:
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


_DESERIALIZERS = {"cdr": _ros, "ros1": _ros, "json": _json, "protobuf": _protobuf}


def _field(message: Any, path: str) -> Any:
    """A field by its dotted path; None where the message leaves it out."""
    for name in path.split(".") if path else ():
        if isinstance(message, dict):
            message = message.get(name)
        elif hasattr(message, "HasField") and _left_out(message, name):
            return None
        else:
            message = getattr(message, name)
        if message is None:
            return None
    return message


def _left_out(message: Any, name: str) -> bool:
    """Whether an optional protobuf field is not set."""
    field = message.DESCRIPTOR.fields_by_name.get(name)
    if field is None:
        raise AttributeError(name)
    return bool(field.has_presence and not message.HasField(name))


def _values(message: Any, path: str) -> FloatArray:
    for alternative in path.split("|"):
        try:
            parts = [_one(message, single) for single in alternative.split(",")]
        except AttributeError:
            continue
        values = [part for part in parts if part is not None]
        if len(values) == len(parts) and any(part.size for part in values):
            return np.concatenate(values)
    return np.empty(0)


def _one(message: Any, path: str) -> FloatArray | None:
    if "[*]" not in path:
        value = _field(message, path)
        return None if value is None else _numbers(value)
    head, tail = path.split("[*]", 1)
    items = _field(message, head) or ()
    if tail.startswith("{"):
        return np.array([value for item in items for value in _chosen(item, tail)], dtype=np.float64)
    values = [_field(item, tail.lstrip(".")) for item in items]
    if all(value is None for value in values):
        return np.empty(0)
    return _numbers([np.nan if value is None else value for value in values])


def _numbers(value: Any) -> FloatArray:
    """A number or a row of numbers; text that looks like one is none.

    Raises:
        ValueError: it is something else.
    """
    array = np.atleast_1d(np.asarray(value))
    if (
        array.ndim != 1
        or array.dtype.kind not in "biufO"
        or any(isinstance(item, str | bytes) for item in _items(array))
    ):
        raise ValueError("it is no number and no row of numbers")
    return array.astype(np.float64)


def _items(array: np.ndarray[Any, Any]) -> list[Any]:
    return array.tolist() if array.dtype.kind == "O" else []


def _chosen(item: Any, choice: str) -> tuple[float, ...]:
    keys, values, wanted = choice_of(choice)
    names, numbers = list(_field(item, keys)), _field(item, values)
    if wanted not in names or names.index(wanted) >= len(numbers):
        return ()
    return (float(numbers[names.index(wanted)]),)


def _names(message: Any, path: str) -> tuple[str, ...]:
    head, _, tail = path.partition("[*]")
    value = _field(message, head)
    if isinstance(value, str):
        return (value,)
    names = tuple(_field(item, tail.lstrip(".")) for item in value or ())
    if not all(isinstance(name, str) for name in names):
        raise LayoutError("a joint name is no text")
    return names


def _counted(message: Any, profile: Profile) -> bool:
    """Whether a phase is told by a number, not by a word."""
    return profile.role == "phase" and isinstance(_field(message, profile.names or ""), int | float)


def _stamp(message: Any, path: str) -> int | None:
    for alternative in path.split("|"):
        try:
            parts = [_field(message, single) for single in alternative.split(",")]
        except AttributeError:
            continue
        if all(isinstance(part, int) for part in parts) and len(parts) == 2:
            return int(parts[0]) * NS_PER_S + int(parts[1])
    return None


def generic_decoder(
    channel: Channel, profile: Profile, extra: Mapping[str, Any] = {}
) -> Callable[[bytes], tuple[GroupKey, Columns]]:
    """A function from one message's bytes to its key and its columns of one row.

    The function raises :class:`LayoutError` for a message that cannot be used.

    Raises:
        SchemaError: the channel's definition cannot be understood.
    """
    deserialize = _DESERIALIZERS[channel.encoding](channel, extra)

    def decode(data: bytes) -> tuple[GroupKey, Columns]:
        message = deserialize(data)
        try:
            worded = profile.names is not None and not _counted(message, profile)
            named = _names(message, profile.names) if worded and profile.names is not None else ()
            found = (
                {}
                if named and profile.role == "phase"
                else {name: _values(message, path) for name, path in profile.quantities().items()}
            )
        except (AttributeError, TypeError, ValueError, OverflowError) as error:
            raise LayoutError(f"a field is not what its type says: {error}") from error
        counts = usable_counts({name: values.size for name, values in found.items() if values.size})
        names = check_counts(profile, named, counts)
        columns: Columns = {name: found[name][None, :] for name in counts}
        stamp = _stamp(message, profile.stamp) if profile.stamp is not None else None
        if stamp is not None and not -_MAX_STAMP <= stamp <= _MAX_STAMP:
            raise LayoutError("its stamp is beyond all times")
        if stamp is not None:
            columns["stamp_ns"] = np.array([stamp], dtype=np.int64)
        return GroupKey(names, tuple(counts.items()), stamp is not None), columns

    return decode
