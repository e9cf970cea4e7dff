"""A weight picked up or put down during a log: a step in what the tool seems to weigh, in all poses alike.

Torque beside the model's is taken as friction, an offset and m(t) times the torque of a kilogram at the tool, with
m one number before a moment and another after it. Second by second m has a spread of its own: errors of the model and
of friction make it. A step counts that stands out of it, stays, and is the same on all joints that tell it.
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
#: A joint tells a weight that has this share of what the best one tells; changes are alike within this factor.
_TELLS, _ALIKE = 0.1, 2.0
#: Speed at which Coulomb friction is at its full size, rad/s.
_SLIDING_RAD_S = 0.01
#: A joint that moves for less than this share of a log counts at rest, too.
_MOSTLY = 0.3


#: When the weight at the tool steps, by how much, and half of its 95 % interval, kg. A second's estimates share the
#: errors of model and friction, so that many of them know hardly more than one: on 76 simulated logs, half of them
#: with a description that lacks tool and rotors, 95 % of the steps were within 3.6 spreads of a second's estimate of
#: the truth. The interval is what a step must exceed to count.
_Step = tuple[float, float, float]


def payload_findings(
    series: UniformSeries, robot: RobotModel, model_nm: FloatArray | None, joints: Collection[str]
) -> tuple[Finding, ...]:
    """A finding where the tool's weight changes for good.

    Args:
        series: all joints of the log, effort in N·m.
        robot: the model.
        model_nm: (n, j) model torque, the tool's commanded force included.
        joints: names of those that are to tell it: judged, with an effort that goes with the model's torque.
    """
    step = None if model_nm is None else _found(series, robot, model_nm, joints)
    if step is None:
        return ()
    at_s, mass_kg, half_kg = step
    verb = "gains" if mass_kg > 0 else "loses"
    text = (
        f"From {at_s:.4g} s on, the weight at the tool differs: over all poses it {verb} "
        f"{abs(mass_kg):.2g} kg (± {half_kg:.2g} kg, 95 %). A tool or payload was changed, "
        "or something pulls at the arm all the time; later alarms may come from it."
    )
    return (Finding("payload-changed", "warning", text, start_s=at_s),)


def _found(series: UniformSeries, robot: RobotModel, model_nm: FloatArray, joints: Collection[str]) -> _Step | None:
    """The step that explains most of these joints; None where none stands out."""
    frame = robot.tool.frame if robot.tool is not None else robot.link_of(series.joint_names[-1])
    if frame is None or series.effort is None or series.effort_unit != "Nm" or robot.bodies is None:
        return None
    rows, block = _rows(series)
    if rows.size == 0 or block[-1] + 1 < 2 * _LEAST_BLOCKS:
        return None
    position = series.position_rad[rows]
    force = np.zeros((rows.size, 6))
    force[:, :3] = -robot.gravity_in(position, frame)
    per_kg = robot.wrench_torque(position, force, frame)
    residual = series.effort[rows] - model_nm[rows]
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
    sums = _sums(residual, per_kg, friction, block)
    cut = min(range(_LEAST_BLOCKS, count - _LEAST_BLOCKS + 1), key=lambda cut: _split(sums, cut)[0])
    mass = _split(sums, cut)[1]
    after = (block >= cut).astype(float)
    known = per_kg * np.where(after > 0, mass[1], mass[0])[:, None]
    change, spread = _change(cut, residual, per_kg, known, friction, block)
    if abs(change) < max(_LEAST_KG, _SPREADS * spread) or not _joints_agree(residual, per_kg, friction, after, change):
        return None
    return float(time_s[int(np.argmax(block >= cut))]), change, _SPREADS * spread


def _sums(residual: FloatArray, per_kg: FloatArray, friction: Sequence[FloatArray], block: IntArray) -> FloatArray:
    """What the fit of a step needs of all samples, each joint in its own spread, friction and offset eliminated.

    Returns:
        (j, blocks + 1, 5) up to each block sums of the torque per kilogram times itself, times the torque beside the
        model, and times an orthonormal basis of friction and offset.
    """
    count = int(block[-1]) + 1
    out = np.zeros((residual.shape[1], count + 1, 5))
    for sums, own, torque, columns in zip(out, residual.T, per_kg.T, friction, strict=True):
        scale = float(np.std(own))
        basis, _ = np.linalg.qr(columns)
        x, y = torque / scale, own / scale
        y = y - basis @ (basis.T @ y)
        products = x[:, None] * np.column_stack([x, y, basis])
        sums[1:] = np.cumsum([np.bincount(block, product, count) for product in products.T], axis=1).T
    return out


def _split(sums: FloatArray, cut: int) -> tuple[float, FloatArray]:
    """Less the squares that one mass before a block and another one from it on explain; and the two masses, kg."""
    before, behind = sums[:, cut], sums[:, -1] - sums[:, cut]
    low, high = (np.sum(part[:, 0]) - np.sum(part[:, 2:] ** 2) for part in (before, behind))
    both = -np.sum(before[:, 2:] * behind[:, 2:])
    right = np.array([np.sum(before[:, 1]), np.sum(behind[:, 1])])
    found = np.linalg.lstsq(np.array([[low, both], [both, high]]), right, rcond=1e-9)[0]
    return -float(found @ right), np.asarray(found, dtype=np.float64)


def _friction_shapes(velocity: FloatArray) -> FloatArray:
    """(n, 3) of Coulomb and viscous friction, and an offset."""
    return np.stack([np.tanh(velocity / _SLIDING_RAD_S), velocity, np.ones_like(velocity)], axis=1)


def _change(
    cut: int,
    residual: FloatArray,
    per_kg: FloatArray,
    known: FloatArray,
    friction: Sequence[FloatArray],
    block: IntArray,
) -> tuple[float, float]:
    """Change of the mass that each block alone tells, and its spread, kg; none where they do not lie on either side.

    Args:
        cut: the first block behind the step.
        residual, per_kg: (n, j) torque beside the model, and of a kilogram.
        known: (n, j) torque of the masses before and behind.
        friction: of each joint (n, 3) shapes of its friction.
        block: (n,) of each sample.
    """
    count = int(block[-1]) + 1
    top, bottom = np.zeros(count), np.zeros(count)
    for own, torque, mass, columns in zip(residual.T, per_kg.T, known.T, friction, strict=True):
        scale = float(np.std(own)) ** 2
        rubs = columns @ np.linalg.lstsq(columns, own - mass, rcond=None)[0]
        top += np.bincount(block, torque * (own - rubs) / scale, count)
        bottom += np.bincount(block, torque**2 / scale, count)
    usable = bottom > 0.05 * median_of(bottom)
    each = top / np.maximum(bottom, 1e-12)
    before, behind = each[:cut][usable[:cut]], each[cut:][usable[cut:]]
    if min(before.size, behind.size) < _LEAST_BLOCKS:
        return 0.0, 0.0
    low, high = median_of(before), median_of(behind)
    change, middle = high - low, 0.5 * (low + high)
    sides = (np.mean((before < middle) == (change > 0)), np.mean((behind > middle) == (change > 0)))
    spread = robust_sd(np.concatenate((before - low, behind - high)))
    return (change, spread) if min(sides) >= _ON_SIDE else (0.0, spread)


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
