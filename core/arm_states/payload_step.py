"""A weight picked up or put down during a log, once or again and again: two levels of what the tool seems to weigh.

Torque beside the model's is taken as friction, an offset and m(t) times the torque of a kilogram at the tool, with m
one of two numbers. Second by second m has a spread of its own: errors of the model and of friction make it. A change
counts that stands out of it, and is the same on all joints that tell it. One that stays is told by its time; one that
comes and goes has to stand out further, since any scatter falls into two levels.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.runs import covered
from collaudit.core.numeric.stats import median_of, robust_sd, varies
from collaudit.core.robot.robot_model import RobotModel

_BLOCK_S, _MOST_BLOCKS, _PER_BLOCK = 1.0, 400, 50
#: Blocks on either side of the step; share of them that lie on its side; spreads that it exceeds; least step, kg.
_LEAST_BLOCKS, _ON_SIDE, _SPREADS, _LEAST_KG = 4, 0.9, 4.0, 0.3
#: Spreads that a weight which comes and goes exceeds: of logs without one the two levels lie up to 6.4 apart, of a UR10
#: that carries 0.5 to 5 kg for half of each cycle 15 to 21. It changes so many times at least, and per block at most.
_AGAIN_SPREADS, _AGAIN, _OFTEN = 8.0, 4, 0.5
#: Friction and weight are told from each other in so many rounds.
_ROUNDS = 4
#: A joint tells a weight that has this share of what the best one tells; changes are alike within this factor.
_TELLS, _ALIKE = 0.1, 2.0
#: Speed at which Coulomb friction is at its full size, rad/s.
_SLIDING_RAD_S = 0.01
#: A joint that moves for less than this share of a log counts at rest, too.
_MOSTLY = 0.3


#: When the weight at the tool steps, by how much, and half of its 95 % interval, kg. A second's estimates share the
#: errors of model and friction, so that many of them know hardly more than one: on 76 simulated logs, half of them
#: with a description that lacks tool and rotors, 95 % of the steps were within 3.6 spreads of a second's estimate of
#: the truth. The interval is what a step must exceed to count. Last, how often it changes.
_Step = tuple[float, float, float, int]


def payload_findings(
    series: UniformSeries, robot: RobotModel, commanded_nm: FloatArray | None, joints: Collection[str]
) -> tuple[Finding, ...]:
    """A finding where the tool's weight changes, for good or again and again.

    Args:
        series: all joints of the log, effort in N·m.
        robot: the model as described: inertials that were identified on such motion hold a part of its weight.
        commanded_nm: (n, j) torque of the tool's commanded force, or None.
        joints: names of those that are to tell it: judged, with an effort that goes with the model's torque.
    """
    step = _found(series, robot, commanded_nm, joints)
    if step is None:
        return ()
    at_s, mass_kg, half_kg, times = step
    if times > 1:
        text = (
            f"The weight at the tool changes {times} times from {at_s:.4g} s on, by {abs(mass_kg):.2g} kg (± "
            f"{half_kg:.2g} kg, 95 %) over all poses: a load that is carried for a part of the time, or a force up or "
            "down. The model knows one weight: alarms may come from the other."
        )
        return (Finding("payload-changed", "warning", text, start_s=at_s),)
    verb = "gains" if mass_kg > 0 else "loses"
    text = (
        f"From {at_s:.4g} s on, the weight at the tool differs: over all poses it {verb} "
        f"{abs(mass_kg):.2g} kg (± {half_kg:.2g} kg, 95 %). A tool or payload was changed, "
        "or something pulls at the arm all the time; later alarms may come from it."
    )
    return (Finding("payload-changed", "error", text, start_s=at_s),)


def _found(
    series: UniformSeries, robot: RobotModel, commanded_nm: FloatArray | None, joints: Collection[str]
) -> _Step | None:
    """The step that explains most of these joints; None where none stands out."""
    frame = robot.tool.frame if robot.tool is not None else robot.link_of(series.joint_names[-1])
    if frame is None or series.effort is None or series.effort_unit != "Nm" or not robot.has_inertials:
        return None
    rows, block = _rows(series)
    if rows.size == 0 or block[-1] + 1 < 2 * _LEAST_BLOCKS:
        return None
    position = series.position_rad[rows]
    force = np.zeros((rows.size, 6))
    force[:, :3] = -robot.gravity_in(position, frame)
    per_kg = robot.wrench_torque(position, force, frame)
    residual = series.effort[rows] - robot.inverse_dynamics(*(x[rows] for x in series.motion))
    if commanded_nm is not None:
        residual -= commanded_nm[rows]
    changes = varies(series.effort[rows])  # beside an effort that never does stands the whole model's torque
    telling = [j for j in sorted(map(series.column, joints)) if changes[j]]
    residual, per_kg = residual[:, telling], per_kg[:, telling]
    known = np.isfinite(residual).all(axis=1) & np.isfinite(per_kg).all(axis=1)
    if np.count_nonzero(known) < 0.5 * known.size:
        return None
    velocity = series.velocity_rad_s[rows][known][:, telling]
    sliding = _sliding(velocity)
    return _step(
        np.where(sliding, residual[known], 0.0),
        np.where(sliding, per_kg[known], 0.0),
        np.where(sliding, velocity, 0.0),
        block[known],
        series.time_s[rows][known],
    )


def _sliding(velocity: FloatArray) -> BoolArray:
    """(n, j) samples that tell a weight: of joints that move enough those in motion, as friction at rest is unknown."""
    moves = np.abs(velocity) > _SLIDING_RAD_S
    return np.asarray(moves | (np.mean(moves, axis=0) < _MOSTLY))


def _rows(series: UniformSeries) -> tuple[IntArray, IntArray]:
    """Samples that are enough, and the block of each, blocks without samples left out."""
    recorded = covered(series.segments, series.time_s.size) & ~series.edge
    length = max(_BLOCK_S, float(series.time_s[-1] - series.time_s[0]) / _MOST_BLOCKS)
    every = max(1, round(length / _PER_BLOCK / series.period_s))
    rows = np.flatnonzero(recorded)[::every]
    _, block = np.unique(((series.time_s[rows] - series.time_s[0]) / length).astype(np.int64), return_inverse=True)
    return rows, block.astype(np.int64)


def _step(
    residual: FloatArray, per_kg: FloatArray, velocity: FloatArray, block: IntArray, time_s: FloatArray
) -> _Step | None:
    count = int(block[-1]) + 1
    joints = (np.std(residual, axis=0) > 0) & (np.max(np.abs(per_kg), axis=0) > 1e-3)
    if not joints.any() or count < 2 * _LEAST_BLOCKS:  # the effort is unknown at the end
        return None
    residual, per_kg = residual[:, joints], per_kg[:, joints]
    friction = [_friction_shapes(v) for v in velocity[:, joints].T]
    levels = _levels_of_blocks(residual, per_kg, friction, block)
    if levels is None:
        return None
    usable, heavy, change, spread, filled = levels
    cut, gains, wrong = _best_cut(heavy[usable])
    stays = wrong <= (1.0 - _ON_SIDE) * usable.size
    if stays:
        first, after, times, spreads = usable[cut], np.arange(count) >= usable[cut], 1, _SPREADS
        change = change if gains else -change
    else:
        changes = np.flatnonzero(np.diff(heavy[usable]))
        first, after, times, spreads = usable[changes[0] + 1], heavy, changes.size, _AGAIN_SPREADS
    again = filled and _AGAIN <= times <= _OFTEN * usable.size
    if abs(change) < max(_LEAST_KG, spreads * spread) or not (stays or again):
        return None
    if not _joints_agree(residual, per_kg, friction, after[block].astype(float), change):
        return None
    return float(time_s[int(np.argmax(block >= first))]), change, _SPREADS * spread, times


def _levels_of_blocks(
    residual: FloatArray, per_kg: FloatArray, friction: Sequence[FloatArray], block: IntArray
) -> tuple[IntArray, BoolArray, float, float, bool] | None:
    """Blocks that tell a weight, those (b,) of the higher of two levels, how far these lie apart and scatter, kg.

    Last, whether each level holds for most of its blocks' time: a load does, and a push of a part of a second does not.
    """
    mass = np.zeros(int(block[-1]) + 1)
    for _ in range(_ROUNDS):
        top, bottom = _each_sample(residual, per_kg, mass[block], friction)
        each, usable = _each_block(top, bottom, block)
        if np.count_nonzero(usable) < 2 * _LEAST_BLOCKS:
            return None
        heavy = each > _between(np.sort(each[usable]))
        if heavy[usable].all() or not heavy[usable].any():
            return None
        high, low = median_of(each[usable & heavy]), median_of(each[usable & ~heavy])
        mass = np.where(heavy, high, low)
    above = top > 0.5 * (high + low) * bottom
    parts = [usable[block] & (heavy[block] == level) for level in (True, False)]
    filled = all(
        bottom[part & (above == level)].sum() > 0.5 * bottom[part].sum()
        for part, level in zip(parts, (True, False), strict=True)
    )
    return np.flatnonzero(usable), heavy, high - low, robust_sd((each - mass)[usable]), filled


def _between(known: FloatArray) -> float:
    """What lies between two levels of sorted values (b,): most of their squares are those between (Otsu, 1979)."""
    lower = np.arange(_LEAST_BLOCKS, known.size - _LEAST_BLOCKS + 1)
    total = np.cumsum(known)
    apart = total[lower - 1] / lower - (total[-1] - total[lower - 1]) / (known.size - lower)
    cut = int(lower[np.argmax(lower * (known.size - lower) * apart**2)])
    return 0.5 * (median_of(known[:cut]) + median_of(known[cut:]))


def _best_cut(heavy: BoolArray) -> tuple[int, bool, int]:
    """Where (b,) blocks pass best from one level to the other, whether to the higher, and how many lie wrong."""
    before = np.concatenate(([0], np.cumsum(heavy)))
    cuts = np.arange(_LEAST_BLOCKS, heavy.size - _LEAST_BLOCKS + 1)
    up = before[cuts] + (heavy.size - cuts) - (before[-1] - before[cuts])
    gains = bool(up.min() <= (heavy.size - up).min())
    wrong = up if gains else heavy.size - up
    return int(cuts[np.argmin(wrong)]), gains, int(wrong.min())


def _friction_shapes(velocity: FloatArray) -> FloatArray:
    """(n, 3) of Coulomb and viscous friction, and an offset."""
    return np.stack([np.tanh(velocity / _SLIDING_RAD_S), velocity, np.ones_like(velocity)], axis=1)


def _each_sample(
    residual: FloatArray, per_kg: FloatArray, mass_kg: FloatArray, friction: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """(n,) weighted sums over the joints, whose ratio is the mass that they tell, kg.

    Args:
        residual, per_kg: (n, j) torque beside the model, and of a kilogram.
        mass_kg: (n,) as known so far: friction is what is left beside it.
        friction: of each joint (n, 3) shapes of its friction.
    """
    top, bottom = np.zeros(len(residual)), np.zeros(len(residual))
    for own, torque, columns in zip(residual.T, per_kg.T, friction, strict=True):
        scale = float(np.std(own)) ** 2
        rubs = columns @ np.linalg.lstsq(columns, own - mass_kg * torque, rcond=None)[0]
        top += torque * (own - rubs) / scale
        bottom += torque**2 / scale
    return top, bottom


def _each_block(top: FloatArray, bottom: FloatArray, block: IntArray) -> tuple[FloatArray, BoolArray]:
    """(b,) mass that each block of samples (n,) alone tells, kg, and whether it tells one."""
    told, weight = (np.bincount(block, weights=x).astype(np.float64) for x in (top, bottom))
    return told / np.maximum(weight, 1e-12), weight > 0.05 * median_of(weight)


def _joints_agree(
    residual: FloatArray, per_kg: FloatArray, friction: Sequence[FloatArray], after: FloatArray, change: float
) -> bool:
    """Whether each joint that tells a weight on both sides tells this change: an error of its model is its own."""
    changes, tells = [], []
    for own, torque, columns in zip(residual.T, per_kg.T, friction, strict=True):
        sides = np.stack([torque * (1.0 - after), torque * after], axis=1)
        low, high = np.linalg.lstsq(np.concatenate([columns, sides], axis=1), own, rcond=None)[0][-2:]
        changes.append(high - low)
        tells.append(float(np.min(np.sum(sides * sides, axis=0))) / float(np.var(own)))
    ratio = np.array(changes)[np.array(tells) >= _TELLS * max(tells)] / change
    return bool(ratio.size >= min(2, len(changes)) and ((ratio > 1.0 / _ALIKE) & (ratio < _ALIKE)).all())
