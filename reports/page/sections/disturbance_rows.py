"""Disturbances of standing joints below what alarms: neither contacts nor near misses, and yet seen."""

from __future__ import annotations

from dataclasses import dataclass

from collaudit.core.data.audit_result import AuditResult
from collaudit.reports.values.numbers import fixed, significant, time_decimals
from collaudit.reports.values.words import torque_unit


@dataclass(frozen=True, slots=True)
class DisturbanceRow:
    """One disturbance; ``window`` are the seconds a plot of it shows."""

    anchor: str
    start: str
    end: str
    joints: str
    window: tuple[float, float]


def disturbance_rows(result: AuditResult, key: str) -> tuple[DisturbanceRow, ...]:
    """Every disturbance, in order of time."""
    decimals = time_decimals(result.log.sample_period_s)
    return tuple(
        DisturbanceRow(
            anchor=f"{key}-disturbance-{k}",
            start=f"{fixed(item.onset_s, decimals)} s",
            end=f"{fixed(item.end_s, decimals)} s",
            joints=", ".join(
                f"{j.joint} {significant(abs(j.torque_step_nm))} {torque_unit(result, j.joint)}" for j in item.joints
            ),
            window=(item.onset_s - 0.3, item.end_s + 0.3),
        )
        for k, item in enumerate(result.disturbances, 1)
    )
