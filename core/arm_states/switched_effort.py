"""An effort that changes its unit or its sign in the middle of a log: the model's torque then has two gains, not one.

Friction is fitted beside the gain, each part with its own: it turns, and grows, with the effort.
"""

from __future__ import annotations

from collections.abc import Collection
from math import ceil

import numpy as np

from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import NOISE_OF_BENDS, median_of
from collaudit.core.torque_table.block_sums import products_of, solutions
from collaudit.core.torque_table.log_samples import TorqueTable

#: Cuts that are looked at: between blocks of so long, and so many at most.
_BLOCK_S, _MOST_BLOCKS = 0.5, 600
#: Speed at which Coulomb friction is at its full size, rad/s.
_SLIDING_RAD_S = 0.01
#: Either part is at least this long, s, and at least this share of the log.
_LEAST_S, _LEAST_SHARE = 2.0, 0.05
#: Load of either part, root mean square, as a share of the whole log's: less tells no gain.
_LOADED = 0.3
#: Share of either part's effort that its own gain explains; share of the rest that one gain for both leaves.
_EXPLAINED, _LEFT = 0.6, 0.4
#: Share of what the model leaves that friction must explain for its sign to be known: it turns with the effort's.
_FRICTION = 0.3
#: Friction at rest in sizes of friction in motion, at most.
_HELD = 2.0
#: Sizes that differ by more than this factor are no change of friction or load; joints are
#: alike within the next one; gains with a turned sign within the last one.
_FACTOR, _LIKE, _ALIKE = 15.0, 3.0, 2.0
#: The effort turns within so long of the best cut, s, in the means of so many samples, that are opposite but for this
#: share of their difference, which is so many standard deviations of noise.
_NEAR_S, _MEAN, _OPPOSITE, _SURE = 1.0, 4, 0.5, 8.0
#: Slower than this for so long before and after, a joint stands, rad/s and s; a longer step, in usual ones, is a gap,
#: in which anything may have turned.
_STANDING_RAD_S, _SETTLED_S, _GAP = 1e-3, 0.1, 3.0
#: A joint that goes on is this fast at least, rad/s: below, friction may turn, as it does where a joint breaks loose.
_SLIDES_RAD_S = 0.02
#: Samples in motion, of those looked at, that tell a joint's size.
_LEAST_MOVING = 50


def switched_efforts(series: UniformSeries, table: TorqueTable | None, judged: Collection[str]) -> tuple[Finding, ...]:
    """A finding for each judged joint whose effort changes its unit or sign.

    Args:
        series: all joints of the log.
        table: the same, with the model torque; None without effort or model.
        judged: names of the joints to judge.
    """
    if series.effort is None or table is None:
        return ()
    columns = [series.column(joint) for joint in judged]
    scaled = _rescaled(table, columns)
    if scaled is not None:  # a unit is one for all joints, also for those that move too little to tell it
        at, times = scaled
        listed = ", ".join(f"{joint} {share:.3g} times" for joint, share in zip(judged, times, strict=True) if share)
        text = (
            f"From {at:.4g} s on, efforts are many times larger or smaller than before in motion alike ({listed}): "
            "their unit was switched while recording. Nothing can be judged."
        )
        return (Finding("effort-switched", "error", text, start_s=at),)
    findings = []
    for joint, j in zip(judged, columns, strict=True):
        found = _turn(table, j)
        moment = found and _moment(series.time_s, series.effort[:, j], series.velocity_rad_s[:, j], found[0])
        if found is None or moment is None:
            continue
        text = (
            f"The sign of the effort of joint '{joint}' turns at {moment:.4g} s (gain against the model's torque "
            f"{found[1]:.3g}, then {found[2]:.3g}): nothing of this joint can be judged."
        )
        findings.append(Finding("effort-switched", "error", text, joint=joint, start_s=moment))
    return tuple(findings)


def _rescaled(table: TorqueTable, columns: list[int]) -> tuple[float, list[float]] | None:
    """Time from which the moving joints' efforts all are larger, or smaller, by like factors; None without one.

    With the factors; 0 of joints that do not move enough before or after.
    """
    effort = table.effort[:, columns]
    rows = np.flatnonzero((np.isfinite(effort) & (effort != 0.0)).any(axis=1))
    if rows.size < _LEAST_MOVING:
        return None
    effort, model, way = effort[rows], table.model[rows][:, columns], table.way[rows][:, columns]
    t, moving = table.time_s[rows], (np.abs(way) == 1.0) & np.isfinite(effort)
    length = max(_LEAST_S, _LEAST_SHARE * float(t[-1] - t[0]))
    cuts = np.flatnonzero((t - t[0] >= length) & (t[-1] - t >= length))
    parts = (moving.astype(float), np.where(moving, effort**2, 0.0), np.where(moving, model**2, 0.0))
    counts, sizes, loads = (np.cumsum(np.nan_to_num(part), axis=0) for part in parts)
    first, second = counts[cuts], counts[-1] - counts[cuts]
    enough = np.minimum(first, second) >= _LEAST_MOVING
    with np.errstate(invalid="ignore", divide="ignore"):
        before, after = sizes[cuts] / first, (sizes[-1] - sizes[cuts]) / second
        times = np.where(enough, np.sqrt(after / before), np.nan)
        load = np.sqrt((loads[-1] - loads[cuts]) / second / (loads[cuts] / first))
        more, less = times / np.fmax(load, 1.0), times / np.fmin(load, 1.0)  # beyond what the load explains
        low, high = np.nanmin(np.where(enough, times, np.inf), axis=1), np.nanmax(np.where(enough, times, 0.0), axis=1)
        beyond = (~enough | (more > _FACTOR)).all(axis=1) | (~enough | (less < 1.0 / _FACTOR)).all(axis=1)
        beyond &= (high < _LIKE * low) & (low > 0.0)
        good = beyond & (np.count_nonzero(enough, axis=1) >= min(2, effort.shape[1]))
        whole = counts[-1] * np.log(sizes[-1] / counts[-1])  # of a joint that does not tell a cut
        unlikely = np.nansum(np.where(enough, first * np.log(before) + second * np.log(after), whole), axis=1)
    if not good.any():
        return None
    best = int(np.argmin(np.where(good, unlikely, np.inf)))
    return float(t[cuts[best]]), [float(x) for x in np.nan_to_num(times[best])]


def _turn(table: TorqueTable, j: int) -> tuple[float, float, float] | None:
    """Time about which a joint's effort turns its sign, and the gains before and after; None where it does not."""
    speed = table.motion[1][:, j]
    every = np.stack([table.model[:, j], np.tanh(speed / _SLIDING_RAD_S), speed, table.effort[:, j]], axis=1)
    known = np.flatnonzero(np.isfinite(every).all(axis=1))
    if known.size < 50:
        return None
    t = table.time_s[known]
    length = max(_BLOCK_S, float(t[-1] - t[0]) / _MOST_BLOCKS)
    _, block = np.unique(np.floor((t - t[0]) / length), return_inverse=True)
    sums = np.cumsum(products_of(every[known][:, None], block)[:, 0], axis=0)
    last = np.searchsorted(block, np.arange(len(sums)), side="right") - 1
    least = max(_LEAST_S, _LEAST_SHARE * float(t[-1] - t[0]))
    inside = np.flatnonzero((t[last] - t[0] >= least) & (t[-1] - t[last] >= least))
    if inside.size == 0 or sums[-1, 0, 0] <= 0 or sums[-1, 3, 3] <= 0:
        return None
    best = _best_cut(sums, inside, np.asarray(last + 1.0, dtype=np.float64))
    return None if best is None else (float(t[last[best[0]]]), best[1], best[2])


def _moment(time_s: FloatArray, effort: FloatArray, velocity: FloatArray, cut_s: float) -> float | None:
    """When, near a time, the effort turns from one sample to the next while its joint does not; None where it does not.

    The time itself where a gap hides it. Two gains also fit where the model lacks a load: then the effort passes
    through zero, or turns with the motion.
    """
    near = np.flatnonzero(np.abs(time_s - cut_s) <= max(_NEAR_S, float(time_s[-1] - time_s[0]) / _MOST_BLOCKS))
    x, v, steps = effort[near], velocity[near], np.diff(time_s[near])
    if near.size < 4 * _MEAN or steps.max() > _GAP * median_of(steps) or not np.isfinite(x.sum()):
        return cut_s
    total = np.concatenate(([0.0], np.cumsum(x)))
    mean = (total[_MEAN:] - total[:-_MEAN]) / _MEAN
    before, after = mean[:-_MEAN], mean[_MEAN:]
    noise = median_of(np.abs(np.diff(x, 2))) * NOISE_OF_BENDS * np.sqrt(2.0 / _MEAN)
    turns = np.abs(before + after) < _OPPOSITE * np.abs(after - before)
    turns &= np.abs(after - before) > _SURE * noise
    first, last = v[: turns.size], v[2 * _MEAN - 1 :]
    slower, faster = np.fmin(np.abs(first), np.abs(last)), np.fmax(np.abs(first), np.abs(last))
    goes_on = (first * last > 0.0) & (2.0 * slower > faster) & (slower >= _SLIDES_RAD_S)
    moves = np.concatenate(([0], np.cumsum(np.abs(v) >= _STANDING_RAD_S)))
    row, margin = np.arange(turns.size), ceil(_SETTLED_S / (time_s[near[1]] - time_s[near[0]]))
    around = moves[np.minimum(row + 2 * _MEAN + margin, v.size)] - moves[np.maximum(row - margin, 0)]
    size = np.where(turns & (goes_on | (around == 0)), np.abs(after - before), 0.0)
    return float(time_s[near[int(np.argmax(size)) + _MEAN]]) if size.any() else None


def _best_cut(sums: FloatArray, cuts: IntArray, count: FloatArray) -> tuple[int, float, float] | None:
    """The likeliest of the cuts at which the sign turns, and the gains before and after; None where it does not.

    Args:
        sums: (b, 4, 4) of the blocks up to each; count: (b,) of their samples.
        cuts: blocks after which it may be.
    """
    left, right, whole = _part(sums[cuts]), _part(sums[-1] - sums[cuts]), _part(sums[-1:])[2][0]
    first = count[cuts]
    second = count[-1] - first
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = right[0] / np.where(left[0] == 0, np.nan, left[0])
        turned = (ratio < -1.0 / _ALIKE) & (ratio > -_ALIKE) & (left[2] + right[2] < _LEFT * whole)
        load = np.minimum(sums[cuts, 0, 0] / first, (sums[-1, 0, 0] - sums[cuts, 0, 0]) / second)
        loaded = load > _LOADED**2 * sums[-1, 0, 0] / count[-1]
        good = loaded & turned & (left[1] > _EXPLAINED) & (right[1] > _EXPLAINED)
        good &= ~((left[3] * right[3] > 0) & (np.minimum(left[4], right[4]) > _FRICTION))
        good &= (left[4] > _FRICTION) | _beyond_friction(sums[cuts], first, right)
        good &= (right[4] > _FRICTION) | _beyond_friction(sums[-1] - sums[cuts], second, left)
    if not good.any():
        return None
    unlikely = first * np.log(left[2] / first + 1e-12) + second * np.log(right[2] / second + 1e-12)
    best = int(np.argmin(np.where(good, unlikely, np.inf)))
    return int(cuts[best]), float(left[0][best]), float(right[0][best])


def _beyond_friction(sums: FloatArray, count: FloatArray, other: tuple[FloatArray, ...]) -> BoolArray:
    """(k,) whether friction cannot hide that this part has the other one's sign: at rest it may bear either way."""
    gain, coulomb = other[0], other[5]
    away = sums[:, 3, 3] - 2.0 * gain * sums[:, 0, 3] + gain**2 * sums[:, 0, 0]
    return np.asarray(away > count * (_HELD * coulomb) ** 2)


def _part(sums: FloatArray) -> tuple[FloatArray, ...]:
    """What (k, 4, 4) sums of model, friction's shapes and effort tell: gain, share explained, squares left, friction.

    The share is the smaller one of two: of the whole effort's squares, and, times two, of what friction alone leaves.
    Of friction: its power, whose sign turns with the effort's, the share of what the model alone leaves, and its size.
    """
    found, left = solutions(sums, (0, 1, 2))
    without = solutions(sums, (1, 2))[1]
    whole = np.maximum(sums[:, 3, 3], 1e-30)
    explained = 1.0 - left / np.maximum(without, 1e-30)
    power = found[:, 1] * sums[:, 1, 2] + found[:, 2] * sums[:, 2, 2]
    rubs = 1.0 - left / np.maximum(solutions(sums, (0,))[1], 1e-30)
    return found[:, 0], np.minimum(1.0 - left / whole, 2.0 * explained), left, power, rubs, np.abs(found[:, 1])
