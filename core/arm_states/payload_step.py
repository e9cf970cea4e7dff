"""A weight picked up or put down during a log, once or again and again: two levels of what the tool seems to weigh.

Torque beside the model's is taken as friction, an offset and m(t) times the torque of a kilogram at the tool, with m
one of two numbers. Second by second m has a spread of its own: errors of the model and of friction make it. A change
counts that stands out of it, and is the same on all joints that tell it. One that stays is told by its time; one that
comes and goes has to stand out further, since any scatter falls into two levels.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import median_of, robust_sd, varies
from collaudit.core.robot.pinocchio_model import PointMass
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.block_sums import estimate, products_of
from collaudit.core.torque_table.log_samples import TorqueTable

_BLOCK_S, _MOST_BLOCKS = 1.0, 400
#: Blocks on either side of the step; share of them that lie on its side; spreads that it exceeds; least step, kg.
_LEAST_BLOCKS, _ON_SIDE, _SPREADS, _LEAST_KG = 4, 0.9, 4.0, 0.3
#: Spreads that a weight which comes and goes exceeds: of logs without one the two levels lie up to 6.4 apart, of a UR10
#: that carries 0.5 to 5 kg for half of each cycle 15 to 21. It changes so many times at least, and per block at most.
_AGAIN_SPREADS, _AGAIN, _OFTEN = 8.0, 4, 0.5
#: Friction and weight are told from each other in so many rounds.
_ROUNDS = 4
#: A joint tells a weight that has this share of what the best one tells; changes are alike within this factor.
_TELLS, _ALIKE = 0.1, 2.0
#: A joint that moves for less than this share of a log counts at rest, too.
_MOSTLY = 0.3


#: When the weight at the tool steps, by how much, and half of its 95 % interval, kg. A second's estimates share the
#: errors of model and friction, so that many of them know hardly more than one: on 76 simulated logs, half of them
#: with a description that lacks tool and rotors, 95 % of the steps were within 3.6 spreads of a second's estimate of
#: the truth. The interval is what a step must exceed to count. Last, how often it changes.
_Step = tuple[float, float, float, int]


def payload_findings(table: TorqueTable, robot: RobotModel, joints: Collection[str]) -> tuple[Finding, ...]:
    """A finding where the tool's weight changes, for good or again and again.

    Args:
        table: the log, effort in N·m, its model torque that of ``robot`` and of the tool's commanded force.
        robot: the model as described: inertials that were identified on such motion hold a part of its weight.
        joints: names of those that are to tell it: judged, with an effort that goes with the model's torque.
    """
    step = _found(table, robot, joints)
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


def _found(table: TorqueTable, robot: RobotModel, joints: Collection[str]) -> _Step | None:
    """The step that explains most of these joints; None where none stands out."""
    frame = robot.tool.frame if robot.tool is not None else robot.link_of(table.joints[-1])
    if frame is None or not robot.has_inertials:
        return None
    position, speed, rest = table.motion[0], table.motion[1], table.effort - table.model
    per_kg = robot.holding_torque(position, PointMass(frame, 1.0, (0.0, 0.0, 0.0)))
    changes = varies(table.effort)  # beside an effort that never does stands the whole model's torque
    telling = np.flatnonzero(changes & [joint in joints for joint in table.joints])
    recorded = np.isfinite(per_kg).all(axis=1)
    rows = np.flatnonzero(recorded & np.isfinite(rest[:, telling]).all(axis=1))
    if rows.size <= 0.5 * np.count_nonzero(recorded):
        return None
    length = max(_BLOCK_S, float(table.time_s[-1] - table.time_s[0]) / _MOST_BLOCKS)
    time_s, way = table.time_s[rows], table.way[np.ix_(rows, telling)]
    _, block = np.unique(((time_s - table.time_s[0]) / length).astype(np.int64), return_inverse=True)
    slides = np.abs(way) == 1.0  # friction at rest is unknown, and little where a joint hardly moves at all
    parts = (way, *(x[np.ix_(rows, telling)] for x in (speed, np.ones_like(rest), per_kg, rest)))
    columns = np.stack(parts, axis=2) * (slides | (slides.mean(axis=0) < _MOSTLY))[:, :, None]
    tells = (columns[:, :, 4].std(axis=0) > 0) & (np.abs(columns[:, :, 3]).max(axis=0) > 1e-3)
    if not tells.any() or block[-1] + 1 < 2 * _LEAST_BLOCKS:
        return None
    columns[:, :, 3:] /= np.maximum(columns[:, :, 4:].std(axis=0), 1e-12)
    return _step(columns[:, tells], block, time_s)


def _step(columns: FloatArray, block: IntArray, time_s: FloatArray) -> _Step | None:
    """Of (n, j, 5) columns: three of friction, torque of a kilogram and beside the model's, in units of the last."""
    products = products_of(columns, block)
    levels = _levels_of_blocks(products, columns, block)
    if levels is None:
        return None
    usable, heavy, change, spread, filled = levels
    cut, gains, wrong = _best_cut(heavy[usable])
    stays = wrong <= (1.0 - _ON_SIDE) * usable.size
    if stays:
        first, after, times, spreads = usable[cut], np.arange(len(heavy)) >= usable[cut], 1, _SPREADS
        change = change if gains else -change
    else:
        changes = np.flatnonzero(np.diff(heavy[usable]))
        first, after, times, spreads = usable[changes[0] + 1], heavy, changes.size, _AGAIN_SPREADS
    again = filled and _AGAIN <= times <= _OFTEN * usable.size
    if abs(change) < max(_LEAST_KG, spreads * spread) or not (stays or again):
        return None
    if not _joints_agree(products, after, change):
        return None
    return float(time_s[int(np.argmax(block >= first))]), change, _SPREADS * spread, times


def _levels_of_blocks(
    products: FloatArray, columns: FloatArray, block: IntArray
) -> tuple[IntArray, BoolArray, float, float, bool] | None:
    """Blocks that tell a weight, those (b,) of the higher of two levels, how far these lie apart and scatter, kg.

    Last, whether each level holds for most of its blocks' time: a load does, and a push of a part of a second does not.
    """
    weight = products[:, :, 3, 3].sum(axis=1)
    told = weight > 0.05 * median_of(weight)
    usable, heavy = np.flatnonzero(told), np.zeros(len(weight), dtype=np.bool_)
    if usable.size < 2 * _LEAST_BLOCKS:
        return None
    for _ in range(_ROUNDS):
        value = _two_levels(products, heavy)
        rubs = np.insert(-value[:-2].reshape(-1, 3), 3, [[0.0], [1.0]], axis=1)
        each = np.einsum("bjn,jn->b", products[:, :, 3], rubs) / np.maximum(weight, 1e-12)
        heavy = each > _between(np.sort(each[usable]))
        if heavy[usable].all() or not heavy[usable].any():
            return None
    high, low = median_of(each[told & heavy]), median_of(each[told & ~heavy])
    top, bottom = np.einsum("nj,njk,jk->n", columns[:, :, 3], columns, rubs), np.sum(columns[:, :, 3] ** 2, axis=1)
    above = top > 0.5 * (high + low) * bottom
    parts = [told[block] & (heavy[block] == level) for level in (True, False)]
    filled = all(
        bottom[part & (above == level)].sum() > 0.5 * bottom[part].sum()
        for part, level in zip(parts, (True, False), strict=True)
    )
    return usable, heavy, high - low, robust_sd((each - np.where(heavy, high, low))[told]), filled


def _two_levels(products: FloatArray, heavy: BoolArray) -> FloatArray:
    """(3 j + 2,) friction of each joint, and the weight, kg, in some blocks (b,) and in the others."""
    joints, pick = products.shape[1], [0, 1, 2, 3, 3, 4]
    side = np.ones((len(heavy), 6))
    side[:, 3], side[:, 4] = heavy, ~heavy
    split = products[:, :, pick][..., pick] * (side[:, :, None] * side[:, None, :])[:, None]
    own = np.arange(3 * joints).reshape(joints, 3)
    place = np.hstack([own, np.tile([3 * joints, 3 * joints + 1], (joints, 1))])
    return estimate(split, products[:, :, 2, 2], place, np.zeros(3 * joints + 2)).value


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


def _joints_agree(products: FloatArray, after: BoolArray, change: float) -> bool:
    """Whether each joint that tells a weight on both sides tells this change: an error of its model is its own."""
    values = [_two_levels(products[:, [j]], after)[-2:] for j in range(products.shape[1])]
    told = np.minimum(products[after, :, 3, 3].sum(axis=0), products[~after, :, 3, 3].sum(axis=0))
    ratio = np.array([high - low for high, low in values])[told >= _TELLS * told.max()] / change
    return bool(ratio.size >= min(2, len(values)) and ((ratio > 1.0 / _ALIKE) & (ratio < _ALIKE)).all())
