"""Topics as one MCAP file, by the library's writer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import IO

import numpy as np
from mcap.writer import CompressionType, Writer
from numpy.typing import NDArray

from collaudit.core.numeric.stage_progress import Progress

_CHUNK_BYTES = 4 << 20
#: Messages between two steps of progress.
_STEP = 20_000


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """A topic and its messages in order of time.

    Attributes:
        topic: its name.
        type: name of the message type.
        definition: text of the type.
        stamps_ns: (n,) log times.
        messages: (n, size) bytes of messages of one size, or n messages of any.
    """

    topic: str
    type: str
    definition: str
    stamps_ns: NDArray[np.int64]
    messages: NDArray[np.uint8] | Sequence[bytes]


def write_mcap(
    out: IO[bytes],
    channels: Sequence[Channel],
    facts: Mapping[str, str],
    library: str,
    progress: Progress | None = None,
) -> None:
    """Write channels as one MCAP file with index and summary; the same input gives the same bytes.

    Args:
        out: an empty file.
        channels: what it holds, ROS 2 messages in CDR.
        facts: kept as metadata.
        library: what is named as the writer.
        progress: called with messages written and in all.
    """
    writer = Writer(out, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD)
    writer.start(profile="ros2", library=library)
    types = {channel.type: channel.definition for channel in channels}
    schemas = {name: writer.register_schema(name, "ros2msg", text.encode()) for name, text in types.items()}
    ids = [writer.register_channel(channel.topic, "cdr", schemas[channel.type]) for channel in channels]
    stamps = np.concatenate([channel.stamps_ns for channel in channels])
    counts = [len(channel.stamps_ns) for channel in channels]
    number = np.repeat(np.arange(len(channels)), counts)
    place = np.concatenate([np.arange(count) for count in counts])
    for written, k in enumerate(np.argsort(stamps, kind="stable").tolist()):
        if progress is not None and written % _STEP == 0:
            progress(written, len(stamps))
        which, row, time_ns = int(number[k]), int(place[k]), int(stamps[k])
        writer.add_message(ids[which], time_ns, bytes(channels[which].messages[row]), time_ns, row)
    if progress is not None:
        progress(1, 1)
    writer.add_metadata("collaudit", dict(facts))
    writer.finish()  # type: ignore[no-untyped-call]
