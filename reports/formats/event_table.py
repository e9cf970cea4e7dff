"""Events as a table: contacts, alarms and near misses of one or several logs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv as pa_csv

from collaudit.core.data.audit_result import Audit, AuditResult
from collaudit.reports.files.written_files import staged
from collaudit.reports.values.first_words import in_time
from collaudit.reports.values.visible_text import text_cell, visible

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


def write_csv(path: Path, audits: Sequence[Audit]) -> tuple[Path, ...]:
    """Write the events as a table; the signals of each are in the signals.parquet of its run.

    Raises:
        CollauditError: the file cannot be written.
    """
    with staged(path) as part, part.open("wb") as file:  # Arrow opens no name that is not UTF-8
        pa_csv.write_csv(_event_table(audits), file)
    return (path,)


def _event_table(audits: Sequence[Audit]) -> pa.Table:
    """One row an event, by log and onset.

    A log that was not judged, or in which nothing was found, has one row with ``event`` "none" and its verdict: a table
    without rows would look like a log without events.

    Args:
        audits: of one or several logs.
    """
    made = [
        {key: text_cell(value) if isinstance(value, str) else value for key, value in row.items()}
        for audit in audits
        for row in _log_rows(audit.result)
    ]
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
