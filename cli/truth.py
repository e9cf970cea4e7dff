"""Comparing audits with the truth of simulated logs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from collaudit.core.result import AuditResult, Collision, FrictionFit

#: An alarm this long after a push ended still belongs to it: the arm swings back.
_AFTERMATH_S = 0.5


@dataclass(frozen=True, slots=True)
class TruePush:
    """A push that a truth file tells of.

    Attributes:
        link: number of the link pushed, from 1.
        onset_s, duration_s: when, in s from the log's first sample.
        crossings: joint to the time its external torque first exceeds gamma, of the joints that must alarm.
    """

    link: int
    onset_s: float
    duration_s: float
    crossings: Mapping[str, float]

    def covers(self, time_s: float) -> bool:
        """Whether an alarm at this time belongs to the push."""
        return self.onset_s <= time_s <= self.onset_s + self.duration_s + _AFTERMATH_S


@dataclass(frozen=True, slots=True)
class FoundPush:
    """A push and the earliest alarm that belongs to it; delay from crossing gamma to the alarm, s."""

    push: TruePush
    alarm: Collision | None
    delay_s: float | None


@dataclass(frozen=True, slots=True)
class Comparison:
    """One audit against its truth: every push that had to be found, and alarms that belong to none."""

    pushes: tuple[FoundPush, ...]
    false_alarms: tuple[Collision, ...]

    @property
    def right(self) -> bool:
        """All pushes found and nothing else."""
        return not self.false_alarms and all(found.alarm is not None for found in self.pushes)


@dataclass(frozen=True, slots=True)
class ParameterCheck:
    """A fitted parameter beside its true value; ``inside`` tells whether its interval holds the truth."""

    joint: str
    name: str
    true: float
    found: float | None
    ci95: tuple[float | None, float | None] | None

    @property
    def inside(self) -> bool | None:
        """None when there is no interval."""
        if self.ci95 is None:
            return None
        low, high = self.ci95
        return (low is None or low <= self.true) and (high is None or self.true <= high)


def read_truth(path: Path) -> dict[str, Any]:
    """The truth file beside a simulated log."""
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content


def compare_events(result: AuditResult, truth: Mapping[str, Any], watch: Sequence[str] | None = None) -> Comparison:
    """Match alarms with pushes by time and joint.

    Args:
        result: the audit.
        truth: the log's truth.
        watch: joints whose alarms count; all when None.
    """
    pushes = [_push(item, watch) for kind in ("collisions", "near_misses", "below_threshold") for item in truth[kind]]
    alarms = [alarm for alarm in result.collisions if watch is None or alarm.joint in watch]
    found = []
    for push in sorted((p for p in pushes if p.crossings), key=lambda p: p.onset_s):
        its = [a for a in alarms if a.joint in push.crossings and push.covers(a.onset_s)]
        first = min(its, key=lambda a: a.detected_s, default=None)
        delay = None if first is None else first.detected_s - push.crossings[first.joint]
        found.append(FoundPush(push, first, delay))
    false = tuple(alarm for alarm in alarms if not any(push.covers(alarm.onset_s) for push in pushes))
    return Comparison(tuple(found), false)


def compare_friction(fits: Mapping[str, FrictionFit], truth: Mapping[str, Any]) -> list[ParameterCheck]:
    """Every true parameter of eq. (11) beside the fitted one, for the joints that were fitted."""
    checks = []
    for joint, fit in fits.items():
        for name, true in truth["friction"][joint]["parameters"].items():
            checks.append(ParameterCheck(joint, name, true, fit.parameters.get(name), fit.ci95.get(name)))
    return checks


def curve_error(fit: FrictionFit, truth: Mapping[str, Any]) -> float | None:
    """Relative RMSE of a fitted curve over the measured speeds: RMS(error) / RMS(true friction).

    Args:
        fit: of one joint.
        truth: that joint's entry in the truth file.
    """
    import numpy as np

    from collaudit.core.friction.model import FrictionModel

    law = FrictionModel.of(fit)
    if law is None or fit.speed_range_rad_s is None:
        return None
    speed, friction = (np.array(truth["curve"][key]) for key in ("speed_rad_s", "friction_nm"))
    use = (speed >= fit.speed_range_rad_s[0] - 1e-9) & (speed <= fit.speed_range_rad_s[1] + 1e-9)
    error = law.torque(speed[use]) - friction[use]
    return float(np.sqrt(np.mean(error**2) / np.mean(friction[use] ** 2)))


def _push(item: Mapping[str, Any], watch: Sequence[str] | None) -> TruePush:
    crossings = {
        joint: facts["crosses_gamma_s"]
        for joint, facts in item["joints"].items()
        if facts["kind"] == "collision" and (watch is None or joint in watch)
    }
    return TruePush(item["link"], item["onset_s"], item["duration_s"], crossings)
