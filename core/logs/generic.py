"""The generic decoder: one message at a time through rosbags, as the fallback and as the reference in tests."""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter
from typing import Any

import numpy as np

from collaudit.core.logs.extract import NS, check_counts
from collaudit.core.logs.layout import LayoutError
from collaudit.core.logs.profiles import Profile
from collaudit.core.logs.records import Channel
from collaudit.core.logs.schema import typesdict_of
from collaudit.core.logs.tables import GroupKey
from collaudit.core.series import FloatArray, IntArray

Columns = dict[str, IntArray | FloatArray]


def _deserializer(channel: Channel) -> Callable[[bytes], Any]:
    from rosbags.serde import SerdeError
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.EMPTY)
    store.register(typesdict_of(channel.type, channel.encoding, channel.schema_encoding, channel.schema))
    decode = store.deserialize_cdr if channel.encoding == "cdr" else store.deserialize_ros1

    def deserialize(data: bytes) -> Any:
        try:
            return decode(data, channel.type)
        except (SerdeError, AssertionError, IndexError, MemoryError) as error:
            raise LayoutError(f"the generic decoder refuses it: {error}") from error

    return deserialize


def _values(message: Any, path: str) -> FloatArray:
    if "[*]" in path:
        head, tail = path.split("[*]", 1)
        get = attrgetter(tail.lstrip("."))
        parts = [np.atleast_1d(get(item)) for item in attrgetter(head)(message)]
        return np.concatenate([*parts, np.empty(0)]).astype(np.float64)
    return np.atleast_1d(np.asarray(attrgetter(path)(message))).astype(np.float64)


def _names(message: Any, path: str) -> tuple[str, ...]:
    head, _, tail = path.partition("[*]")
    items = attrgetter(head)(message)
    return tuple(items) if not tail else tuple(attrgetter(tail.lstrip("."))(item) for item in items)


def _stamp(message: Any, path: str) -> int | None:
    try:
        stamp = attrgetter(path)(message)
        return int(stamp.sec) * NS + int(stamp.nanosec)
    except AttributeError:
        return None


def _columns(message: Any, profile: Profile) -> tuple[tuple[str, ...], Columns]:
    names = _names(message, profile.names) if profile.names is not None else ()
    if profile.role == "wrench":
        found = {"wrench": np.concatenate([_values(message, path) for path in profile.wrench])}
    else:
        found = {name: _values(message, path) for name, path in profile.quantities().items()}
    return names, {name: values for name, values in found.items() if values.size}


def generic_decoder(channel: Channel, profile: Profile) -> Callable[[bytes], tuple[GroupKey, Columns]]:
    """A function from one message's bytes to its key and its columns of one row.

    The function raises :class:`LayoutError` for a message that cannot be used.
    """
    deserialize = _deserializer(channel)

    def decode(data: bytes) -> tuple[GroupKey, Columns]:
        message = deserialize(data)
        try:
            names, found = _columns(message, profile)
        except AttributeError as error:
            raise LayoutError(f"its type lacks a field: {error}") from error
        counts = {name: values.size for name, values in found.items()}
        check_counts(profile, names, counts)
        columns: Columns = {name: values[None, :] for name, values in found.items()}
        stamp = _stamp(message, profile.stamp) if profile.stamp is not None else None
        if stamp is not None:
            columns["stamp_ns"] = np.array([stamp], dtype=np.int64)
        return GroupKey(names, tuple(counts.items()), stamp is not None), columns

    return decode
