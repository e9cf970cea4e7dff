"""Joints at rest that gave way: steps of torque against steps of position that no commanded motion explains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.data.detection_result import DisturbedJoint, RestDisturbance
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, centred_extremes, closed, run_bounds, widened
from collaudit.core.numeric.parallel import each, ordered_map
from collaudit.core.numeric.stats import median_of, quantile_of, smallest_step
from collaudit.core.prepare.prepared import Prepared

#: Steps are looked for in means over this time, s.
BLOCK_S = 0.01
#: Lengths of the means before and after a step, and the time between them in which it rises, s.
SCALES = ((0.04, 0.02), (0.12, 0.08), (0.3, 0.3), (0.5, 1.0))
#: A joint that goes no further than this over the windows of a step stands, rad (m of a prismatic joint).
STILL = 5e-3
#: It has stood for this long before a step, and goes nowhere for this long after it, s.
STOOD_S, STAYS_S = 0.3, 0.3
#: Nothing is told this close to time in which the drives were off, s.
_NEAR_OFF_S = 0.5
#: Samples, drawn evenly, that tell the step of an encoder.
_DRAWN = 20_000


@dataclass(frozen=True, slots=True, eq=False)
class RestBlocks:
    """Signals of the judged joints in means over blocks of time; NaN where a sample is unknown or does not count.

    Attributes:
        time_s: (m,) middle of each block.
        period_s: between blocks.
        position_rad: (m, j).
        torque_nm: (m, j) measured less the model's.
        model_nm: (m, j) the model's.
        count_rad: (j,) step of the encoder.
        stands: (scales, m) no joint of the arm moves over the windows of a step, before and after them.
    """

    time_s: FloatArray
    period_s: float
    position_rad: FloatArray
    torque_nm: FloatArray
    model_nm: FloatArray
    count_rad: FloatArray
    stands: BoolArray

    @classmethod
    def of(cls, prepared: Prepared, run: DetectorRun) -> RestBlocks | None:
        """None without a model, without torque in N·m, or of too short a log."""
        series, columns = prepared.series, prepared.columns()
        if series.effort is None or series.effort_unit != "Nm" or prepared.rigid_nm is None:
            return None
        size = max(1, round(BLOCK_S / series.period_s))
        count = series.time_s.size // size
        if count * size * series.period_s < 2.0:
            return None
        period = size * series.period_s
        if round(sum(SCALES[-1]) / period) < 1:
            return None
        off = None
        if series.not_driven is not None and series.not_driven.any():
            off = widened(series.not_driven, round(_NEAR_OFF_S / series.period_s))

        every = _means(series.position_rad, size)
        thinned = series.position_rad[:: max(1, series.time_s.size // _DRAWN)]
        steps = np.array([smallest_step(thinned[:, j]) for j in columns])
        torque, model = (np.empty((count, len(columns)), order="F") for _ in range(2))
        effort, rigid, contact = series.effort, prepared.rigid_nm, prepared.contact_nm

        def fill(k: int) -> None:
            usable = run.detected.state[:, k] <= State.FRICTION_INTERVAL
            if off is not None:
                usable &= ~off
            modelled = rigid[:, columns[k]] + (0.0 if contact is None else contact[:, columns[k]])
            left = np.where(usable, effort[:, columns[k]] - modelled, np.nan)
            torque[:, k], model[:, k] = _means(left, size), _means(modelled, size)

        each(fill, range(len(columns)))
        stands = np.ones((len(SCALES), count), dtype=np.bool_)
        for column in every.T:
            known = np.where(np.isfinite(column), column, 0.0)
            for still, window in zip(stands, (Window.of(scale, period) for scale in SCALES), strict=True):
                still &= travel(known, window.before, window.after) <= STILL
        time_s = _means(series.time_s, size)
        return cls(time_s, period, every[:, columns], torque, model, steps, stands)


def _means(x: FloatArray, size: int) -> FloatArray:
    """(m, …) means of ``size`` rows in a row each; what is left at the end is left out."""
    whole = x[: x.shape[0] // size * size]
    total = whole[::size].copy(order="K")
    for k in range(1, size):
        total += whole[k::size]
    return np.asarray(total / size)


@dataclass(frozen=True, slots=True)
class Window:
    """Blocks of a scale: of either mean, of the rise between them, and all that must be still around the middle."""

    width: int
    rise: int
    before: int
    after: int

    @classmethod
    def of(cls, scale: tuple[float, float], period_s: float) -> Window:
        """Of a scale: length of the means and time between them, s; blocks are so far apart, s."""
        width, rise = (max(least, round(x / period_s)) for x, least in zip(scale, (1, 0), strict=True))
        stood, stays = (max(1, round(t / period_s)) for t in (STOOD_S, STAYS_S))
        return cls(width, rise, stood + width + rise // 2, width + rise - rise // 2 + stays)


@dataclass(frozen=True, slots=True, eq=False)
class RunningSums:
    """Running sums of a signal of blocks: (m + 1,) of what is known, from its median, and of how many are unknown."""

    known: FloatArray
    lost: IntArray

    @classmethod
    def of(cls, x: FloatArray) -> RunningSums:
        """Of the values (m,), NaN where one is unknown."""
        unknown = ~np.isfinite(x)
        known = np.where(unknown, 0.0, x - median_of(x[~unknown]))
        return cls(np.append(0.0, np.cumsum(known)), np.append(0, np.cumsum(unknown)))

    def step(self, width: int, rise: int, rows: IntArray) -> FloatArray:
        """(k,) mean of ``width`` blocks after less that before, ``rise`` blocks apart, at some blocks.

        NaN where one is unknown among them, just before the block, or beyond an end.
        """
        first, last = width + rise // 2, self.known.size - 1 - width - (rise - rise // 2)
        out = np.full(rows.size, np.nan)
        inside = (rows >= first) & (rows <= last)
        at = rows[inside]
        before, after = at - first, at - first + width + rise
        sums, lost = self.known, self.lost
        step = (sums[after + width] - sums[after]) / width - (sums[before + width] - sums[before]) / width
        for start, stop in ((after, after + width), (before, before + width), (at - width, at)):
            step[lost[stop] > lost[start]] = np.nan
        out[inside] = step
        return out


def travel(x: FloatArray, before: int, after: int) -> FloatArray:
    """(m,) largest less smallest value of the blocks from k - before to k + after (not included), about each block k.

    Beyond the ends the values there are held.

    Args:
        x: (m,) none is unknown.
        before, after: blocks.
    """
    low, high = centred_extremes(x, before + after)
    middle = np.arange(x.size) + (before + after) // 2 - before
    return np.asarray((high - low)[middle.clip(0, x.size - 1)])


#: Before a step a joint has stood if it moved by no more than this share of the step.
_STOOD_SHARE = 0.25
#: Steps count from so many robust standard deviations of what rest does by itself.
_TORQUE_SDS, _POSITION_SDS = 5.0, 6.0
#: Share of the steps by which rest is told, and that quantile of |x| for a standard normal x.
_QUIET_SHARE, _QUIET_QUANTILE = 0.2, 0.2533
#: ... from this share of the threshold, and from so many steps of the encoder. A change of the model's torque comes on
#: top: friction may take up all of it, so that the drive's stays out.
_GAMMA_SHARE, _COUNTS = 0.1, 2.5
#: Steps of a joint closer than this are one; a motion that began this long ago explains a step, s.
_TOGETHER_S, _MOTION_S = 0.7, 1.0
#: A joint whose drive bears less than this share of its load is held by its brake.
_BRAKED_SHARE, _BRAKED_S = 0.25, 1.0


def rest_steps(prepared: Prepared, run: DetectorRun, inputs: DetectionInputs) -> tuple[RestDisturbance, ...]:
    """Steps of standing joints that no commanded motion explains, each of one joint: a push may move several.

    Args:
        prepared: the log.
        run: states of its samples.
        inputs: the rule, watched joints.
    """
    blocks = RestBlocks.of(prepared, run)
    if blocks is None:
        return ()
    names, gamma = prepared.judged_series.joint_names, inputs.rule.gamma_nm
    judged = [j for j, joint in enumerate(names) if joint in inputs.rule.watch]
    steps = list(ordered_map(lambda j: _steps_of(blocks, j, gamma[names[j]]), judged))
    asked, pushed = (np.zeros(blocks.time_s.size) for _ in range(2))
    for its in steps:
        np.maximum.at(asked, its.rows[~its.against], np.abs(its.position_rad[~its.against]))
        np.maximum.at(pushed, its.rows[its.against], np.abs(its.position_rad[its.against]))
    found = [_of_joint(blocks, its, names[j], asked, pushed) for j, its in zip(judged, steps, strict=True)]
    return tuple(step for its in found for step in its)


@dataclass(frozen=True, slots=True, eq=False)
class _Steps:
    """Steps of one joint (k,), scale by scale, of which there are few.

    Attributes:
        scale: number of the scale of each.
        rows: its block.
        against: whether it is against the drive, as a push makes it; else along it, as motion does.
        torque_nm, position_rad: its size.
    """

    scale: IntArray
    rows: IntArray
    against: BoolArray
    torque_nm: FloatArray
    position_rad: FloatArray


def _of_joint(
    blocks: RestBlocks, steps: _Steps, joint: str, asked: FloatArray, pushed: FloatArray
) -> list[RestDisturbance]:
    """Disturbances of one joint.

    Left out is one just before which its own motion, or more motion of another joint than any deflection, was
    commanded.

    Args:
        blocks: of the log.
        steps: of the joint.
        joint: its name.
        asked, pushed: (m,) the largest step of position of all joints, along the drive and against it.
    """
    against, along = (np.isin(np.arange(asked.size), steps.rows[kind]) for kind in (steps.against, ~steps.against))
    out: list[RestDisturbance] = []
    before, behind = (round(t / blocks.period_s) for t in (_MOTION_S, STAYS_S))
    for a, b in zip(*run_bounds(closed(against, round(_TOGETHER_S / blocks.period_s))), strict=True):
        near = slice(max(0, a - before), a + behind)
        own = along[max(0, a - before) : a + 1].any()
        if own or asked[near].max() > pushed[a : max(b, a + behind)].max() or _brakes(blocks, a, b):
            continue
        here = np.flatnonzero(steps.against & (steps.rows >= a) & (steps.rows < b))
        largest = here[np.argmax(np.abs(steps.torque_nm[here]))]
        one = DisturbedJoint(joint, float(steps.torque_nm[largest]), float(steps.position_rad[largest]))
        of_scale = (here[steps.scale[here] == scale] for scale in np.unique(steps.scale[here]))
        edges = [edge for its in of_scale for edge in _edges(steps.rows[its], np.abs(steps.torque_nm[its]))]
        out.append(RestDisturbance(float(blocks.time_s[min(edges)]), float(blocks.time_s[max(edges)]), (one,)))
    return out


def _edges(rows: IntArray, size_nm: FloatArray) -> list[int]:
    """Blocks of the first and the last step at some rising blocks: the middle of where each is largest."""
    runs, out = np.split(np.arange(rows.size), np.flatnonzero(np.diff(rows) > 1) + 1), []
    for run in (runs[0], runs[-1]):
        part = size_nm[run]
        out.append(int(rows[run[0]]) + int(np.median(np.flatnonzero(part >= 0.9 * part.max()))))
    return out


def _steps_of(blocks: RestBlocks, j: int, gamma_nm: float) -> _Steps:
    """Steps of one joint at every scale."""
    position, torque, model = (
        RunningSums.of(np.ascontiguousarray(x[:, j])) for x in (blocks.position_rad, blocks.torque_nm, blocks.model_nm)
    )
    known = np.where(np.isfinite(blocks.position_rad[:, j]), blocks.position_rad[:, j], 0.0)
    limits = (gamma_nm, float(blocks.count_rad[j]))
    out = []
    for number, scale in enumerate(SCALES):
        window, rows = Window.of(scale, blocks.period_s), np.flatnonzero(blocks.stands[number])
        rest = travel(known, window.before, -(window.rise // 2))[rows]
        step_q, step_x, changed = (sums.step(window.width, window.rise, rows) for sums in (position, torque, model))
        against, along = _steps(step_q, step_x, np.abs(changed), rest, limits)
        there = np.flatnonzero(against | along)
        out.append((np.full(there.size, number), rows[there], against[there], step_x[there], step_q[there]))
    return _Steps(*(np.concatenate(column) for column in zip(*out, strict=True)))


def _steps(
    step_q: FloatArray, step_x: FloatArray, changed: FloatArray, rest: FloatArray, limits: tuple[float, float]
) -> tuple[BoolArray, BoolArray]:
    """Which steps at one scale, means after less means before, run against the drive, and which along it.

    Args:
        step_q, step_x: (k,) of position and torque at the blocks at which the arm stands.
        changed: (k,) size of the step of the model's torque.
        rest: (k,) by how much the joint moved before.
        limits: its threshold, N·m, and the step of its encoder, rad.
    """
    with np.errstate(invalid="ignore"):
        still = np.isfinite(step_x)
        calm = still & (rest <= STILL * _STOOD_SHARE)
        limit_x = max(_TORQUE_SDS * _spread(step_x[calm]), _GAMMA_SHARE * limits[0])
        limit_q = max(_POSITION_SDS * _spread(step_q[calm]), _COUNTS * limits[1], 1e-9)
        large_x, large_q = np.abs(step_x) > limit_x + changed, np.abs(step_q) > limit_q
        both = still & large_x & large_q
        opposed = step_x * step_q < 0.0
        stood = rest <= np.maximum(limit_q, _STOOD_SHARE * np.abs(step_q))
    return both & opposed & stood, both & ~opposed


def _spread(x: FloatArray) -> float:
    """Standard deviation of steps at rest, from their most even fifth: an arm may be touched most of the time."""
    x = x[np.isfinite(x)]
    return quantile_of(np.abs(x), _QUIET_SHARE) / _QUIET_QUANTILE if x.size else np.inf


def _brakes(blocks: RestBlocks, a: int, b: int) -> bool:
    """Whether no loaded joint's drive bears its load before, or none after: brakes took it, or gave it back."""
    reach = max(1, round(_BRAKED_S / blocks.period_s))
    for part in (slice(max(0, a - reach - 1), max(a - 1, 1)), slice(b + 1, b + 1 + reach)):
        load, drive = blocks.model_nm[part], blocks.model_nm[part] + blocks.torque_nm[part]
        if load.shape[0] == 0 or not np.isfinite(drive).all():
            continue
        size = np.abs(load).mean(axis=0)
        loaded = size > 0.3 * max(float(size.max()), 1e-9)
        if (np.abs(drive.mean(axis=0)) < _BRAKED_SHARE * size)[loaded].all() and size.max() > 1.0:
            return True
    return False
