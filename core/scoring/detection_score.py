"""Known events of a truth file or table of labels against what was found: recall, false alarms an hour, delays, ROC."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.audit_result import Collision
from collaudit.core.data.detection_result import Score
from collaudit.core.data.signals import State
from collaudit.core.errors import LogError
from collaudit.core.numeric.arrays import BoolArray, FloatArray, whole_window_minima
from collaudit.core.small_files import read_small

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
        whole_arm: it is not known which joints it loads: any of ``required`` will do, and no single joint is
            scored by it.
    """

    onset_s: float
    end_s: float
    required: Mapping[str, float | None]
    whole_arm: bool = False

    def counts_for(self, joint: str | None) -> bool:
        """Whether a joint, or all combined (None), have to find it."""
        return bool(self.required) if joint is None else joint in self.required and not self.whole_arm

    def covers(self, time_s: float) -> bool:
        """Whether an alarm at this time belongs to the event."""
        return self.onset_s - BEFORE_S <= time_s <= self.end_s + AFTER_S


@dataclass(frozen=True, slots=True)
class JudgedResidual:
    """The residual that the alarms came from, and where it was judged.

    Attributes:
        time_s: (n,).
        ratio: (n, j) residual over threshold.
        state: (n, j) codes of :class:`State`.
        joint_names: j judged joints.
        n: persistence of rule (6), samples.
    """

    time_s: FloatArray
    ratio: FloatArray
    state: NDArray[np.int8]
    joint_names: tuple[str, ...]
    n: int


def score(events: Sequence[TrueEvent], alarms: Sequence[Collision], judged: JudgedResidual) -> list[Score]:
    """Score all joints combined first, then each joint.

    Args:
        events: what happened.
        alarms: what was found.
        judged: residuals and states.
    """
    out = [_score(None, events, alarms, judged)]
    for joint in judged.joint_names:
        out.append(_score(joint, events, [a for a in alarms if a.joint == joint], judged))
    return out


def _score(
    joint: str | None, events: Sequence[TrueEvent], alarms: Sequence[Collision], judged: JudgedResidual
) -> Score:
    needed = [e for e in events if e.counts_for(joint)]
    found, hidden, delays = 0, 0, []
    for event in needed:
        wanted = event.required if joint is None else {joint: event.required[joint]}
        within = [a for a in alarms if a.joint in wanted and event.covers(a.onset_s)]
        if joint is None and not within:  # on another joint than those that had to: found all the same
            within = [a for a in alarms if event.covers(a.onset_s)]
        if within:
            first = min(within, key=lambda a: a.detected_s)
            crossing = wanted.get(first.joint)
            found += 1
            delays.append(first.detected_s - (event.onset_s if crossing is None else crossing))
        elif all(_unseen(event, name, judged) for name in wanted):
            hidden += 1
    false = sum(not any(e.covers(a.onset_s) for e in events) for a in alarms)
    hours = _judged_hours(joint, judged)
    roc, auc = _roc(joint, events, judged)
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


def _unseen(event: TrueEvent, joint: str, judged: JudgedResidual) -> bool:
    if joint not in judged.joint_names:
        return True
    a, b = (int(k) for k in np.searchsorted(judged.time_s, [event.onset_s, event.end_s]))
    state = judged.state[a : max(b, a + 1), judged.joint_names.index(joint)]
    return bool(np.mean(state != State.JUDGED) > _UNSEEN_SHARE) if state.size else True


def _judged_hours(joint: str | None, judged: JudgedResidual) -> float:
    if judged.time_s.size < 2:
        return 0.0
    period = float(judged.time_s[1] - judged.time_s[0])
    mask = judged.state == State.JUDGED
    column = mask.any(axis=1) if joint is None else mask[:, judged.joint_names.index(joint)]
    return float(np.count_nonzero(column)) * period / 3600.0


def _roc(
    joint: str | None, events: Sequence[TrueEvent], judged: JudgedResidual
) -> tuple[tuple[tuple[float, float], ...], float | None]:
    """ROC over the level that lasts n samples, per event and per clean window; threshold-free."""
    level = _lasting(joint, judged)
    positive, taken = [], np.zeros(level.size, dtype=bool)
    for event in events:
        a, b = (int(k) for k in np.searchsorted(judged.time_s, [event.onset_s - BEFORE_S, event.end_s + AFTER_S]))
        taken[a:b] = True
        if event.counts_for(joint):
            stop = int(np.searchsorted(judged.time_s, event.end_s + BEFORE_S))
            positive.append(float(level[a:stop].max(initial=0.0)))
    negative = _clean_windows(level, taken, judged)
    if not positive or negative.size == 0:
        return (), None
    return _curve(np.array(positive), negative)


def _lasting(joint: str | None, judged: JudgedResidual) -> FloatArray:
    """(n,) largest residual over threshold that lasts n samples around each sample; 0 where nothing is judged."""
    known = judged.state <= State.FRICTION_INTERVAL
    ratio = np.where(known, np.abs(np.nan_to_num(judged.ratio)), 0.0)
    lasting = np.stack([whole_window_minima(column, judged.n) for column in ratio.T], axis=1)
    out: FloatArray = lasting.max(axis=1) if joint is None else lasting[:, judged.joint_names.index(joint)]
    return out


def _clean_windows(level: FloatArray, taken: BoolArray, judged: JudgedResidual) -> FloatArray:
    """Largest lasting level of each whole second that touches no event."""
    if judged.time_s.size < 2:
        return np.zeros(0)
    width = max(1, round(WINDOW_S / float(judged.time_s[1] - judged.time_s[0])))
    count = level.size // width
    free = ~taken[: count * width].reshape(count, width).any(axis=1)
    out: FloatArray = level[: count * width].reshape(count, width).max(axis=1)[free]
    return out


def _curve(positive: FloatArray, negative: FloatArray) -> tuple[tuple[tuple[float, float], ...], float]:
    """Corners of the staircase of shares at or above falling levels, and the area under it."""
    up, down = np.sort(positive), np.sort(negative)
    levels = np.unique(np.concatenate([up, down]))[::-1]
    true = 1.0 - np.searchsorted(up, levels) / up.size
    false = 1.0 - np.searchsorted(down, levels) / down.size
    below = np.searchsorted(down, up, side="left")
    equal = np.searchsorted(down, up, side="right") - below
    area = float((below + 0.5 * equal).sum()) / (up.size * down.size)
    x, y = np.concatenate(([0.0], false)), np.concatenate(([0.0], true))
    straight = (np.diff(x[:-1]) == 0) & (np.diff(x[1:]) == 0) | (np.diff(y[:-1]) == 0) & (np.diff(y[1:]) == 0)
    keep = np.concatenate(([True], ~straight, [True]))
    return tuple((float(a), float(b)) for a, b in zip(x[keep], y[keep], strict=True)), area


_COLUMNS = "onset_s,end_s and optionally joint"


@dataclass(frozen=True, slots=True)
class TruthFile:
    """A truth file or table of labels as read: its path as given, and its text."""

    name: str
    text: str


def read_truth(path: str | Path) -> TruthFile:
    """Read a truth file (``.json``) or a table of labels (``.csv``), without looking into it.

    Raises:
        LogError: it cannot be read.
    """
    path = Path(path)
    try:
        return TruthFile(str(path), read_small(path).decode("utf-8-sig"))
    except (OSError, UnicodeDecodeError) as error:
        raise LogError("the true events cannot be read", where=str(path), found=str(error)) from error


def true_events(truth: TruthFile, joints: Sequence[str]) -> list[TrueEvent]:
    """Events of a truth file (``.json``) or of a label table (``.csv`` with columns onset_s, end_s, joint).

    Args:
        truth: as :func:`read_truth` gives it.
        joints: judged joints; a label without a joint is required of any of them.

    Raises:
        LogError: the text is neither.
    """
    if truth.name.lower().endswith(".csv"):
        return _labels(truth, joints)
    try:
        return events_of_truth(json.loads(truth.text))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise LogError(
            "the true events cannot be understood",
            where=truth.name,
            found=f"{type(error).__name__}: {error}",
            expected=f"a truth file of collaudit simulate, or a .csv with columns {_COLUMNS}",
        ) from error


def events_of_truth(truth: Mapping[str, Any]) -> list[TrueEvent]:
    """Events of a simulated log's truth; see :func:`true_events`."""
    out = []
    for kind in ("collisions", "near_misses", "below_threshold"):
        for push in truth[kind]:
            required = {
                joint: facts["crosses_gamma_s"]
                for joint, facts in push["joints"].items()
                if facts["kind"] == "collision"
            }
            out.append(TrueEvent(push["onset_s"], push["onset_s"] + push["duration_s"], required))
    return sorted(out, key=lambda e: e.onset_s)


def _labels(truth: TruthFile, joints: Sequence[str]) -> list[TrueEvent]:
    rows = csv.DictReader(truth.text.splitlines())
    if rows.fieldnames is None or not {"onset_s", "end_s"} <= set(rows.fieldnames):
        raise LogError(
            "the label table lacks a column",
            where=truth.name,
            found=", ".join(rows.fieldnames or ()),
            expected=_COLUMNS,
        )
    out = []
    for number, row in enumerate(rows, start=2):
        try:
            onset, end = float(row["onset_s"]), float(row["end_s"])
        except (TypeError, ValueError) as error:
            raise LogError("a label is not a time", where=f"{truth.name}, line {number}", found=str(error)) from error
        joint = (row.get("joint") or "").strip()
        if joint and joint not in joints:
            raise LogError(
                "a label names a joint that is not judged",
                where=f"{truth.name}, line {number}",
                found=joint,
                expected="one of " + ", ".join(joints),
            )
        if not (math.isfinite(onset) and math.isfinite(end) and onset <= end):
            raise LogError(
                "a label does not run forward", where=f"{truth.name}, line {number}", found=f"{onset:g} to {end:g}"
            )
        out.append(TrueEvent(onset, end, dict.fromkeys([joint] if joint else joints, None), whole_arm=not joint))
    return sorted(out, key=lambda e: e.onset_s)
