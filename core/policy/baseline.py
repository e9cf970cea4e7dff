"""An earlier state that a night is compared with: what of a breach was there before, within its noise.

A baseline excuses only what it shows itself: a limit that it broke, too, and a value that is not beyond what its own
logs scatter. Where it cannot tell, the breach stands.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import bdtrc as binomial_tail
from scipy.special import stdtrit as student_quantile

from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.friction.friction_model import FrictionModel, curve_gradient
from collaudit.core.history.joint_series import Reading, reading_of
from collaudit.core.history.log_record import JointRecord, LogRecord
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import NORMAL_QUANTILE_975

#: Two contacts of one log are the same where they overlap with so much room, and share a joint.
_ROOM_S = 0.1
_CONFIDENCE = 0.95
#: So many logs tell how much a level scatters from log to log.
_LEAST_LOGS = 3

ContactSpan = tuple[float, float, tuple[str, ...]]


@dataclass(frozen=True, slots=True)
class BaselineLog:
    """What is kept of one log of a baseline.

    Attributes:
        robot: whose it is; None without a fleet.
        sha256: hash of the log.
        start: when it was recorded, ISO 8601 UTC, or None.
        judged: False where the log was not judged: it is evidence of nothing then.
        recorded_s: seconds recorded.
        near_misses: their count.
        contacts: onset and end (s) and joints of each.
        rms_nm: RMS of the judged residual by joint, N·m.
        friction: fits by joint.
        findings: codes and joints of its findings.
        night: of a store: the night that the log counts to.
        levels: of a store: friction by joint and speed, rad/s.
    """

    robot: str | None
    sha256: str
    start: str | None
    judged: bool
    recorded_s: float
    near_misses: int
    contacts: tuple[ContactSpan, ...] = ()
    rms_nm: dict[str, float] = field(default_factory=dict)
    friction: dict[str, FrictionFit] = field(default_factory=dict)
    findings: frozenset[tuple[str, str | None]] = frozenset()
    night: str = ""
    levels: dict[tuple[str, float | None], Reading] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Baseline:
    """The logs of a baseline, what it is called, and whether it is the history of a store."""

    name: str
    logs: tuple[BaselineLog, ...]
    of_nights: bool = False

    def before(self, robot: str | None, tonight: LogRecord | None) -> tuple[BaselineLog, ...]:
        """What a log is compared with: the judged logs of its robot.

        Of a store those in nights before its own, each once, by its latest record: judged again, it does not meet
        itself.

        Args:
            robot: whose log it is.
            tonight: record of the log, for a store.
        """
        if not self.of_nights:
            return tuple(log for log in self.logs if log.robot == robot and log.judged)
        if tonight is None:
            return ()
        own = [log for log in self.logs if log.robot == tonight.robot and log.judged and log.night < tonight.night]
        return tuple({log.sha256: log for log in sorted(own, key=lambda log: log.night)}.values())


def baseline_of_records(name: str, records: Sequence[LogRecord]) -> Baseline:
    """A baseline of all records of a store, those of one log in the order in which they were added."""
    return Baseline(name, tuple(_log(record) for record in records if record.log_sha256), of_nights=True)


def _log(record: LogRecord) -> BaselineLog:
    levels = {_level_key(item): reading_of(record, item, "friction", item.law_speed_rad_s) for item in record.joints}
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


def _level_key(item: JointRecord) -> tuple[str, float | None]:
    """What levels of friction are compared by."""
    return item.joint, item.law_speed_rad_s


def new_contacts(contacts: Sequence[ContactSpan], sha256: str, logs: Sequence[BaselineLog]) -> int | None:
    """How many contacts the baseline's audit of the very same log does not have; None where it did not judge that log.

    Contacts of other logs are other events, however alike.
    """
    known = [contact for log in logs if log.sha256 == sha256 for contact in log.contacts]
    if not any(log.sha256 == sha256 for log in logs):
        return None
    return sum(not any(_same(contact, other) for other in known) for contact in contacts)


def _same(a: ContactSpan, b: ContactSpan) -> bool:
    return a[0] <= b[1] + _ROOM_S and b[0] <= a[1] + _ROOM_S and not set(a[2]).isdisjoint(b[2])


def known_rate(count: int, hours: float, limit_per_hour: float, logs: Sequence[BaselineLog]) -> str | None:
    """What the baseline says for a rate beyond its limit: the words that excuse it, or None.

    It is excused where the baseline's rate exceeds the limit, too, and the count is not beyond Poisson noise: given
    both counts together, the newer one is binomial (the exact conditional test; Przyborowski and Wilenski 1940).
    """
    before, before_h = sum(log.near_misses for log in logs), sum(log.recorded_s for log in logs) / 3600.0
    if before_h <= 0 or before / before_h <= limit_per_hour:
        return None
    chance = float(binomial_tail(count - 1, count + before, hours / (hours + before_h)))
    if chance < 1.0 - _CONFIDENCE:
        return None
    return f"baseline: {before / before_h:.3g} an hour in {before_h:.3g} h; tonight is not beyond its Poisson noise"


def known_level(value: float, limit: float, joint: str, sha256: str, logs: Sequence[BaselineLog]) -> str | None:
    """What the baseline says for a residual level beyond its limit: the words that excuse it, or None.

    It is excused where the baseline's level of the very same log is as high; or where its mean level over several logs
    exceeds the limit, and the level is below the 97.5 % prediction bound of the next log (levels are log-normal).
    """
    same = [log.rms_nm[joint] for log in logs if log.sha256 == sha256 and joint in log.rms_nm]
    if any(value <= one * (1.0 + 1e-9) for one in same):
        return "baseline: as high in the same log"
    levels = [math.log(log.rms_nm[joint]) for log in logs if log.rms_nm.get(joint, 0.0) > 0]
    if len(levels) < _LEAST_LOGS:
        return None
    count, mean = len(levels), sum(levels) / len(levels)
    spread = math.sqrt(sum((level - mean) ** 2 for level in levels) / (count - 1))
    reach = float(student_quantile(count - 1, 0.5 + _CONFIDENCE / 2)) * math.sqrt(1 + 1 / count)
    bound = math.exp(mean + reach * spread)
    if math.exp(mean) <= limit or value > bound:
        return None
    return f"baseline: {math.exp(mean):.3g} N·m over {count} logs, the next one up to {bound:.3g} N·m"


#: Speeds that the mean of a friction curve is taken over.
_SPEEDS = 9
#: Friction is compared with so many of the earliest logs: a mean that moved along would hide wear.
_FIRST_LOGS = 10


@dataclass(frozen=True, slots=True)
class FrictionChange:
    """Mean friction over the speeds that both fits measured: relative change and its 95 % interval, as shares."""

    share: float
    low: float
    high: float


def friction_change(before: FrictionFit, after: FrictionFit) -> FrictionChange | str:
    """How much the mean of a joint's friction curve changed; or why nothing can be told.

    The mean runs over both directions and evenly over the speeds that both fits cover. Its standard error follows from
    each fit's covariance to first order, J Σ Jᵀ, and both are taken as independent.

    Args:
        before, after: fits of the same joint, in the same unit.
    """
    if before.parameters == after.parameters and before.model == after.model and before.model is not None:
        return FrictionChange(0.0, 0.0, 0.0)
    if before.model is None or after.model is None:
        return "friction was not fitted"
    if before.effort_unit != after.effort_unit:
        return f"friction in {before.effort_unit} and in {after.effort_unit} cannot be compared"
    first, second = FrictionModel.of(before), FrictionModel.of(after)
    if first is None or second is None:
        return "a fit does not say at which speeds it was measured"
    (slowest, slower), (fastest, faster) = zip(first.speed_range, second.speed_range, strict=True)
    low, high = max(slowest, slower), min(fastest, faster)
    if low > high:
        return "the two fits share no speed"
    speeds = np.linspace(low, high, _SPEEDS)
    (old, old_se), (new, new_se) = (_level(law, speeds) for law in (first, second))
    if old_se is None or new_se is None:
        return "a fit states no uncertainty"
    if old <= 0:
        return "friction of the baseline does not oppose the motion"
    half = NORMAL_QUANTILE_975 * float(np.hypot(old_se, new_se))
    return FrictionChange((new - old) / old, (new - old - half) / old, (new - old + half) / old)


def _level(law: FrictionModel, speeds: FloatArray) -> tuple[float, float | None]:
    """Mean friction over speeds and directions, and its standard error; None of it where the fit states none."""
    both = np.concatenate([speeds, -speeds])
    mean = float(np.mean(np.sign(both) * law.torque(both)))
    if law.spread is None or law.spread[0].shape[0] != len(law.values):
        return mean, None
    slope = curve_gradient(law, both).mean(axis=0)
    variance = float(slope @ law.spread[0] @ slope)
    return mean, math.sqrt(variance) if variance > 0 else None


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
    alike = [log.levels[_level_key(item)] for log in before if _level_key(item) in log.levels]
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
