"""What was judged and what not: joint by joint, along the arm, and the longer stretches that were not judged."""

from __future__ import annotations

from dataclasses import dataclass

from collaudit.core.data.audit_result import AuditResult
from collaudit.reports.values import rows
from collaudit.reports.values.sensitivity_rows import (
    ForceRow,
    SensitivityRow,
    force_rows,
    force_shares,
    sensitivity_row,
)


@dataclass(frozen=True, slots=True)
class JudgedRow:
    """One joint: its sensitivity (None: not watched) and its coverage."""

    sensitivity: SensitivityRow | None
    coverage: rows.CoverageRow


@dataclass(frozen=True, slots=True)
class JudgedTime:
    """Rows by joint and by place on the arm.

    Attributes:
        spans: how many longer stretches were not judged.
        common: reason and time not judged where they are the same for all watched joints; else empty.
        shares: of the time, for which forces are listed.
        asked: whether the configuration asks for a torque on any joint.
        moving: whether forces are of the time in motion; else of all time.
    """

    rows: tuple[JudgedRow, ...]
    forces: tuple[ForceRow, ...]
    spans: int
    common: tuple[tuple[str, str], ...]
    shares: tuple[float, ...]
    asked: bool
    moving: bool


def judged_time(result: AuditResult) -> JudgedTime:
    """What was judged of one audit."""
    made = tuple(
        JudgedRow(sensitivity_row(joint, result), rows.coverage_row(joint, coverage, result))
        for joint, coverage in result.coverage.joints.items()
    )
    told = {row.coverage.reasons for row in made if row.coverage.watched}
    common = told.pop() if len(told) == 1 else ()
    sensitivity = result.sensitivity
    return JudgedTime(
        rows=made,
        forces=tuple(force_rows(result)),
        spans=sum(len(row.coverage.spans) for row in made),
        common=common,
        shares=force_shares(result),
        asked=sensitivity is not None and any(s.asked is not None for s in sensitivity.joints.values()),
        moving=sensitivity is not None and sensitivity.time is not None and sensitivity.time.moving,
    )
