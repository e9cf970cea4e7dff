"""What the arm did in the second after a contact's onset: facts of the log, and no conformity to any limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.data.detection_result import AfterContact, Contact, ControllerAlarmComparison, LoadKind
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.runs import lasting
from collaudit.core.prepare.prepared import Prepared

#: How long after the onset the arm is looked at, and over how long before it its speed is taken, s.
_AFTER_S, _BEFORE_S = 1.0, 0.05
#: A force kept for longer than this presses (quasi-static), else it is transient: ISO/TS 15066, 5.5.4, s.
PRESSED_S = 0.5
#: The tool has stopped when it stays this long below this share of its speed at the onset; slower ones stand, m/s.
_STOPPED_S, _STOPPED, _STANDING_M_S = 0.1, 0.05, 0.002
#: It has slowed below this share of its speed; slowing begins when it is below the second for good.
_SLOWED, _SLOWING = 0.7, 0.9


def after_contact(
    prepared: Prepared, run: DetectorRun, joints: Sequence[str], onset_s: float, end_s: float, tool: str | None
) -> AfterContact:
    """What the tool did after a contact, and how long the force was kept.

    Args:
        prepared: the log and its model.
        run: the states of its samples.
        joints: those that alarmed.
        onset_s, end_s: first and last sample above γ.
        tool: its frame; None without a kinematic model.
    """
    series = prepared.judged_series
    before, onset, last = np.searchsorted(
        series.time_s, [onset_s - _BEFORE_S, onset_s, onset_s + _AFTER_S + _STOPPED_S + 0.5 * series.period_s]
    ).tolist()
    load = _load(run, [series.column(joint) for joint in joints], series.time_s, onset_s, end_s)
    after = AfterContact("unknown", end_s - onset_s, load)
    if tool is None:
        return after
    q, v = prepared.series.position_rad[before:last], prepared.series.velocity_rad_s[before:last]
    speed = np.linalg.norm(np.einsum("njx,nj->nx", prepared.robot.torque_per_newton(q, tool), v), axis=1)
    earlier, later = speed[: max(1, onset - before)], speed[onset - before :]
    return _with_motion(after, float(np.mean(earlier)), later, series.period_s)


def _with_motion(after: AfterContact, speed_m_s: float, later: FloatArray, period_s: float) -> AfterContact:
    """With the tool's speed at the onset and at the samples (n,) from then on, m/s; unknown where one is missing."""
    within, still = round(_AFTER_S / period_s), max(1, round(_STOPPED_S / period_s))
    if not np.isfinite(speed_m_s):
        return after
    after = replace(after, speed_m_s=speed_m_s)
    below = later < max(_STOPPED * speed_m_s, _STANDING_M_S)
    stops = np.flatnonzero(lasting(below, still)[: within + 1])
    known = later[: stops[0] + 1] if stops.size else later[: within + 1]
    if not np.isfinite(known).all() or (not stops.size and len(later) < within):
        return after
    if speed_m_s < _STANDING_M_S:
        return replace(after, motion="stood")
    share = known / speed_m_s
    slowest = int(np.argmin(share))
    if share[slowest] >= _SLOWED:
        return replace(after, motion="went on", slowest=float(share[slowest]))
    fast = np.flatnonzero(share[: slowest + 1] >= _SLOWING)
    slowing_s = period_s * (int(fast[-1]) + 1 if fast.size else 0)
    after = replace(after, slowest=float(share[slowest]), slowing_s=slowing_s)
    if not stops.size:
        return replace(after, motion="turned back" if below[slowest] else "slowed")
    stop = int(stops[0])
    return replace(
        after, motion="stopped", stopped_s=period_s * stop, stopping_m=period_s * float(np.sum(later[:stop]))
    )


def _load(run: DetectorRun, columns: Sequence[int], time_s: FloatArray, onset_s: float, end_s: float) -> LoadKind:
    """How the force acted; unknown where its joints stop being judged by their value before it is decided."""
    if end_s - onset_s > PRESSED_S:
        return "quasi-static"
    a, b = np.searchsorted(time_s, [end_s, onset_s + PRESSED_S])
    told = b < len(time_s) and (run.detected.state[a : b + 1][:, columns] == State.JUDGED).all()
    return "transient" if told else "unknown"


def with_controller(contacts: Sequence[Contact], alarms: Sequence[ControllerAlarmComparison]) -> tuple[Contact, ...]:
    """The contacts with when the controller's own alarm came, from the onset, where one belongs to them."""
    came = {one.detected_s: one.flag_s for one in alarms if one.label is None and one.relation == "agreed"}
    return tuple(
        contact
        if contact.after is None or (flag_s := came.get(contact.detected_s)) is None
        else replace(contact, after=replace(contact.after, controller_s=flag_s - contact.onset_s))
        for contact in contacts
    )
