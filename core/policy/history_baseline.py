"""The nights of a store as a baseline: what of each record a comparison needs, and friction compared over nights."""

from __future__ import annotations

import math
from collections.abc import Sequence

from scipy.special import stdtrit as student_quantile

from collaudit.core.history.joint_series import reading_of
from collaudit.core.history.log_record import JointRecord, LogRecord
from collaudit.core.numeric.stats import NORMAL_QUANTILE_975
from collaudit.core.policy.baseline import Baseline, BaselineLog
from collaudit.core.policy.friction_change import FrictionChange

#: Friction is compared with so many of the earliest logs: a mean that moved along would hide wear.
_FIRST_LOGS = 10
#: So many tell how much the level scatters from log to log.
_LEAST_LOGS = 3


def baseline_of_records(name: str, records: Sequence[LogRecord]) -> Baseline:
    """A baseline of all records of a store, those of one log in the order in which they were added."""
    return Baseline(name, tuple(_log(record) for record in records if record.log_sha256), of_nights=True)


def _log(record: LogRecord) -> BaselineLog:
    levels = {_key(item): reading_of(record, item, "friction", item.law_speed_rad_s) for item in record.joints}
    return BaselineLog(
        robot=record.robot,
        sha256=record.log_sha256 or "",
        start=record.start,
        judged=record.verdict != "not_judged",
        recorded_s=record.duration_s or 0.0,
        near_misses=len(record.near_misses),
        contacts=tuple((c.onset_s, c.end_s, c.joints) for c in record.contacts),
        rms_nm={item.joint: item.rms_nm for item in record.joints if item.rms_nm is not None},
        findings=frozenset((finding.code, finding.joint) for finding in record.findings),
        night=record.night,
        levels={key: level for key, level in levels.items() if level is not None},
    )


def _key(item: JointRecord) -> tuple[str, float | None]:
    """What levels of friction are compared by."""
    return item.joint, item.law_speed_rad_s


def change_over_nights(joint: str, tonight: LogRecord, before: Sequence[BaselineLog]) -> FrictionChange | str:
    """How much a joint's friction differs from the earliest logs of its history; or why nothing can be told.

    Levels are compared at one speed. The 95 % interval is that of the difference between one more log and the mean of
    n ≥ 3 logs: Student's t with n − 1 degrees of freedom times sqrt(max(s, se)² + s²/n), s their scatter and se the
    log's own error; with fewer logs the normal quantile times both errors. Errors of the friction laws are added
    where the logs were judged with different ones; of one law they cancel.

    Args:
        joint: its name.
        tonight: record of the log in question.
        before: its history.
    """
    item = next((item for item in tonight.joints if item.joint == joint), None)
    now = None if item is None else reading_of(tonight, item, "friction", item.law_speed_rad_s)
    if item is None or now is None:
        return "this log does not tell the level of its friction"
    alike = [log.levels[_key(item)] for log in before if _key(item) in log.levels]
    if not alike:
        return "the history has no level of its friction at this speed"
    first = alike[:_FIRST_LOGS]
    mean = sum(level.value for level in first) / len(first)
    if mean <= 0:
        return "friction of the history does not oppose the motion"
    other = [level.basis_se for level in first if level.basis != now.basis]
    variance = max(other) ** 2 + now.basis_se**2 if other else 0.0
    if len(first) < _LEAST_LOGS:
        quantile = NORMAL_QUANTILE_975
        variance += now.se**2 + sum(level.se**2 for level in first) / len(first) ** 2
    else:
        scatter = sum((level.value - mean) ** 2 for level in first) / (len(first) - 1)
        quantile = float(student_quantile(len(first) - 1, 0.975))
        variance += max(scatter, now.se**2) + scatter / len(first)
    half, change = quantile * math.sqrt(variance), now.value - mean
    return FrictionChange(change / mean, (change - half) / mean, (change + half) / mean)
