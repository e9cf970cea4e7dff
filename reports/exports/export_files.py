"""The files of a format that is no text: tables of events and signals, MCAP."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq

from collaudit.core.data.audit_result import Audit, AuditResult
from collaudit.core.data.signals import State
from collaudit.core.errors import ConfigError
from collaudit.core.numeric.stage_progress import Progress, stage
from collaudit.reports.exports.audit_mcap import write_audit_mcap
from collaudit.reports.files.atomic import staged
from collaudit.reports.values.contact_alarms import in_time
from collaudit.reports.values.visible_text import visible

_ROWS = 100_000
_Writer = Callable[[pa.Table, Path, Progress], None]
_TEXT, _NUMBER = pa.string(), pa.float64()
_EVENT_COLUMNS: dict[str, pa.DataType] = {
    "log": _TEXT,
    "log_sha256": _TEXT,
    "log_start": _TEXT,
    "verdict": _TEXT,
    "event": _TEXT,
    "onset_s": _NUMBER,
    "detected_s": _NUMBER,
    "duration_s": _NUMBER,
    "joints": _TEXT,
    "peak_nm": _NUMBER,
    "gamma_nm": _NUMBER,
    "ratio": _NUMBER,
    "kind": _TEXT,
    "phase": _TEXT,
    "link": _TEXT,
    "force_low_n": _NUMBER,
    "force_high_n": _NUMBER,
}
_QUANTITIES = ("position_rad", "velocity_rad_s", "measured_nm", "model_nm", "residual_nm", "least_nm", "most_nm")


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


def _write_tables(
    write: _Writer, path: Path, audits: Sequence[Audit], progress: Progress | None = None
) -> tuple[Path, ...]:
    """Write ``PATH`` with the events and ``NAME.signals.SUFFIX`` beside it; returns both.

    Events are few. Gathering the signals is a quarter of the work, writing them the rest.

    Raises:
        CollauditError: a file cannot be written.
    """
    signals_path = path.with_name(f"{path.stem}.signals{path.suffix}")
    with staged(path) as part:
        write(_event_table(audits), part, stage(None, 0.0, 1.0))
    signals = pa.concat_tables([_table(audit) for audit in audits], promote_options="default")
    with staged(signals_path) as part:
        write(signals, part, stage(progress, 0.25, 1.0))
    return path, signals_path


def _csv(table: pa.Table, path: Path, progress: Progress) -> None:
    plain = [column.cast(pa.string()) if pa.types.is_dictionary(column.type) else column for column in table.columns]
    whole = pa.table(plain, names=table.column_names)
    with pa_csv.CSVWriter(path, whole.schema) as writer:
        _write_rows(writer, whole, progress)


def _parquet(table: pa.Table, path: Path, progress: Progress) -> None:
    with pq.ParquetWriter(path, table.schema, compression="zstd", write_statistics=True) as writer:
        _write_rows(writer, table, progress)


def _write_rows(writer: pa_csv.CSVWriter | pq.ParquetWriter, table: pa.Table, progress: Progress) -> None:
    """A part after the other, so that progress is seen."""
    for first in range(0, max(1, table.num_rows), _ROWS):
        writer.write_table(table.slice(first, _ROWS))
        progress(min(first + _ROWS, table.num_rows), table.num_rows)


write_csv, write_parquet = (partial(_write_tables, write) for write in (_csv, _parquet))


def _event_table(audits: Sequence[Audit]) -> pa.Table:
    """One row an event, by log and onset.

    A log that was not judged, or in which nothing was found, has one row with ``event`` "none" and its verdict: a table
    without rows would look like a log without events.

    Args:
        audits: of one or several logs.
    """
    made = [row for audit in audits for row in _log_rows(audit.result)]
    return pa.Table.from_pylist(made, schema=pa.schema(list(_EVENT_COLUMNS.items())))


def _log_rows(result: AuditResult) -> Iterator[dict[str, Any]]:
    log = result.log
    common = {"log": log.name, "log_sha256": log.sha256, "log_start": log.start, "verdict": result.verdict}
    common = {key: None if value is None else visible(value) for key, value in common.items()}
    found = sorted(_events(result), key=lambda event: (event["onset_s"], event["event"], event["joints"]))
    for event in found or [{"event": "none"}]:
        yield {**common, **event}


def _events(result: AuditResult) -> Iterator[dict[str, Any]]:
    for contact in result.contacts:
        force = (None, None) if contact.force is None else contact.force.size_ci95_n
        yield {
            "event": "contact",
            "onset_s": contact.onset_s,
            "detected_s": contact.detected_s,
            "duration_s": contact.end_s - contact.onset_s,
            "joints": visible(" ".join(contact.joints)),
            "kind": contact.kind,
            "link": visible(contact.link) or None,
            "force_low_n": force[0],
            "force_high_n": force[1],
        }
    for alarm in in_time(result.collisions):
        yield {
            "event": "alarm",
            "onset_s": alarm.onset_s,
            "detected_s": alarm.detected_s,
            "duration_s": alarm.duration_s,
            "joints": visible(alarm.joint),
            "peak_nm": alarm.peak_nm,
            "gamma_nm": alarm.gamma_nm,
            "ratio": abs(alarm.peak_nm) / alarm.gamma_nm,
            "phase": alarm.phase,
        }
    for near in in_time(result.near_misses):
        yield {
            "event": "near miss",
            "onset_s": near.onset_s,
            "duration_s": near.duration_s,
            "joints": visible(near.joint),
            "peak_nm": near.peak_nm,
            "gamma_nm": near.gamma_nm,
            "ratio": near.ratio,
            "kind": near.kind,
            "phase": near.phase,
        }


def _table(audit: Audit) -> pa.Table:
    """Columns ``log``, ``time_s`` and, of each joint, ``QUANTITY:JOINT``; what is not known is null."""
    signals = audit.signals
    count = len(signals.time_s)
    names = pa.array([visible(audit.result.log.name)])
    columns: dict[str, pa.Array] = {
        "log": pa.DictionaryArray.from_arrays(pa.array(np.zeros(count, np.int32)), names),
        "time_s": pa.array(signals.time_s),
    }
    codes = pa.array([state.code for state in State])
    for j, joint in enumerate(signals.joint_names):
        shown = visible(joint)
        for quantity in _QUANTITIES:
            values = getattr(signals, quantity)
            if values is not None:
                columns[f"{quantity}:{shown}"] = pa.array(values[:, j].astype(float), from_pandas=True)
        columns[f"gamma_nm:{shown}"] = pa.array(np.full(count, signals.gamma_nm[j]), from_pandas=True)
        columns[f"state:{shown}"] = pa.DictionaryArray.from_arrays(
            pa.array(signals.state[:, j].astype(np.int32)), codes
        )
    if signals.wrench is not None:
        for k, axis in enumerate(("fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm")):
            columns[f"wrench:{axis}"] = pa.array(signals.wrench[:, k].astype(float), from_pandas=True)
    return pa.table(columns)
