"""What is in a log, for `inspect`: never fails on a readable file, whatever it holds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from collaudit.core.errors import LogError
from collaudit.core.findings import Finding
from collaudit.core.logs.log_reading import is_text, log_name, misnamed
from collaudit.core.logs.log_summary import LogSummary, TopicInfo
from collaudit.core.logs.mcap.mcap_description import by_summary
from collaudit.core.logs.messages.message_reading import skipped
from collaudit.core.logs.messages.message_tables import Decoded, all_names
from collaudit.core.logs.messages.profiles import CONFIGURED
from collaudit.core.logs.messages.topics import Topic, topics_of
from collaudit.core.logs.opening import data_files, open_messages, partial
from collaudit.core.logs.signals.publishing_clock import publish_findings
from collaudit.core.logs.signals.sample_clock import start_of
from collaudit.core.logs.storage.records import LogReader
from collaudit.core.numeric.arrays import FloatArray, IntArray

if TYPE_CHECKING:
    from collaudit.core.config.schema import LogConfig


def describe(paths: tuple[Path, ...], settings: LogConfig | None = None) -> LogSummary:
    """Say what is in a log.

    Args:
        paths: one file or bag folder, or several CSV files of one log.
        settings: column patterns of CSVs; common names are recognised without.

    Raises:
        LogError: a file cannot be read at all, or is of no known format.
    """
    for path in paths:
        if not path.exists():
            raise LogError("there is no such file or folder", where=str(path))
    if all(is_text(path) for path in paths):
        from collaudit.core.logs.csv.csv_description import describe_csvs

        try:
            return describe_csvs(paths, settings)
        except LogError as error:
            raise misnamed(paths[0], error) from error
    summary = by_summary(paths, settings)
    if summary is not None:
        return summary
    reader = open_messages(paths)
    try:
        return _messages(paths, reader, settings)
    finally:
        reader.close()


def _messages(paths: Sequence[Path], reader: LogReader, settings: LogConfig | None) -> LogSummary:
    topics = topics_of(reader, settings)
    times: dict[str, list[IntArray]] = {topic.name: [] for topic in topics}
    owner = {channel.key: topic for topic in topics for channel in topic.channels}
    for batch in reader.batches():
        topic = owner.get(batch.key)
        if topic is None:
            continue
        times[topic.name].append(batch.log_ns)
        if batch.key in topic.decoders:
            topic.decoders[batch.key].add(batch)
    stamps = {name: np.sort(np.concatenate(parts)) for name, parts in times.items() if parts}
    first = min((int(values[0]) for values in stamps.values()), default=None)
    last = max((int(values[-1]) for values in stamps.values()), default=None)
    findings: list[Finding] = list(partial(reader.damage, log_name(paths)))
    for topic in topics:
        findings += [*skipped(topic), *(publish_findings(topic) if topic.profile is not None else ())]
    return LogSummary(
        name=log_name(paths),
        format=reader.format,
        size_bytes=size_of(paths),
        start_ns=start_of(first) if first is not None else None,
        duration_s=(last - first) / 1e9 if first is not None and last is not None else None,
        topics=tuple(_info(topic, stamps.get(topic.name, np.empty(0, np.int64))) for topic in topics),
        findings=tuple(findings),
    )


def size_of(paths: Sequence[Path]) -> int:
    """Bytes of all files of a log."""
    return sum(file.stat().st_size for path in paths for file in data_files(path))


def rate_and_gap(time_s: FloatArray) -> tuple[float | None, float | None]:
    """1 / median step in Hz and the longest step in s of sorted times; None where there are too few."""
    steps = np.diff(time_s)
    if not steps.size or not np.isfinite(steps).all():
        return None, None
    middle = float(np.median(steps))
    return (1.0 / middle if middle > 0 else None), float(steps.max())


def _info(topic: Topic, log_ns: IntArray) -> TopicInfo:
    rate, gap = rate_and_gap((log_ns - log_ns[:1]).astype(np.float64) / 1e9 if log_ns.size else np.empty(0))
    return topic_info(topic, int(log_ns.shape[0]), rate, gap)


def topic_info(topic: Topic, count: int, rate_hz: float | None, largest_gap_s: float | None) -> TopicInfo:
    """One topic with what its decoded messages show."""
    role = topic.profile.role if topic.profile is not None else "other"
    readable = bool(topic.decoders)
    joints = role == "joint_states" and readable
    return TopicInfo(
        name=topic.name,
        type=topic.type,
        encoding=", ".join(dict.fromkeys(channel.encoding for channel in topic.channels)),
        count=count,
        rate_hz=rate_hz,
        joints=all_names([topic.decoded]) if joints else (),
        largest_gap_s=largest_gap_s,
        has_velocity=_holds(topic.decoded, "velocity") if joints else None,
        has_effort=_holds(topic.decoded, "effort") if joints else None,
        role=role,
        readable=readable,
        note=_note(topic),
    )


def _note(topic: Topic) -> str:
    if topic.problem:
        return topic.problem
    if topic.profile is None:
        return "no profile reads this type; it is left alone"
    if topic.profile.name == CONFIGURED:
        return "read by the field paths of the configuration, [log.fields]"
    return f"read by the profile {topic.profile.name}, by its type"


def _holds(decoded: Decoded, quantity: str) -> bool:
    """Whether any message has a finite number of a quantity."""
    columns = (group.look(quantity) for group in decoded.groups.values())
    return any(column is not None and bool(np.isfinite(column).any()) for column in columns)
