"""Records as an Arrow table and back: the columns of store schema 2, which never change."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import Any

import pyarrow as pa

from collaudit.core.history.log_record import (
    ContactRecord,
    FindingRecord,
    JointRecord,
    LogRecord,
    NearMissRecord,
    ParameterRecord,
)
from collaudit.reports.files.json_writer import plain

_TEXT, _NUMBER, _COUNT = pa.string(), pa.float64(), pa.int64()
_SMALL = pa.float32()

JOINT = pa.struct(
    [
        ("joint", _TEXT),
        ("watched", pa.bool_()),
        ("gamma_nm", _NUMBER),
        ("n", _COUNT),
        *[(name, _NUMBER) for name in ("judged_s", "detectable_s", "observed_s", "clean_s")],
        *[(name, _NUMBER) for name in ("rms_nm", "p99_nm", "clean_mean_abs_nm", "gamma_margin", "temperature_c")],
        *[(name, _NUMBER) for name in ("friction_excess", "friction_excess_se", "load_excess", "load_excess_se")],
        *[(name, _NUMBER) for name in ("offset_nm", "offset_nm_se", "freedom")],
        *[(name, _NUMBER) for name in ("law_nm", "law_nm_low", "law_nm_high", "law_speed_rad_s")],
        ("friction_level", _NUMBER),
        ("peaks_nm", pa.list_(_SMALL)),
        ("peaks_minute", pa.list_(pa.int32())),
        ("peaks_count", _COUNT),
        ("minute_hours", pa.list_(_SMALL)),
    ]
)
PARAMETER = pa.struct(
    [
        *[(name, _TEXT) for name in ("joint", "model", "parameter")],
        *[(name, _NUMBER) for name in ("value", "ci95_low", "ci95_high")],
        ("identifiable", pa.bool_()),
    ]
)
CONTACT = pa.struct(
    [
        ("onset_s", _NUMBER),
        ("end_s", _NUMBER),
        ("joints", pa.list_(_TEXT)),
        ("link", _TEXT),
        ("kind", _TEXT),
        ("least_force_n", _NUMBER),
    ]
)
NEAR_MISS = pa.struct(
    [
        ("joint", _TEXT),
        *[(name, _NUMBER) for name in ("onset_s", "duration_s", "peak_nm", "ratio")],
        ("kind", _TEXT),
    ]
)
FINDING = pa.struct([(name, _TEXT) for name in ("code", "severity", "joint", "text")])
SCHEMA = pa.schema(
    [
        *[(name, _TEXT) for name in ("robot", "night", "night_from", "log", "log_sha256", "start", "verdict")],
        ("reasons", pa.list_(_TEXT)),
        ("error", _TEXT),
        *[(name, _NUMBER) for name in ("duration_s", "period_s", "judged_h")],
        ("detector", _TEXT),
        ("persistence_s", _NUMBER),
        *[(name, _TEXT) for name in ("config_sha256", "friction_sha256", "model_sha256", "collaudit")],
        ("joints", pa.list_(JOINT)),
        ("friction", pa.list_(PARAMETER)),
        ("contacts", pa.list_(CONTACT)),
        ("near_misses", pa.list_(NEAR_MISS)),
        ("findings", pa.list_(FINDING)),
        ("decided_verdict", _TEXT),
        ("decided_reasons", pa.list_(_TEXT)),
    ]
)
_HEAVY = ("peaks_nm", "peaks_minute", "minute_hours")
_LIGHT_JOINT = pa.struct([field for field in JOINT if field.name not in _HEAVY])
#: What trends need: all but the peaks of the residual, parameters and findings.
LIGHT_SCHEMA = pa.schema(
    [
        pa.field("joints", pa.list_(_LIGHT_JOINT)) if field.name == "joints" else field
        for field in SCHEMA
        if field.name not in ("friction", "findings")
    ]
)


def column_paths(schema: pa.Schema) -> list[str]:
    """Names of a schema's columns, as Parquet calls them: those inside joints one by one."""
    flat = [name for name in schema.names if name != "joints"]
    return flat + [f"joints.list.element.{field.name}" for field in schema.field("joints").type.value_type]


_PARTS: Mapping[str, type] = {
    "joints": JointRecord,
    "friction": ParameterRecord,
    "contacts": ContactRecord,
    "near_misses": NearMissRecord,
    "findings": FindingRecord,
}


def record_table(records: Sequence[LogRecord]) -> pa.Table:
    """Records as rows; numbers that are not finite become null."""
    return pa.Table.from_pylist([plain(record) for record in records], schema=SCHEMA)


def records_of(rows: Iterable[Mapping[str, Any]]) -> list[LogRecord]:
    """Records of a table's rows."""
    return [_record(row) for row in rows]


def _record(row: Mapping[str, Any]) -> LogRecord:
    values: dict[str, Any] = {f.name: _frozen(row[f.name]) for f in fields(LogRecord) if f.name not in _PARTS}
    values |= {name: tuple(_part(kind, item) for item in row.get(name) or ()) for name, kind in _PARTS.items()}
    return LogRecord(**values)


def _part(kind: type, item: Mapping[str, Any]) -> Any:
    return kind(**{name: _frozen(value) for name, value in item.items()})


def _frozen(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
