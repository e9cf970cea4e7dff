"""What is in CSV files, for `inspect`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from collaudit.core.errors import LogError
from collaudit.core.findings import Finding
from collaudit.core.logs.csv.csv_log import CsvTable, open_csvs, read_csvs
from collaudit.core.logs.log_description import rate_and_gap, size_of
from collaudit.core.logs.log_summary import LogSummary, TopicInfo
from collaudit.core.logs.signals.sample_clock import start_of

if TYPE_CHECKING:
    from collaudit.core.config.schema import LogConfig


def describe_csvs(paths: Sequence[Path], settings: LogConfig | None) -> LogSummary:
    """Columns, joints, rate and gaps of one log of CSV files; without joint signals, its columns."""
    from collaudit.core.config.schema import LogConfig as Settings

    used = settings if settings is not None else Settings()
    files = open_csvs(paths, used.csv)
    columns = tuple(name for file in files for name in file.dialect.names)
    findings: tuple[Finding, ...] = ()
    name = "+".join(path.name for path in paths)
    dialect = _dialect(files[0].dialect.delimiter, files[0].dialect.decimal)
    start, duration = None, None
    try:
        table = read_csvs(paths, used)
    except LogError as error:
        topic = TopicInfo(name, "table", dialect, count=0, rate_hz=None, readable=False, note=error.message)
    else:
        topic = _info(name, table, dialect)
        findings = tuple(table.findings)
        start = start_of(table.start_ns) if table.start_ns is not None else None
        finite = table.time_s[np.isfinite(table.time_s)]
        duration = float(finite.max() - finite.min()) if finite.size else None
    return LogSummary(
        name=name,
        format="csv",
        size_bytes=size_of(paths),
        start_ns=start,
        duration_s=duration,
        topics=(topic,),
        csv_columns=columns,
        findings=findings,
    )


def _dialect(delimiter: str, decimal: str) -> str:
    names = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar", " ": "blank"}
    return f"{names.get(delimiter, delimiter)}-separated, decimal {'comma' if decimal == ',' else 'point'}"


def _info(name: str, table: CsvTable, dialect: str) -> TopicInfo:
    rate, gap = rate_and_gap(np.sort(table.time_s[np.isfinite(table.time_s)]))
    holds = {q: bool(np.isfinite(values).any()) for q, values in table.columns.items()}
    return TopicInfo(
        name=name,
        type="table",
        encoding=dialect,
        count=int(table.time_s.shape[0]),
        rate_hz=rate,
        joints=table.names,
        largest_gap_s=gap,
        has_velocity=holds.get("velocity", False),
        has_effort=holds.get("effort", False),
        role="joint_states",
        note="; ".join(f"{quantity} in {unit}" for quantity, unit in table.units.items()),
    )
