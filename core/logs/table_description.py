"""What is in tables, for `inspect`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.config.schema import LogConfig as Settings
from collaudit.core.errors import LogError
from collaudit.core.findings import Finding
from collaudit.core.logs.log_summary import LogSummary, TopicInfo, rate_and_gap
from collaudit.core.logs.opening import also_files, log_name, open_tables
from collaudit.core.logs.signals.sample_clock import start_of
from collaudit.core.logs.tables.column_roles import describe_columns
from collaudit.core.logs.tables.file_quantities import assign_columns
from collaudit.core.logs.tables.joined_tables import JointTable, join_tables


def describe_tables(paths: Sequence[Path], settings: LogConfig | None) -> LogSummary:
    """Columns, joints, rate and gaps of one log of tables; without joint signals, its columns."""

    used = settings if settings is not None else Settings()
    readers = open_tables(paths, used.csv)
    files = assign_columns(readers, used.csv)  # columns that the configuration names and the tables lack are an error
    columns = describe_columns(files, used.csv)
    findings: tuple[Finding, ...] = ()
    name, layout = log_name(paths), readers[0].layout
    start, duration = None, None
    try:
        table = join_tables([*readers, *open_tables(also_files(paths, used.csv), used.csv)], used)
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
        topic = _info(name, table, layout)
        findings = tuple(table.findings)
        start = start_of(table.start_ns) if table.start_ns is not None else None
        finite = table.time_s[np.isfinite(table.time_s)]
        duration = float(finite.max() - finite.min()) if finite.size else None
    return LogSummary(
        name=name,
        format=readers[0].format,
        size_bytes=sum(path.stat().st_size for path in paths),
        start_ns=start,
        duration_s=duration,
        topics=(topic,),
        csv_columns=tuple(column for reader in readers for column in reader.names),
        findings=findings,
        columns=columns,
    )


def _info(name: str, table: JointTable, layout: str) -> TopicInfo:
    rate, gap = rate_and_gap(np.sort(table.time_s[np.isfinite(table.time_s)]))
    holds = {q: bool(np.isfinite(values).any()) for q, values in table.columns.items()}
    return TopicInfo(
        name=name,
        type="table",
        encoding=layout,
        count=int(table.time_s.shape[0]),
        rate_hz=rate,
        joints=table.names,
        largest_gap_s=gap,
        has_velocity=holds.get("velocity", False),
        has_effort=holds.get("effort", False),
        role="joint_states",
        note="; ".join(f"{quantity} in {unit}" for quantity, unit in table.units.items()),
    )
