"""A weight picked up or put down during a log: a step in what the tool seems to weigh, in all poses alike.

Torque beside the model's is taken as friction, an offset and m(t) times the torque of a kilogram at the tool, with
m one number before a moment and another after it. Second by second m has a spread of its own: errors of the model and
of friction make it. A step counts that stands out of it, stays, and is the same on all joints that tell it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

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


@dataclass(frozen=True, slots=True)
class PayloadStep:
    """A step of the weight at the tool: when, by how much, and half of its 95 % interval, kg.

    A second's estimates share the errors of model and friction, so that many of them know hardly more than one: on 76
    simulated logs, half of them with a description that lacks tool and rotors, 95 % of the steps were within 3.6
    spreads of a second's estimate of the truth. The interval is what a step must exceed to count.
    """

    at_s: float
    mass_kg: float
    half_kg: float


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
    step = None if model_nm is None else payload_step(series, robot, model_nm, joints)
    if step is None:
        return ()
    verb = "gains" if step.mass_kg > 0 else "loses"
    text = (
        f"From {step.at_s:.4g} s on, the weight at the tool differs: over all poses it {verb} "
        f"{abs(step.mass_kg):.2g} kg (± {step.half_kg:.2g} kg, 95 %). A tool or payload was changed, "
        "or something pulls at the arm all the time; later alarms may come from it."
    )
    return (Finding("payload-changed", "warning", text, start_s=step.at_s),)


def payload_step(
    series: UniformSeries, robot: RobotModel, model_nm: FloatArray, joints: Collection[str]
) -> PayloadStep | None:
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
) -> PayloadStep | None:
    count = int(block[-1]) + 1
    joints = [j for j in range(residual.shape[1]) if np.std(residual[:, j]) > 0 and np.max(np.abs(per_kg[:, j])) > 1e-3]
    if not joints or count < 2 * _LEAST_BLOCKS:  # the effort is unknown at the end
        return None
    sums = _sums(residual, per_kg, velocity, block, joints)
    cut = min(range(_LEAST_BLOCKS, count - _LEAST_BLOCKS + 1), key=lambda cut: _split(sums, cut)[0])
    mass = _split(sums, cut)[1]
    return _stands_out(cut, mass, residual, per_kg, velocity, block, time_s, joints)


@dataclass(frozen=True, slots=True, eq=False)
class _Sums:
    """What the fit of a step needs of all samples, up to each block, each joint in its own spread.

    Attributes:
        power: (j, blocks + 1) of the torque per kilogram, squared.
        shared: (j, blocks + 1) of it with the torque beside the model, friction and offset eliminated.
        eliminated: (j, blocks + 1, 3) of it with an orthonormal basis of friction and offset.
        total: sum of squares of the torque beside the model, friction and offset eliminated.
    """

    power: FloatArray
    shared: FloatArray
    eliminated: FloatArray
    total: float


def _sums(residual: FloatArray, per_kg: FloatArray, velocity: FloatArray, block: IntArray, joints: list[int]) -> _Sums:
    count = int(block[-1]) + 1
    power, shared = np.zeros((2, len(joints), count + 1))
    eliminated, total = np.zeros((len(joints), count + 1, 3)), 0.0
    for k, j in enumerate(joints):
        scale = float(np.std(residual[:, j]))
        basis, _ = np.linalg.qr(_nuisance(velocity[:, j]))
        y, x = residual[:, j] / scale, per_kg[:, j] / scale
        y = y - basis @ (basis.T @ y)
        total += float(y @ y)
        power[k, 1:] = np.cumsum(np.bincount(block, x * x, count))
        shared[k, 1:] = np.cumsum(np.bincount(block, x * y, count))
        for i in range(3):
            eliminated[k, 1:, i] = np.cumsum(np.bincount(block, x * basis[:, i], count))
    return _Sums(power, shared, eliminated, total)


def _split(sums: _Sums, cut: int) -> tuple[float, FloatArray]:
    """Sum of squares left with one mass before a block and another one from it on; and the two, kg."""
    before, behind = sums.eliminated[:, cut], sums.eliminated[:, -1] - sums.eliminated[:, cut]
    low = np.sum(sums.power[:, cut]) - np.sum(before * before)
    high = np.sum(sums.power[:, -1] - sums.power[:, cut]) - np.sum(behind * behind)
    both = -np.sum(before * behind)
    right = np.array([np.sum(sums.shared[:, cut]), np.sum(sums.shared[:, -1] - sums.shared[:, cut])])
    found = np.linalg.lstsq(np.array([[low, both], [both, high]]), right, rcond=1e-9)[0]
    return sums.total - float(found @ right), np.asarray(found, dtype=np.float64)


def _nuisance(velocity: FloatArray) -> FloatArray:
    return np.stack([np.tanh(velocity / _SLIDING_RAD_S), velocity, np.ones_like(velocity)], axis=1)


def _stands_out(
    cut: int,
    mass: FloatArray,
    residual: FloatArray,
    per_kg: FloatArray,
    velocity: FloatArray,
    block: IntArray,
    time_s: FloatArray,
    joints: list[int],
) -> PayloadStep | None:
    """The step, if the mass told by each block alone lies on its side of it nearly always and far enough from it."""
    after = (block >= cut).astype(float)
    count = int(block[-1]) + 1
    top, bottom = np.zeros(count), np.zeros(count)
    for j in joints:
        scale = float(np.std(residual[:, j])) ** 2
        known = per_kg[:, j] * np.where(after > 0, mass[1], mass[0])
        own = _nuisance(velocity[:, j])
        friction = own @ np.linalg.lstsq(own, residual[:, j] - known, rcond=None)[0]
        top += np.bincount(block, per_kg[:, j] * (residual[:, j] - friction) / scale, count)
        bottom += np.bincount(block, per_kg[:, j] ** 2 / scale, count)
    usable = bottom > 0.05 * median_of(bottom)
    each = top / np.maximum(bottom, 1e-12)
    before, behind = each[:cut][usable[:cut]], each[cut:][usable[cut:]]
    if min(before.size, behind.size) < _LEAST_BLOCKS:
        return None
    low, high = median_of(before), median_of(behind)
    change, middle = high - low, 0.5 * (low + high)
    spread = robust_sd(np.concatenate((before - low, behind - high)))
    sides = (np.mean((before < middle) == (change > 0)), np.mean((behind > middle) == (change > 0)))
    if abs(change) < max(_LEAST_KG, _SPREADS * spread) or min(sides) < _ON_SIDE:
        return None
    if not _joints_agree(residual, per_kg, velocity, after, joints, change):
        return None
    return PayloadStep(float(time_s[int(np.argmax(block >= cut))]), change, _SPREADS * spread)


def _joints_agree(
    residual: FloatArray, per_kg: FloatArray, velocity: FloatArray, after: FloatArray, joints: list[int], change: float
) -> bool:
    """Whether each joint that tells a weight on both sides tells this change: an error of its model is its own."""
    changes, tells = [], []
    for j in joints:
        sides = np.stack([per_kg[:, j] * (1.0 - after), per_kg[:, j] * after], axis=1)
        columns = np.concatenate([_nuisance(velocity[:, j]), sides], axis=1)
        low, high = np.linalg.lstsq(columns, residual[:, j], rcond=None)[0][-2:]
        changes.append(high - low)
        tells.append(float(np.min(np.sum(sides * sides, axis=0))) / float(np.var(residual[:, j])))
    ratio = np.array(changes)[np.array(tells) >= _TELLS * max(tells)] / change
    return bool(ratio.size >= min(2, len(joints)) and ((ratio > 1.0 / _ALIKE) & (ratio < _ALIKE)).all())
