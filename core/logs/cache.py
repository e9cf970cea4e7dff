"""A cache of decoded logs as Parquet files, keyed by the bytes read, the settings and this format."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from collaudit.core.data.joint_log import Annotation, JointLog, LogSource, WrenchSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray, frozen

if TYPE_CHECKING:
    from collaudit.core.config.schema import LogConfig

#: Raised when what is stored, or how logs are read, changes.
CACHE_FORMAT = 4
_META = b"collaudit"
_QUANTITIES = ("position_rad", "velocity_rad_s", "effort", "temperature_c", "joint_torque_nm")


def cache_key(
    sha256: str,
    names: Sequence[str],
    settings: LogConfig,
    robot: Sequence[str] | None,
    prismatic: Sequence[str],
    judged: Sequence[str] = (),
) -> str:
    """What a decoded log depends on, as one hash.

    Args:
        sha256: hash of the log's bytes.
        names: names of its files; findings mention them.
        settings: ``[log]``.
        robot: the robot's joints, or None.
        prismatic: those of them that are prismatic.
        judged: those that ``[robot] joints`` states.
    """
    joints = None if robot is None else list(robot)
    stated = sorted(settings.units.given)
    parts = [CACHE_FORMAT, sha256, list(names), settings.plain(), stated, joints, list(prismatic)]
    parts.append(list(judged))
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def load(folder: Path, key: str) -> JointLog | None:
    """The log stored under a key, or None when there is none that can be used."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(folder / f"{key}.parquet", memory_map=False)
        meta = json.loads((table.schema.metadata or {})[_META])
        wrench = pq.read_table(folder / f"{key}.wrench.parquet") if meta["wrench"] is not None else None
        joints = tuple(meta["joints"])
        parts = {name: _matrix(table, name, len(joints)) for name in _QUANTITIES if name in meta["present"]}
        return JointLog(
            time_s=frozen(table.column("time_s").to_numpy()),
            joint_names=joints,
            position_rad=parts["position_rad"],
            velocity_rad_s=parts.get("velocity_rad_s"),
            effort=parts.get("effort"),
            effort_unit=meta["effort_unit"],
            wrench=_wrench(wrench, meta["wrench"]) if wrench is not None else None,
            source=LogSource(**meta["source"]),
            findings=tuple(Finding(**finding) for finding in meta["findings"]),
            annotations=_annotations(meta["annotations"]),
            phases=_annotations(meta["phases"]),
            temperature_c=parts.get("temperature_c"),
            joint_torque_nm=parts.get("joint_torque_nm"),
        )
    except (OSError, KeyError, ValueError, TypeError, RecursionError, pa.ArrowException):
        return None


def store(folder: Path, key: str, log: JointLog) -> None:
    """Keep a log; files appear whole or not at all, the one that makes the entry valid last."""
    import pyarrow as pa

    folder.mkdir(parents=True, exist_ok=True)
    present = [name for name in _QUANTITIES if getattr(log, name) is not None]
    meta = {
        "joints": log.joint_names,
        "present": present,
        "effort_unit": log.effort_unit,
        "wrench": log.wrench.topic if log.wrench is not None else None,
        "source": asdict(log.source),
        "findings": [asdict(finding) for finding in log.findings],
        "annotations": [asdict(one) for one in log.annotations],
        "phases": [asdict(one) for one in log.phases],
    }
    if log.wrench is not None:
        arrays = {"time_s": log.wrench.time_s} | {f"w{k}": log.wrench.wrench[:, k] for k in range(6)}
        _write(folder / f"{key}.wrench.parquet", pa.table(arrays))
    columns: dict[str, Any] = {"time_s": log.time_s}
    for name in present:
        columns |= {f"{name}.{k}": getattr(log, name)[:, k] for k in range(len(log.joint_names))}
    _write(folder / f"{key}.parquet", pa.table(columns).replace_schema_metadata({_META: json.dumps(meta)}))


def _annotations(stored: list[dict[str, Any]]) -> tuple[Annotation, ...]:
    return tuple(
        Annotation(item["name"], item["source"], tuple((a, b) for a, b in item["intervals_s"]), item["joint"])
        for item in stored
    )


def _matrix(table: Any, name: str, count: int) -> FloatArray:
    out = np.empty((table.num_rows, count), order="F")
    for number in range(count):
        out[:, number] = table.column(f"{name}.{number}").to_numpy()
    return frozen(out)


def _wrench(table: Any, topic: str) -> WrenchSeries:
    values = np.column_stack([table.column(f"w{k}").to_numpy() for k in range(6)])
    return WrenchSeries(frozen(table.column("time_s").to_numpy()), frozen(values), topic)


def _write(path: Path, table: Any) -> None:
    import pyarrow.parquet as pq

    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        pq.write_table(table, part, compression="lz4", use_dictionary=False)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
