"""What a reader hands on: of messages channels and batches located in a byte buffer, of tables their columns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.parallel import Progress

ByteArray = NDArray[np.uint8]
#: Schemas larger than this are not read.
MAX_SCHEMA_BYTES = 1 << 20
#: Further places of damage are not listed.
MAX_DAMAGE = 20
NS_PER_S = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Channel:
    """One stream of messages of one type by one publisher.

    Attributes:
        key: number that batches refer to, unique in its reader.
        topic: topic name.
        type: message type; ROS names in the three-part form ``sensor_msgs/msg/JointState``.
        encoding: how messages are encoded: ``cdr``, ``ros1``, ``protobuf``, ``json`` …
        schema_encoding: how the schema is written: ``ros2msg``, ``ros1msg``, ``ros2idl``, ``protobuf`` …, or "".
        schema: the schema's bytes; empty when the file does not hold it.
        claimed: messages that the file's summary claims; 0 where it claims none.
    """

    key: int
    topic: str
    type: str
    encoding: str
    schema_encoding: str
    schema: bytes
    claimed: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """Messages of one channel inside one buffer, in the order of the file.

    Attributes:
        key: the channel.
        data: (b,) bytes the messages lie in.
        start: (n,) offset of each message's payload in ``data``.
        length: (n,) bytes of each payload; ``start + length <= b`` holds.
        log_ns: (n,) time of recording, ns.
    """

    key: int
    data: ByteArray
    start: IntArray
    length: IntArray
    log_ns: IntArray

    def payload(self, index: int) -> bytes:
        """One message's bytes."""
        start = int(self.start[index])
        return self.data[start : start + int(self.length[index])].tobytes()


@dataclass(frozen=True, slots=True, eq=False)
class Located:
    """Messages of a buffer in the order they lie in it.

    Attributes:
        data: (b,) bytes.
        start, length: (n,) payload offsets and sizes.
        channel: (n,) channel numbers.
        log_ns: (n,) times of recording.
        others: records that define schemas and channels: their kind or header, and their body.
        problem: what is wrong with the buffer, or None.
    """

    data: ByteArray
    start: IntArray
    length: IntArray
    channel: IntArray
    log_ns: IntArray
    others: Sequence[tuple[Any, bytes]] = ()
    problem: str | None = None

    def by_channel(self) -> list[Batch]:
        """The messages of each channel, in the order of their numbers."""
        out = []
        for number in np.unique(self.channel).tolist():
            mine = np.flatnonzero(self.channel == number)
            out.append(Batch(number, self.data, self.start[mine], self.length[mine], self.log_ns[mine]))
        return out


def gather(data: ByteArray, start: IntArray, width: int) -> ByteArray:
    """Copy ``width`` bytes from each offset into the rows of a matrix.

    Args:
        data: (b,) bytes.
        start: (n,) offsets, each with ``0 <= start`` and ``start + width <= b``.
        width: bytes per row, at least 1.

    Returns:
        (n, width) bytes.
    """
    count = start.shape[0]
    if count == 0 or width == 0:
        return np.empty((count, width), dtype=np.uint8)
    windows = np.ndarray(
        shape=(data.shape[0] - width + 1,), dtype=np.dtype(f"V{width}"), buffer=data.data, strides=(1,)
    )
    return windows[start].view(np.uint8).reshape(count, width)


@dataclass(frozen=True, slots=True)
class Damage:
    """A place where a file could not be read as it should be.

    Attributes:
        text: what is wrong, and where, in one sentence.
        lost: True when messages were, or may have been, lost.
    """

    text: str
    lost: bool = True


class DamageNotes(list[Damage]):
    """The damage of a file, each place once; beyond so many it is not listed."""

    def note(self, text: str, *, lost: bool = True) -> None:
        """Note a place."""
        damage = Damage(text, lost)
        if damage not in self and len(self) < MAX_DAMAGE:
            self.append(damage)


class MessageReader(Protocol):
    """A container of messages. Damage is collected, never raised, once the file is open."""

    format: str
    channels: tuple[Channel, ...]

    @property
    def damage(self) -> list[Damage]:
        """What was wrong so far."""

    def batches(self, keys: frozenset[int] | None = None, progress: Progress | None = None) -> Iterator[Batch]:
        """Raw messages of the channels named (all when None), chunk by chunk."""

    def close(self) -> None:
        """Release the file."""


@dataclass(frozen=True, slots=True)
class Overview:
    """What the summary of a huge file says of it.

    Attributes:
        reader: of a few of its messages, at least one of each channel; to be closed.
        counts: channel key to messages.
        span_ns: first and last time of recording.
        text: what was read and what was therefore not looked for.
    """

    reader: MessageReader
    counts: Mapping[int, int]
    span_ns: tuple[int, int]
    text: str


def damage_findings(damage: Sequence[Damage], where: str) -> tuple[Finding, ...]:
    """Findings for what could not be read."""
    return tuple(
        Finding(
            "log-partial",
            "error" if item.lost else "warning",
            f"The log is damaged: {item.text}." + (" Only what is not damaged was read." if item.lost else ""),
            where=where,
        )
        for item in damage
    )


def ros_type(name: str) -> str:
    """The three-part form of a ROS message type (``a/B`` and ``a/msg/B`` → ``a/msg/B``)."""
    parts = name.split("/")
    return f"{parts[0]}/msg/{parts[1]}" if len(parts) == 2 else name


@dataclass(frozen=True, slots=True, eq=False)
class TableColumns:
    """Columns of one file.

    Attributes:
        values: name of a group to (n, c) numbers, NaN where missing; column after column in memory (Fortran order) is
            the fastest.
        stamps: the time column as an Arrow array of n integers, float64, decimals or timestamps, which keep
            nanoseconds since the epoch exactly; None without.
        texts: index of a column to n texts.
    """

    values: dict[str, FloatArray]
    stamps: Any
    texts: dict[int, tuple[str, ...]]


class TableReader(Protocol):
    """An opened table: one row a sample, columns by their number from 0.

    Attributes:
        path: the file.
        format: what results call the format.
        names: of the columns; "1", "2" … of a table without names.
        named: whether the table itself holds the names.
        layout: how it is written, in words, for ``inspect``.
        stated: keys of ``[log.csv]`` that let the file be read as it was recognised; empty where nothing is guessed.
        left_out: what the file holds besides and is no column, in words.
        notes: what is in the file beside the table and was left out, in words; more once columns were read.
        damage: where the file could not be read to its end, or None; known once columns were read.
    """

    path: Path
    format: str
    names: tuple[str, ...]
    named: bool
    layout: str
    stated: Mapping[str, str]
    left_out: tuple[str, ...]
    notes: tuple[str, ...]
    damage: str | None

    def first_cells(self, column: int) -> tuple[str, ...]:
        """Some cells from the beginning of a column, as text: equal where tables were written from one recording."""

    def read(self, groups: Mapping[str, Sequence[int]], time: int | None, texts: Sequence[int] = ()) -> TableColumns:
        """Read columns as numbers, and some as text.

        Args:
            groups: name to indices of columns of numbers.
            time: index of the time column, or None.
            texts: indices of columns of text.

        Raises:
            LogError: naming line and column where it can, for a cell that is not a number.
        """


def numbers_of(column: Any) -> FloatArray:
    """An Arrow array (n,) as float64, NaN where missing; its own ``to_numpy`` imports pandas (0.2 s)."""
    import pyarrow as pa

    column = column.cast(pa.float64(), safe=False)  # a column of time may be asked for as numbers too
    whole = column.fill_null(float("nan")) if column.null_count else column
    return np.asarray(_held(whole, np.float64))


def integers_of(column: Any) -> IntArray:
    """An Arrow array (n,) without missing values as int64, without pandas as :func:`numbers_of`."""
    import pyarrow as pa

    return np.asarray(_held(column.cast(pa.int64()), np.int64))


def _held(whole: Any, kind: type[np.float64] | type[np.int64]) -> Any:
    """(n,) what an Arrow array of this kind holds, not copied."""
    return np.frombuffer(whole.buffers()[1], dtype=kind, count=len(whole) + whole.offset)[whole.offset :]


def arrow_of(values: NDArray[Any], known: BoolArray | None = None) -> Any:
    """Numbers or truth values (n,) as an Arrow array; ``pyarrow.array`` imports pandas.

    Args:
        values: of the byte order of this machine.
        known: (n,) where they are not missing; None for everywhere.
    """
    import pyarrow as pa

    held = _bits(values) if values.dtype.kind == "b" else pa.py_buffer(np.ascontiguousarray(values))
    missing = None if known is None else _bits(known)
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), values.size, [missing, held])


def _bits(flags: BoolArray) -> Any:
    """Truth values (n,) as Arrow keeps them."""
    import pyarrow as pa

    return pa.py_buffer(np.packbits(flags, bitorder="little"))
