"""Known events against what was found: recall, precision, false alarms an hour, delays, ROC."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.series import BoolArray, FloatArray
from collaudit.core.signals import State

#: An alarm this long after an event ended still belongs to it (the arm swings back), and this long before it.
AFTER_S, BEFORE_S = 0.5, 0.05
#: Stretches of clean motion that count as one chance for a false alarm in the ROC.
WINDOW_S = 1.0
#: An event is not observable on a joint that rested or was not judged for more than this share of it.
_UNSEEN_SHARE = 0.3


@dataclass(frozen=True, slots=True)
class TrueEvent:
    """A contact that did happen.

    Attributes:
        onset_s, end_s: when.
        required: joints that have to alarm, with the time their true torque crosses gamma (None: not known, the
            onset stands in). Empty: the event must not count as a false alarm, but need not be found.
    """

    onset_s: float
    end_s: float
    required: Mapping[str, float | None]

    def covers(self, time_s: float) -> bool:
        """Whether an alarm at this time belongs to the event."""
        return self.onset_s - BEFORE_S <= time_s <= self.end_s + AFTER_S


@dataclass(frozen=True, slots=True)
class Alarm:
    """An alarm to be scored."""

    joint: str
    onset_s: float
    detected_s: float


@dataclass(frozen=True, slots=True)
class Evidence:
    """What was judged: time (n,), residual over threshold (n, j), states (n, j), joint names, n of rule (6)."""

    time_s: FloatArray
    ratio: FloatArray
    state: np.ndarray
    joint_names: tuple[str, ...]
    n: int


@dataclass(frozen=True, slots=True)
class Score:
    """How right a detector was, on one joint or on all combined.

    Attributes:
        joint: name, or None for all joints combined (an event is found when any required joint alarms).
        events: events that had to be found.
        found: events found.
        not_observable: events not found while the joint rested, had just reversed, or was not judged: they hid
            behind friction or missing data, and are counted neither as found nor in the recall.
        alarms, false_alarms: alarms in all, and those that belong to no event.
        judged_h: hours judged.
        recall, precision, false_alarms_per_hour: None where undefined.
        delay_s: from crossing gamma to the alarm, one each found event, sorted.
        auc: area under the ROC of windows with an event against clean windows of one second, None without both.
        roc: (false positive share, true positive share) at falling thresholds.
    """

    joint: str | None
    events: int
    found: int
    not_observable: int
    alarms: int
    false_alarms: int
    judged_h: float
    recall: float | None
    precision: float | None
    false_alarms_per_hour: float | None
    delay_s: tuple[float, ...]
    auc: float | None
    roc: tuple[tuple[float, float], ...]


def score(events: Sequence[TrueEvent], alarms: Sequence[Alarm], evidence: Evidence) -> list[Score]:
    """Score all joints combined first, then each joint.

    Args:
        events: what happened.
        alarms: what was found.
        evidence: residuals and states.
    """
    out = [_score(None, events, alarms, evidence)]
    for joint in evidence.joint_names:
        out.append(_score(joint, events, [a for a in alarms if a.joint == joint], evidence))
    return out


def _score(joint: str | None, events: Sequence[TrueEvent], alarms: Sequence[Alarm], evidence: Evidence) -> Score:
    needed = [e for e in events if e.required and (joint is None or joint in e.required)]
    found, hidden, delays = 0, 0, []
    for event in needed:
        wanted = event.required if joint is None else {joint: event.required[joint]}
        its = [a for a in alarms if a.joint in wanted and event.covers(a.onset_s)]
        if joint is None and not its:  # on another joint than those that had to: found all the same
            its = [a for a in alarms if event.covers(a.onset_s)]
        if its:
            first = min(its, key=lambda a: a.detected_s)
            crossing = wanted.get(first.joint)
            found += 1
            delays.append(first.detected_s - (event.onset_s if crossing is None else crossing))
        elif all(_unseen(event, name, evidence) for name in wanted):
            hidden += 1
    false = sum(not any(e.covers(a.onset_s) for e in events) for a in alarms)
    hours = _judged_hours(joint, evidence)
    roc, auc = _roc(joint, events, evidence)
    seen = len(needed) - hidden
    return Score(
        joint=joint,
        events=len(needed),
        found=found,
        not_observable=hidden,
        alarms=len(alarms),
        false_alarms=false,
        judged_h=hours,
        recall=found / seen if seen else None,
        precision=(len(alarms) - false) / len(alarms) if alarms else None,
        false_alarms_per_hour=false / hours if hours > 0 else None,
        delay_s=tuple(sorted(delays)),
        auc=auc,
        roc=roc,
    )


def _unseen(event: TrueEvent, joint: str, evidence: Evidence) -> bool:
    if joint not in evidence.joint_names:
        return True
    a, b = (int(k) for k in np.searchsorted(evidence.time_s, [event.onset_s, event.end_s]))
    state = evidence.state[a : max(b, a + 1), evidence.joint_names.index(joint)]
    return bool(np.mean(state != State.JUDGED) > _UNSEEN_SHARE) if state.size else True


def _judged_hours(joint: str | None, evidence: Evidence) -> float:
    if evidence.time_s.size < 2:
        return 0.0
    period = float(evidence.time_s[1] - evidence.time_s[0])
    judged = evidence.state == State.JUDGED
    column = judged.any(axis=1) if joint is None else judged[:, evidence.joint_names.index(joint)]
    return float(np.count_nonzero(column)) * period / 3600.0


def _roc(
    joint: str | None, events: Sequence[TrueEvent], evidence: Evidence
) -> tuple[tuple[tuple[float, float], ...], float | None]:
    """ROC over the level that lasts n samples, per event and per clean window; threshold-free."""
    level = _lasting(joint, evidence)
    positive, taken = [], np.zeros(level.size, dtype=bool)
    for event in events:
        a, b = (int(k) for k in np.searchsorted(evidence.time_s, [event.onset_s - BEFORE_S, event.end_s + AFTER_S]))
        taken[a:b] = True
        if event.required and (joint is None or joint in event.required):
            stop = int(np.searchsorted(evidence.time_s, event.end_s + BEFORE_S))
            positive.append(float(level[a:stop].max(initial=0.0)))
    negative = _clean_windows(level, taken, evidence)
    if not positive or negative.size == 0:
        return (), None
    return _curve(np.array(positive), negative)


def _lasting(joint: str | None, evidence: Evidence) -> FloatArray:
    """(n,) largest residual over threshold that lasts n samples around each sample; 0 where nothing is judged."""
    from scipy.ndimage import minimum_filter1d

    known = evidence.state <= State.FRICTION_INTERVAL
    ratio = np.where(known, np.abs(np.nan_to_num(evidence.ratio)), 0.0)
    lasting = minimum_filter1d(ratio, evidence.n, axis=0, mode="constant")
    out: FloatArray = lasting.max(axis=1) if joint is None else lasting[:, evidence.joint_names.index(joint)]
    return out


def _clean_windows(level: FloatArray, taken: BoolArray, evidence: Evidence) -> FloatArray:
    """Largest lasting level of each whole second that touches no event."""
    if evidence.time_s.size < 2:
        return np.zeros(0)
    width = max(1, round(WINDOW_S / float(evidence.time_s[1] - evidence.time_s[0])))
    count = level.size // width
    free = ~taken[: count * width].reshape(count, width).any(axis=1)
    out: FloatArray = level[: count * width].reshape(count, width).max(axis=1)[free]
    return out


def _curve(positive: FloatArray, negative: FloatArray) -> tuple[tuple[tuple[float, float], ...], float]:
    levels = np.unique(np.concatenate([positive, negative]))[::-1]
    true = (positive[None, :] >= levels[:, None]).mean(axis=1)
    false = (negative[None, :] >= levels[:, None]).mean(axis=1)
    higher = (positive[:, None] > negative[None, :]).mean()
    equal = (positive[:, None] == negative[None, :]).mean()
    turn = np.flatnonzero(np.concatenate(([True], (np.diff(true) != 0) | (np.diff(false) != 0))))
    points = [(0.0, 0.0), *((float(false[k]), float(true[k])) for k in turn)]
    return tuple(points), float(higher + 0.5 * equal)
