"""The files of a format that is no text: tables of events and signals, MCAP."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq

from collaudit.core.data.audit_result import Audit
from collaudit.core.errors import ConfigError
from collaudit.core.numeric.stage_progress import Progress, stage
from collaudit.reports.exports.audit_mcap import write_audit_mcap
from collaudit.reports.exports.event_table import event_table
from collaudit.reports.exports.signal_table import signal_table
from collaudit.reports.files.atomic import staged

_CSV_ROWS = 50_000
_PARQUET_ROWS = 200_000
_Writer = Callable[[pa.Table, Path, Progress], None]


def write_csv(path: Path, audits: Sequence[Audit], progress: Progress | None = None) -> tuple[Path, ...]:
    """Write ``PATH`` with the events and ``NAME.signals.csv`` beside it; returns both.

    Raises:
        CollauditError: a file cannot be written.
    """
    return _write_tables(path, audits, _csv, progress)


def write_parquet(path: Path, audits: Sequence[Audit], progress: Progress | None = None) -> tuple[Path, ...]:
    """Write ``PATH`` with the events and ``NAME.signals.parquet`` beside it; returns both.

    Raises:
        CollauditError: a file cannot be written.
    """
    return _write_tables(path, audits, _parquet, progress)


def write_mcap(path: Path, audits: Sequence[Audit], progress: Progress | None = None) -> tuple[Path, ...]:
    """Write the MCAP of one audit: another log has another clock, and needs a file of its own.

    Raises:
        ConfigError: there are several audits. CollauditError: the file cannot be written.
    """
    if len(audits) != 1:
        raise ConfigError(
            "an MCAP file holds one run, since each log has a clock of its own",
            where="--format mcap",
            found=f"{len(audits)} runs",
            hint="one collaudit report for each run",
        )
    write_audit_mcap(path, audits[0], progress)
    return (path,)


def _write_tables(path: Path, audits: Sequence[Audit], write: _Writer, progress: Progress | None) -> tuple[Path, ...]:
    """Events, which are few, and then signals: gathering them is a quarter of the work, writing them the rest."""
    beside = path.with_name(f"{path.stem}.signals{path.suffix}")
    with staged(path) as part:
        write(event_table(audits), part, stage(None, 0.0, 1.0))
    signals = signal_table(audits)
    with staged(beside) as part:
        write(signals, part, stage(progress, 0.25, 1.0))
    return path, beside


def _csv(table: pa.Table, path: Path, progress: Progress) -> None:
    plain = [column.cast(pa.string()) if pa.types.is_dictionary(column.type) else column for column in table.columns]
    whole = pa.table(plain, names=table.column_names)
    with pa_csv.CSVWriter(path, whole.schema) as writer:
        for first in range(0, max(1, whole.num_rows), _CSV_ROWS):
            writer.write_table(whole.slice(first, _CSV_ROWS))
            progress(min(first + _CSV_ROWS, whole.num_rows), whole.num_rows)


def _parquet(table: pa.Table, path: Path, progress: Progress) -> None:
    with pq.ParquetWriter(path, table.schema, compression="zstd", write_statistics=True) as writer:
        for first in range(0, max(1, table.num_rows), _PARQUET_ROWS):
            writer.write_table(table.slice(first, _PARQUET_ROWS))
            progress(min(first + _PARQUET_ROWS, table.num_rows), table.num_rows)
