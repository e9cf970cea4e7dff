"""Standing joints that are disturbed: steps of torque and deflection that no commanded motion explains.

At rest friction hides the level of an external torque, but not that it changes. The drive holds its place: a push
deflects the joint by some counts of its encoder, and the drive's torque steps against the deflection. Commanded motion
begins the other way round, with torque in the direction of the motion. Both steps, of torque less the model's and of
position, must stand out of what the joint does by itself at rest, and oppose each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.data.detection_result import DisturbedJoint
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.runs import run_bounds
from collaudit.core.numeric.sliding_extremes import centred_range, widened
from collaudit.core.prepare.prepared import Prepared

#: Steps are looked for in means over this time, s.
_BLOCK_S = 0.01
#: Lengths of the means before and after a step, and the time between them in which it rises, s.
_SCALES = ((0.04, 0.02), (0.12, 0.08), (0.3, 0.3), (0.5, 1.0))
#: A joint that goes no further than this over the windows of a step stands, rad (m of a prismatic joint).
_STILL = 5e-3
#: It has stood for this long before, moving by no more than this share of the step, and goes nowhere this long after.
_STOOD_S, _STOOD_SHARE, _STAYS_S = 0.3, 0.25, 0.3
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
#: Nothing is told this close to time in which the drives were off, s.
_NEAR_OFF_S = 0.5


@dataclass(frozen=True, slots=True)
class RestStep:
    """One standing joint that was disturbed, s on the log's clock; several joints of one push are told apart here."""

    onset_s: float
    end_s: float
    joint: DisturbedJoint


def rest_steps(prepared: Prepared, run: DetectorRun, inputs: DetectionInputs) -> tuple[RestStep, ...]:
    """Steps of standing joints that no commanded motion explains, joint by joint.

    Args:
        prepared: the log.
        run: states of its samples.
        inputs: the rule, watched joints; joints judged for changes alarm by themselves.
    """
    blocks = _Blocks.of(prepared, run)
    if blocks is None:
        return ()
    names, gamma = prepared.judged_series.joint_names, inputs.rule.gamma_nm
    judged = [j for j, name in enumerate(names) if inputs.watch[name].watched and name in gamma]
    judged = [j for j in judged if names[j] not in inputs.quiet]
    scales = range(len(_SCALES))
    steps = list(ordered_map(lambda j: [_steps(blocks, j, gamma[names[j]], number) for number in scales], judged))
    every, none = [one for its in steps for one in its], np.zeros(blocks.time_s.size)
    asked = np.max([none, *(np.where(one.along, np.abs(one.position_rad), 0.0) for one in every)], axis=0)
    pushed = np.max([none, *(np.where(one.against, np.abs(one.position_rad), 0.0) for one in every)], axis=0)
    found = [_of_joint(blocks, its, names[j], asked, pushed) for j, its in zip(judged, steps, strict=True)]
    return tuple(RestStep(a, b, one) for its in found for a, b, one in its)


@dataclass(frozen=True, slots=True, eq=False)
class _Blocks:
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
    def of(cls, prepared: Prepared, run: DetectorRun) -> _Blocks | None:
        """None without a model, without torque in N·m, or of too short a log."""
        series, columns = prepared.series, prepared.columns()
        if series.effort is None or series.effort_unit != "Nm" or prepared.rigid_nm is None:
            return None
        size = max(1, round(_BLOCK_S / series.period_s))
        count = series.time_s.size // size
        if count * size * series.period_s < 2.0:
            return None
        period = size * series.period_s
        if round(sum(_SCALES[-1]) / period) < 1:
            return None
        off = None
        if series.not_driven is not None and series.not_driven.any():
            off = widened(series.not_driven, round(_NEAR_OFF_S / series.period_s))

        def means(x: FloatArray) -> FloatArray:
            return np.asarray(sum(x[k : count * size : size] for k in range(size)) / size)

        every = np.stack([means(column) for column in series.position_rad.T], axis=1)
        steps = np.array([_count(series.position_rad[:, j]) for j in columns])
        torque, model = np.empty((count, len(columns))), np.empty((count, len(columns)))
        for k, j in enumerate(columns):  # joint by joint: arrays of all joints are fresh memory
            modelled = prepared.rigid_nm[:, j]
            if prepared.contact_nm is not None:
                modelled = modelled + prepared.contact_nm[:, j]
            usable = run.detected.state[:, k] <= State.FRICTION_INTERVAL
            if off is not None:
                usable &= ~off
            torque[:, k] = means(np.where(usable, series.effort[:, j] - modelled, np.nan))
            model[:, k] = means(modelled)
        windows = [_Window.of(scale, period) for scale in _SCALES]
        moves = [
            np.logical_or.reduce([_range(every[:, k], w.before, w.after) > _STILL for k in range(every.shape[1])])
            for w in windows
        ]
        return cls(means(series.time_s), period, every[:, columns], torque, model, steps, ~np.stack(moves))


@dataclass(frozen=True, slots=True)
class _Window:
    """Blocks of a scale: of either mean, of the rise between them, and all that must be still around the middle."""

    width: int
    rise: int
    before: int
    after: int

    @classmethod
    def of(cls, scale: tuple[float, float], period_s: float) -> _Window:
        width, rise = (max(least, round(x / period_s)) for x, least in zip(scale, (1, 0), strict=True))
        stood, stays = (max(1, round(t / period_s)) for t in (_STOOD_S, _STAYS_S))
        return cls(width, rise, stood + width + rise // 2, width + rise - rise // 2 + stays)


def _count(position: FloatArray) -> float:
    """The smallest step that a joint's positions are written in; 0 where they are no grid."""
    values = np.unique(position[:: max(1, position.size // 20_000)])
    gaps = np.diff(values[np.isfinite(values)])
    gaps = gaps[gaps > 1e-9]
    return float(np.quantile(gaps, 0.05)) if gaps.size else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class _Steps:
    """Steps of one joint at one scale: against the drive, as a push makes them, and along it, as motion does."""

    against: BoolArray
    along: BoolArray
    torque_nm: FloatArray
    position_rad: FloatArray


def _of_joint(
    blocks: _Blocks, scales: Sequence[_Steps], joint: str, asked: FloatArray, pushed: FloatArray
) -> list[tuple[float, float, DisturbedJoint]]:
    """Disturbances of one joint: start, end, size.

    None where its own motion, or more motion of another joint than any deflection, was asked for just before: (m,) the
    largest step of position of all joints, along the drive and against it.
    """
    against = np.logical_or.reduce([s.against for s in scales])
    along = np.logical_or.reduce([s.along for s in scales])
    if not against.any():
        return []
    out: list[tuple[float, float, DisturbedJoint]] = []
    starts, stops = run_bounds(_closed(against, round(_TOGETHER_S / blocks.period_s)))
    before, behind = (round(t / blocks.period_s) for t in (_MOTION_S, _STAYS_S))
    for a, b in zip(starts, stops, strict=True):
        near = slice(max(0, a - before), a + behind)
        own = along[max(0, a - before) : a + 1].any()
        if own or asked[near].max() > pushed[a : max(b, a + behind)].max() or _brakes(blocks, a, b):
            continue
        scale = max(scales, key=lambda s: float(np.abs(np.where(s.against, s.torque_nm, 0.0)[a:b]).max()))
        at = a + int(np.argmax(np.abs(np.where(scale.against, scale.torque_nm, 0.0)[a:b])))
        one = DisturbedJoint(joint, float(scale.torque_nm[at]), float(scale.position_rad[at]))
        edges = [edge for s in scales if (edge := _edges(s, a, b)) is not None]
        first, last = min(edge[0] for edge in edges), max(edge[1] for edge in edges)
        out.append((float(blocks.time_s[first]), float(blocks.time_s[last]), one))
    return out


def _edges(steps: _Steps, a: int, b: int) -> tuple[int, int] | None:
    """Blocks of the first and the last step of one scale between two blocks: the middle of where each is largest."""
    starts, stops = run_bounds(steps.against[a:b])
    if starts.size == 0:
        return None
    size, out = np.abs(steps.torque_nm[a:b]), []
    for start, stop in ((starts[0], stops[0]), (starts[-1], stops[-1])):
        part = size[start:stop]
        out.append(a + int(start) + int(np.median(np.flatnonzero(part >= 0.9 * part.max()))))
    return out[0], out[1]


def _steps(blocks: _Blocks, j: int, gamma_nm: float, number: int) -> _Steps:
    """Steps at one scale: means after less means before, where the arm stands."""
    window = _Window.of(_SCALES[number], blocks.period_s)
    q, x, m = (y[:, j] for y in (blocks.position_rad, blocks.torque_nm, blocks.model_nm))
    step_q, step_x, changed = (_step(y, window.width, window.rise) for y in (q, x, m))
    changed = np.abs(changed)
    rest = _range(q, window.before, -(window.rise // 2))
    with np.errstate(invalid="ignore"):
        still = np.isfinite(step_x) & blocks.stands[number]
        calm = still & (rest <= _STILL * _STOOD_SHARE)
        large_x = np.abs(step_x) > _torque_limit(step_x, calm, gamma_nm) + changed
        limit_q = _position_limit(step_q, calm, float(blocks.count_rad[j]))
        large_q = np.abs(step_q) > limit_q
        both = still & large_x & large_q
        opposed = step_x * step_q < 0.0
        stands = rest <= np.maximum(limit_q, _STOOD_SHARE * np.abs(step_q))
    return _Steps(both & opposed & stands, both & ~opposed, step_x, step_q)


def _torque_limit(step: FloatArray, calm: BoolArray, gamma_nm: float) -> float:
    return max(_TORQUE_SDS * _spread(step[calm]), _GAMMA_SHARE * gamma_nm)


def _position_limit(step: FloatArray, calm: BoolArray, count_rad: float) -> float:
    return max(_POSITION_SDS * _spread(step[calm]), _COUNTS * count_rad, 1e-9)


def _spread(x: FloatArray) -> float:
    """Standard deviation of steps at rest, from their most even fifth: an arm may be touched most of the time."""
    x = x[np.isfinite(x)]
    return float(np.quantile(np.abs(x), _QUIET_SHARE)) / _QUIET_QUANTILE if x.size else np.inf


def _step(x: FloatArray, width: int, rise: int) -> FloatArray:
    """(m,) mean of ``width`` blocks after less that before each block, ``rise`` blocks apart; NaN at unknown ones."""
    unknown = ~np.isfinite(x)
    sums = np.concatenate(([0.0], np.cumsum(np.where(unknown, 0.0, x - np.nanmedian(x) if (~unknown).any() else 0.0))))
    lost = np.concatenate(([0], np.cumsum(unknown)))
    mean = (sums[width:] - sums[:-width]) / width
    mean[lost[width:] > lost[:-width]] = np.nan
    out = np.full(x.size, np.nan)
    first = width + rise // 2
    if x.size >= 2 * width + rise:
        span = mean[width + rise :] - mean[: -(width + rise)]
        out[first : first + span.size] = span
        crossed = lost[first : first + span.size] - lost[first - width : first - width + span.size]
        out[first : first + span.size][crossed > 0] = np.nan
    return out


def _range(x: FloatArray, before: int, after: int) -> FloatArray:
    """(m,) largest less smallest value of the blocks from k - before to k + after (not included); what is unknown is 0.

    Beyond the ends the values there are held.
    """
    known, length = np.where(np.isfinite(x), x, 0.0), before + after
    spread = centred_range(known, length)
    middle = np.arange(x.size) - before + length // 2
    return np.asarray(spread[np.clip(middle, 0, x.size - 1)])


def _closed(mask: BoolArray, gap: int) -> BoolArray:
    """The mask with holes of up to so many blocks filled."""
    starts, stops = run_bounds(mask)
    out = mask.copy()
    for stop, start in zip(stops[:-1], starts[1:], strict=True):
        if start - stop <= gap:
            out[stop:start] = True
    return out


def _brakes(blocks: _Blocks, a: int, b: int) -> bool:
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
