"""What is in a huge MCAP, for `inspect`: by its summary and a few chunks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from collaudit.core.findings import Finding
from collaudit.core.logs.log_summary import LogSummary, TopicInfo
from collaudit.core.logs.mcap.mcap_file import McapFile
from collaudit.core.logs.mcap.mcap_scan import ChunkRef, McapIndex
from collaudit.core.logs.mcap.mcap_summary import read_summary
from collaudit.core.logs.messages.topics import Topic, decode, topics_of
from collaudit.core.logs.signals.sample_clock import start_of
from collaudit.core.logs.storage.file_reading import RandomFile

if TYPE_CHECKING:
    from collaudit.core.config.schema import LogConfig

#: Smaller files are read whole: that takes no longer than a moment, and finds gaps and damage.
SUMMARY_FROM_BYTES = 128 << 20


def describe_by_summary(path: Path, settings: LogConfig | None = None) -> LogSummary | None:
    """Topics, counts and mean rates as a file's summary states them, joints by one chunk of each topic.

    Args:
        path: an MCAP file.
        settings: message definitions and fields of the configuration.

    Returns:
        None when the file has no usable summary.
    """
    file = RandomFile(path)
    index = read_summary(file)
    file.close()
    if index is None or index.span_ns is None:
        return None
    first, last = index.span_ns
    reader = McapFile(path, _peeked(index))
    try:
        topics = topics_of(reader, settings)
        decode(reader, [topic for topic in topics if topic.decoders])
    finally:
        reader.close()
    duration = (last - first) / 1e9 if last >= first else None
    return LogSummary(
        name=path.name,
        format=reader.format,
        size_bytes=file.size,
        start_ns=start_of(first),
        duration_s=duration,
        topics=tuple(_info(topic, index, duration) for topic in topics),
        findings=(_said(path, index),),
    )


def _peeked(index: McapIndex) -> McapIndex:
    """An index of the first chunk that holds each channel, and no others."""
    chosen: dict[int, ChunkRef] = {}
    left = set(index.channels)
    for chunk in index.chunks:
        held = {number for number, _, _ in chunk.index}
        if held & left or not held:
            chosen[chunk.at] = ChunkRef(
                chunk.at, chunk.data_at, chunk.data_size, chunk.size, chunk.crc, chunk.compression
            )
            left -= held
        if not left or len(chosen) > 16:
            break
    return McapIndex(index.schemas, index.channels, list(chosen.values()), span_ns=index.span_ns)


def _said(path: Path, index: McapIndex) -> Finding:
    text = (
        f"Only the summary and the first chunk of each topic were read, of {len(index.chunks)} chunks: rates are means "
        "over the whole log; gaps, clocks and damage inside the chunks were not looked for."
    )
    return Finding("log-summary-only", "info", text, where=path.name)


def _info(topic: Topic, index: McapIndex, duration: float | None) -> TopicInfo:
    from collaudit.core.logs.log_description import topic_info

    count = sum(index.counts.get(channel.key, 0) for channel in topic.channels)
    rate = (count - 1) / duration if duration and count > 1 else None
    return topic_info(topic, count, rate, None)


def by_summary(
    paths: Sequence[Path], settings: LogConfig | None = None, least_bytes: int = SUMMARY_FROM_BYTES
) -> LogSummary | None:
    """The description of one large MCAP by its summary, or None where the log must be read."""
    from collaudit.core.logs.file_kind import sniff

    if len(paths) != 1 or paths[0].is_dir() or paths[0].stat().st_size < least_bytes or sniff(paths[0]) != "mcap":
        return None
    return describe_by_summary(paths[0], settings)
