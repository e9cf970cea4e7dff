"""The nights of a store as a baseline: what of each record a comparison needs, and friction compared over nights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from collaudit.core.history.joint_series import FrictionLevel, friction_level
from collaudit.core.history.log_record import LogRecord
from collaudit.core.numeric.stats import NORMAL_QUANTILE_975
from collaudit.core.policy.baseline import Baseline, BaselineLog
from collaudit.core.policy.friction_change import FrictionChange

#: Friction is compared with so many of the earliest logs: a mean that moved along would hide wear.
_FIRST_LOGS = 10
#: So many tell how much the level scatters from log to log.
_LEAST_LOGS = 3


@dataclass(frozen=True, slots=True)
class NightlyLog(BaselineLog):
    """A log of a store: besides, its night and the friction level of each joint."""

    night: str = ""
    levels: tuple[tuple[str, FrictionLevel], ...] = ()


@dataclass(frozen=True, slots=True)
class HistoryBaseline(Baseline):
    """A store's history. A log is compared with nights before its own: judged again, it does not meet itself."""

    def before(self, tonight: LogRecord) -> tuple[BaselineLog, ...]:
        """Judged logs of the same robot in earlier nights, each once, by its latest record."""
        earlier = [
            log for log in self.logs
            if isinstance(log, NightlyLog) and log.robot == tonight.robot and log.judged and log.night < tonight.night
        ]  # fmt: skip
        return tuple({log.sha256: log for log in sorted(earlier, key=lambda log: log.night)}.values())


def baseline_of_records(name: str, records: Sequence[LogRecord]) -> HistoryBaseline:
    """A baseline of all records of a store, those of one log in the order in which they were added."""
    return HistoryBaseline(name, tuple(_log(record) for record in records if record.log_sha256))


def _log(record: LogRecord) -> NightlyLog:
    levels = [(item.joint, friction_level(record, item)) for item in record.joints]
    return NightlyLog(
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
        levels=tuple((joint, level) for joint, level in levels if level is not None),
    )


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
    now = next((friction_level(tonight, item) for item in tonight.joints if item.joint == joint), None)
    if now is None:
        return "this log does not tell the level of its friction"
    logs = [log for log in before if isinstance(log, NightlyLog)]
    alike = [level for log in logs for name, level in log.levels if name == joint and level.speed == now.speed]
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
        from scipy.stats import t

        scatter = sum((level.value - mean) ** 2 for level in first) / (len(first) - 1)
        quantile = float(t.ppf(0.975, len(first) - 1))
        variance += max(scatter, now.se**2) + scatter / len(first)
    half, change = quantile * math.sqrt(variance), now.value - mean
    return FrictionChange(change / mean, (change - half) / mean, (change + half) / mean)
