"""What is in a log, for `inspect`: never fails on a readable file, whatever it holds."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.findings import Finding, fact
from collaudit.core.logs.log_formats import (
    check_there,
    data_files,
    format_of,
    is_table,
    log_name,
    misnamed,
    open_messages,
    open_tables,
)
from collaudit.core.logs.log_summary import LogSummary, TopicInfo, rate_and_gap
from collaudit.core.logs.messages.message_decoding import all_names
from collaudit.core.logs.signals.sample_clock import plausible_ns, start_of
from collaudit.core.logs.signals.signal_names import is_usable
from collaudit.core.logs.storage.bounded_reading import ReadingBounds
from collaudit.core.logs.storage.readers import MessageReader, damage_findings
from collaudit.core.logs.tables.column_roles import describe_columns
from collaudit.core.logs.tables.file_quantities import assign_columns
from collaudit.core.logs.tables.joined_tables import JointTable, join_tables
from collaudit.core.logs.tables.table_reading import joint_samples
from collaudit.core.logs.topics.joint_states_topic import has_noise, holds, role_of
from collaudit.core.logs.topics.log_topics import (
    CONFIGURED,
    Fields,
    Topic,
    decode,
    fields_of_first,
    skipped_findings,
    topics_of,
)
from collaudit.core.numeric.arrays import IntArray

#: Smaller files are read whole: that takes no longer than a moment, and finds gaps and damage.
_OVERVIEW_FROM_BYTES = 128 << 20


def describe(paths: tuple[Path, ...], settings: LogConfig | None = None, robot: Sequence[str] = ()) -> LogSummary:
    """Say what is in a log.

    Args:
        paths: one file or bag folder, or several tables of one log.
        settings: column patterns of tables; common names are recognised without.
        robot: the robot's joints, whose names the columns of a table may carry.

    Raises:
        LogError: a file cannot be read at all, or is of no known format.
    """
    settings = settings or LogConfig()
    check_there(paths)
    if all(is_table(path) for path in paths):
        try:
            return _describe_tables(paths, settings, robot)
        except LogError as error:
            raise misnamed(paths[0], error) from error
    summary = describe_by_overview(paths, settings)
    if summary is not None:
        return summary
    files = [file for path in paths for file in data_files(path)]
    bounds = ReadingBounds.of(files, log_name(paths), settings.memory_gb)
    with closing(open_messages(paths, bounds)) as reader:
        return _describe_messages(paths, reader, settings, bounds)


def _describe_messages(
    paths: Sequence[Path], reader: MessageReader, settings: LogConfig, bounds: ReadingBounds
) -> LogSummary:
    """Topics, joints, rates and gaps of a recording, all of which is read.

    Args:
        paths: its files, for names and sizes.
        reader: of them.
        settings: message definitions and fields of the configuration.
        bounds: how much may be read.

    Raises:
        LogError: it holds more than that.
    """
    topics = topics_of(reader, settings, bounds)
    times: dict[str, list[IntArray]] = {topic.name: [] for topic in topics}
    owner = {channel.key: topic for topic in topics for channel in topic.channels}
    fields: dict[str, Fields] = {}
    for batch in reader.batches():
        topic = owner.get(batch.key)
        if topic is None:
            continue
        if topic.profile.role == "other" and not times[topic.name]:
            fields[topic.name] = fields_of_first(topic, batch)
        times[topic.name].append(batch.log_ns)
        if batch.key in topic.decoders:
            topic.decoders[batch.key].add(batch)
    whole = {name: plausible_ns(np.concatenate(parts), name) for name, parts in times.items() if parts}
    stamps = {name: np.sort(good) for name, (good, _) in whole.items()}
    counts = {name: sum(part.shape[0] for part in parts) for name, parts in times.items()}
    rates = {name: rate_and_gap((log_ns - log_ns[:1]) / 1e9) for name, log_ns in stamps.items()}
    first = min((int(values[0]) for values in stamps.values()), default=None)
    last = max((int(values[-1]) for values in stamps.values()), default=None)
    findings: list[Finding] = list(damage_findings(reader.damage, log_name(paths)))
    findings += [found for _, garbage in whole.values() for found in garbage]
    for topic in topics:
        findings += skipped_findings(topic)
    return LogSummary(
        name=log_name(paths),
        format=reader.format,
        size_bytes=sum(file.stat().st_size for path in paths for file in data_files(path)),
        start_ns=start_of(first) if first is not None else None,
        duration_s=(last - first) / 1e9 if first is not None and last is not None else None,
        topics=tuple(
            replace(
                _info(topic, settings, counts[topic.name], *rates.get(topic.name, (None, None))),
                fields=fields.get(topic.name, {}),
            )
            for topic in topics
        ),
        findings=tuple(findings),
    )


def describe_by_overview(
    paths: Sequence[Path], settings: LogConfig | None = None, least_bytes: int = _OVERVIEW_FROM_BYTES
) -> LogSummary | None:
    """Topics, counts and mean rates as the summary of one huge file states them, joints by a few messages.

    Args:
        paths: the log's files.
        settings: message definitions and fields of the configuration.
        least_bytes: smaller files are read whole.

    Returns:
        None where the log must be read: it is small, several files, or has no usable summary.
    """
    if len(paths) != 1 or paths[0].is_dir() or paths[0].stat().st_size < least_bytes:
        return None
    known = format_of(paths[0])
    overview = known.overview_of(paths[0]) if known is not None else None
    if overview is None:
        return None
    settings = settings or LogConfig()
    with closing(overview.reader) as reader:
        topics = topics_of(reader, settings, ReadingBounds.of(paths, log_name(paths), settings.memory_gb))
        decode(reader, [topic for topic in topics if topic.decoders])
    first, last = overview.span_ns
    duration = (last - first) / 1e9 if last >= first else None
    infos = []
    for topic in topics:
        count = sum(overview.counts.get(channel.key, 0) for channel in topic.channels)
        infos.append(_info(topic, settings, count, (count - 1) / duration if duration and count > 1 else None, None))
    return LogSummary(
        name=paths[0].name,
        format=overview.reader.format,
        size_bytes=paths[0].stat().st_size,
        start_ns=start_of(first),
        duration_s=duration,
        topics=tuple(infos),
        findings=(fact(overview.text, where=paths[0].name),),
    )


def _info(
    topic: Topic, settings: LogConfig, count: int, rate_hz: float | None, largest_gap_s: float | None
) -> TopicInfo:
    """One topic with what its decoded messages show."""
    role, readable = topic.profile.role, bool(topic.decoders)
    joints = role == "joint_states" and readable
    return TopicInfo(
        name=topic.name,
        type=topic.type,
        encoding=", ".join(dict.fromkeys(channel.encoding for channel in topic.channels)),
        count=count,
        rate_hz=rate_hz,
        joints=all_names([topic.decoded]) if joints else (),
        largest_gap_s=largest_gap_s,
        has_position=holds([topic.decoded], "position") if joints else None,
        has_velocity=holds([topic.decoded], "velocity") if joints else None,
        has_effort=holds([topic.decoded], "effort") if joints else None,
        role=role,
        readable=readable,
        note=_note(topic, settings),
        currents=topic.decoded.currents,
        effort_noise=has_noise([topic.decoded]) if joints else None,
        signal=role_of(topic, settings) if joints else "plain",
    )


def _note(topic: Topic, settings: LogConfig) -> str:
    if topic.problem:
        return topic.problem
    if topic.profile.role == "other":
        return "no profile reads this type; it is left alone"
    by = f"read by the profile {topic.profile.name}, by its type"
    if topic.profile.name == CONFIGURED:
        by = "read by the field paths of the configuration, [log.fields]"
    role = role_of(topic, settings)
    return by if topic.profile.role != "joint_states" or is_usable(role) else f"{by}; {role} by its name: not measured"


def _describe_tables(paths: Sequence[Path], settings: LogConfig, robot: Sequence[str]) -> LogSummary:
    """Columns, joints, rate and gaps of one log of tables; without joint signals, its columns."""
    readers = open_tables(paths, settings.csv)
    files = assign_columns(readers, settings.csv, robot)  # columns that are configured and absent are an error
    columns = describe_columns(files, settings)
    findings: tuple[Finding, ...] = ()
    name, layout = log_name(paths), readers[0].layout
    start, duration = None, None
    try:
        table = join_tables(readers, settings, robot)
    except LogError as error:
        topic = TopicInfo(
            name,
            "table",
            layout,
            count=0,
            rate_hz=None,
            readable=False,
            note="; ".join(filter(None, (error.message, error.hint))),
        )
    else:
        topic = _table_info(name, table, layout)
        findings = tuple(table.findings)
        start = start_of(table.start_ns) if table.start_ns is not None else None
        finite = table.time_s[np.isfinite(table.time_s)]
        duration = float(finite.max() - finite.min()) if finite.size else None
    return LogSummary(
        name=name,
        format=readers[0].format,
        size_bytes=sum(file.stat().st_size for path in paths for file in data_files(path)),
        start_ns=start,
        duration_s=duration,
        topics=(topic,),
        csv_columns=tuple(column for reader in readers for column in reader.names),
        findings=findings,
        columns=columns,
    )


def _table_info(name: str, table: JointTable, layout: str) -> TopicInfo:
    samples, _ = joint_samples(table.time_s, dict(table.columns), name)
    stamps = table.time_s if samples is None else table.time_s[samples]
    rate, gap = rate_and_gap(np.sort(stamps[np.isfinite(stamps)]))
    held = {q: bool(np.isfinite(values).any()) for q, values in table.columns.items()}
    return TopicInfo(
        name=name,
        type="table",
        encoding=layout,
        count=int(stamps.shape[0]),
        rate_hz=rate,
        joints=table.names,
        largest_gap_s=gap,
        has_position=held.get("position", False),
        has_velocity=held.get("velocity", False),
        has_effort=held.get("effort", False),
        role="joint_states",
        note="; ".join(f"{quantity} in {unit}" for quantity, unit in table.units.items()),
        time_unit=table.time_unit,
    )
