"""A look into time that is not judged: recorded efforts against model and friction at the nearest known motion.

Where a position is missing, a mode flag stands, drives are off, filters have not settled or rows lie far apart, there
is no residual. The effort that was recorded there still shows a contact of several thresholds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.findings import Finding
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, run_bounds, widened
from collaudit.core.prepare.calibration import calibrated_series
from collaudit.core.prepare.prepared import Prepared

#: Reasons that leave an effort to look at; the others have none, or no threshold to compare it with.
_LOOKED_INTO = (State.EDGE, State.NOT_A_NUMBER, State.GAP, State.NOT_DRIVEN, State.TOO_BRIEF)
#: Thresholds beyond what is allowed from which an effort is no motion: beside gaps clean logs stay within 1.1.
_SEVERAL = 2.0
#: ... and from which one is that is held against its row's own motion, which tells as much as a judged sample does.
_OF_OWN_MOTION = 1.25
#: Efforts in a row that must lie so far off, where rows are no further apart than the persistence.
_FEWEST = 3
#: In a stretch of this length, s, or next to motion slower than this, rad/s (m/s), a joint may have reversed.
_REVERSES_S, _REVERSES_RAD_S = 0.3, 0.1
#: Motion next to a stretch that is looked at at least, and time about a turn in which friction is a range, s.
_NEAR_S = 0.1
_LISTED = 20


@dataclass(frozen=True, slots=True)
class _Stretch:
    """Samples ``start`` to ``stop`` of a joint whose efforts lie ``beyond_nm`` beyond what is allowed."""

    joint: str
    start: int
    stop: int
    beyond_nm: float


def unjudged_effort_findings(prepared: Prepared, run: DetectorRun, inputs: DetectionInputs) -> list[Finding]:
    """Stretches that were not judged and whose efforts no motion explains.

    Args:
        prepared: the log.
        run: of the detector: model torque, residual and states.
        inputs: friction laws, thresholds, watched joints.
    """
    series = prepared.judged_series
    effort = _recorded_nm(prepared)
    if effort is None:
        return []
    model, own = run.residual.model_nm, _own_torques(prepared)
    found: list[_Stretch] = []
    for joint, gamma_nm in inputs.rule.gamma_nm.items():
        law, j = inputs.laws.get(joint), series.column(joint)
        if law is not None and inputs.watch[joint].watched and gamma_nm > 0:
            seen = _Seen(
                state=run.detected.state[:, j],
                effort=effort[:, prepared.series.column(joint)],
                model=model[:, j],
                residual=run.residual.torque_nm[:, j],
                rigid=prepared.explained_nm(joint),
                velocity=series.velocity_rad_s[:, j],
                own=_own_range(own, law, prepared.series, prepared.series.column(joint)),
            )
            found += _of_joint(joint, law, seen, gamma_nm, inputs.rule.n, series.period_s)
    return _findings(found, series.time_s)


def _recorded_nm(prepared: Prepared) -> FloatArray | None:
    """(n, j) efforts of all joints, calibrated, states and lone rows included; None where they are not in N·m."""
    series = prepared.start.series
    if series.effort is not None and series.lone is not None:
        effort = series.effort.copy(order="F")
        effort[series.lone.at] = series.lone.effort
        series = replace(series, effort=effort)
    recorded = calibrated_series(series, prepared.calibration)
    return recorded.effort if recorded.effort_unit == "Nm" else None


def _own_torques(prepared: Prepared) -> FloatArray | None:
    """Torque (…, k, j) of lone rows by their own motion, before friction, with either slope of velocity.

    With the commanded force and the known load of the samples beside the gap; None without lone rows.
    """
    lone = prepared.series.lone
    if lone is None or lone.at.size == 0:
        return None
    q, v, (before, after) = lone.position_rad, lone.velocity_rad_s, lone.slopes_rad_s2
    slopes = (before, after, 0.5 * (before + after))
    rigid = np.stack([prepared.robot.inverse_dynamics(q, v, a) for a in slopes])
    for more in (prepared.contact_nm, prepared.start.load_nm):
        if more is not None:
            rigid = np.concatenate([rigid + beside for beside in _beside(more, lone.at)])
    return rigid


def _beside(torque_nm: FloatArray, at: IntArray) -> list[FloatArray]:
    """(k, j) torques of the last known sample before some samples and of the first after them; of (n, j)."""
    known = np.flatnonzero(np.isfinite(torque_nm).all(axis=1))
    if known.size == 0:
        return [np.full((at.size, torque_nm.shape[1]), np.nan)]
    right = np.searchsorted(known, at)
    return [torque_nm[known[np.clip(k, 0, known.size - 1)]] for k in (right - 1, right)]


def _own_range(
    own_nm: FloatArray | None, law: FrictionModel, series: UniformSeries, j: int
) -> tuple[FloatArray, FloatArray] | None:
    """(n,) least and most effort of one joint by the motion of the lone rows, N·m; NaN at other samples."""
    if own_nm is None or series.lone is None:
        return None
    at, velocity, rigid = series.lone.at, series.lone.velocity_rad_s[:, j], own_nm[:, :, j]
    friction = law.torque(velocity)
    turns = np.zeros(series.time_s.size, dtype=np.bool_)
    turns[at] = (np.abs(velocity) < law.speed_range[0]) | (velocity * np.append(0.0, velocity[:-1]) < 0.0)
    loose = widened(turns, round(_NEAR_S / series.period_s))[at]
    hold = np.maximum(law.hold, np.abs(friction))
    least, most = (np.full(series.time_s.size, np.nan) for _ in range(2))
    least[at] = rigid.min(axis=0) + np.where(loose, -hold, friction)
    most[at] = rigid.max(axis=0) + np.where(loose, hold, friction)
    return least, most


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """What is known of one joint, (n,) each: effort as recorded, model with friction, rigid-body torque, residual.

    ``own`` is the range of effort by the motion of a lone row, where one is.
    """

    state: NDArray[np.int8]
    effort: FloatArray
    model: FloatArray
    residual: FloatArray
    rigid: FloatArray | None
    velocity: FloatArray
    own: tuple[FloatArray, FloatArray] | None


def _of_joint(joint: str, law: FrictionModel, seen: _Seen, gamma_nm: float, n: int, period_s: float) -> list[_Stretch]:
    """The stretches of one joint."""
    state, effort = seen.state, seen.effort
    known = (state <= State.FRICTION_INTERVAL) & np.isfinite(seen.model)
    blind = np.isin(state, _LOOKED_INTO)
    if not known.any() or not (blind & np.isfinite(effort)).any():
        return []
    found = []
    for start, stop in zip(*run_bounds(blind), strict=True):
        rows = start + np.flatnonzero(np.isfinite(effort[start:stop]))
        if rows.size < 2:
            continue
        left = rows - start < stop - rows
        least_nm, most_nm = np.empty(rows.size), np.empty(rows.size)
        for side, far, before in ((left, rows - start + 1, True), (~left, stop - rows, False)):
            if side.any():
                reach = max(int(far[side].max()), round(_NEAR_S / period_s))
                near = slice(max(start - reach, 0), start) if before else slice(stop, stop + reach)
                least_nm[side], most_nm[side] = _allowed(law, seen, known, near, reach * period_s)
        idle = state[rows] == State.NOT_DRIVEN
        if idle.any() and seen.rigid is not None:
            held = law.hold  # drives off hold nothing, a hand leaves them gravity: anything between is allowed
            at = seen.rigid[rows[idle]]
            least_nm[idle] = np.fmin(least_nm[idle], np.fmin(at - held, 0.0))
            most_nm[idle] = np.fmax(most_nm[idle], np.fmax(at + held, 0.0))
        several = np.full(rows.size, _SEVERAL)
        if seen.own is not None:
            own = np.isfinite(seen.own[0][rows])
            least_nm[own], most_nm[own] = (x[rows[own]] for x in seen.own)
            several[own] = _OF_OWN_MOTION
        beyond = np.maximum(effort[rows] - most_nm, least_nm - effort[rows])
        torque = np.abs(seen.residual[rows])  # beside a gap the model's torque holds noise: both must be far
        edge = (state[rows] == State.EDGE) & np.isfinite(torque)
        beyond[edge] = np.minimum(beyond[edge], torque[edge])
        worst = _lasting_beyond(beyond > several * gamma_nm, rows, n)
        if worst is not None:
            first, last = int(rows[worst.start]), int(rows[worst.stop - 1])
            found.append(_Stretch(joint, first, last + 1, float(beyond[worst].max())))
    return found


def _allowed(law: FrictionModel, seen: _Seen, known: BoolArray, near: slice, reach_s: float) -> tuple[float, float]:
    """Least and most effort so far from the nearest known motion, N·m; that of all motion where none is near."""
    inside = known[near]
    if not inside.any():
        near, inside, reach_s = slice(0, known.size), known, np.inf
    model, speed = seen.model[near][inside], np.abs(seen.velocity[near][inside])
    low, high = float(model.min()), float(model.max())
    friction = 0.0
    if reach_s > _REVERSES_S or float(speed.min()) < _REVERSES_RAD_S:
        ends = np.array([law.speed_range[0], float(np.nanmax(speed))])
        friction = 2.0 * max(law.hold, float(np.max(np.abs(law.torque(ends)))))
    return 2.0 * low - high - friction, 2.0 * high - low + friction  # it may go on as it went


def _lasting_beyond(far: BoolArray, rows: IntArray, n: int) -> slice | None:
    """The longest run of efforts that lie far off, where it is long enough; None otherwise.

    Rows further apart than ``n`` samples count one by one: a contact of the persistence may show in a single one.
    """
    starts, stops = run_bounds(far)
    if starts.size == 0:
        return None
    k = int(np.argmax(stops - starts))
    run = slice(int(starts[k]), int(stops[k]))
    apart = np.diff(rows[max(run.start - 1, 0) : run.stop + 1])
    return run if run.stop - run.start >= _FEWEST or (apart >= n).all() else None


def _findings(found: list[_Stretch], time_s: FloatArray) -> list[Finding]:
    """One finding for all joints of a stretch, the first of the log first."""
    groups: list[list[_Stretch]] = []
    for one in sorted(found, key=lambda one: (one.start, one.joint)):
        if groups and one.start < max(other.stop for other in groups[-1]):
            groups[-1].append(one)
        else:
            groups.append([one])
    out = []
    for group in groups[:_LISTED]:
        names = ", ".join(f"'{name}'" for name in dict.fromkeys(one.joint for one in group))
        first, last = float(time_s[group[0].start]), float(time_s[max(one.stop for one in group) - 1])
        text = (
            f"From {first:.4g} to {last:.4g} s, which is not judged, the recorded efforts of {names} lie up to "
            f"{max(one.beyond_nm for one in group):.3g} N·m beyond what model and friction allow next to it: a contact "
            "may lie there."
        )
        out.append(Finding("event-cut", "warning", text, start_s=first, end_s=last))
    return out
