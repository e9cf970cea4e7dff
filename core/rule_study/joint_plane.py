"""Alarms and sensitivity of one joint for every threshold and persistence of a grid, as rule (6) counts them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from scipy.special import gammaincinv as gamma_quantile

from collaudit.core.data.rule_study_result import JointPlane, PlanePoint
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.runs import lowest_in_row, run_bounds
from collaudit.core.numeric.stats import robust_sd
from collaudit.core.rule_study.shown_torque import Windows, shown

#: Of the moments, a torque is to be noticed at so many.
NOTICED_SHARE = 0.95
#: Torques that are tried: from below the lowest threshold to above the highest, in equal ratios.
_TORQUES = 28
#: Steps of the grid.
GAMMAS, COUNTS = 100, 50
#: The longest persistence of the grid is at least this, and at least ``COUNTS`` samples.
_LONGEST_S = 0.25


def excess(residual_nm: FloatArray, uncertainty_nm: FloatArray, evidence: BoolArray) -> FloatArray:
    """(n,) the threshold below which a sample counts as above it, N·m; -inf where nothing can alarm.

    Rule (6) asks for |residual| > gamma + uncertainty, which is gamma < |residual| - uncertainty.

    Args:
        residual_nm, uncertainty_nm: (n,) of one joint.
        evidence: (n,) samples that may count.
    """
    with np.errstate(invalid="ignore"):
        out = np.abs(residual_nm) - uncertainty_nm
    out[~evidence | np.isnan(out)] = -np.inf
    return np.asarray(out)


def alarm_grid(excess_nm: FloatArray, gamma_nm: FloatArray, counts: IntArray, merge_samples: int = 0) -> IntArray:
    """(g, c) alarms for each threshold and persistence.

    Args:
        excess_nm: (n,) of :func:`excess`.
        gamma_nm: (g,) thresholds.
        counts: (c,) persistences, samples, rising.
        merge_samples: alarms closer than this are one.
    """
    out = np.zeros((gamma_nm.size, counts.size), dtype=np.int64)
    for g, gamma in enumerate(gamma_nm):
        starts, stops = run_bounds(excess_nm > gamma)
        for c, n in enumerate(counts):
            long = stops - starts >= n
            starts, stops = starts[long], stops[long]
            if starts.size == 0:
                break
            out[g, c] = 1 + np.count_nonzero(starts[1:] - stops[:-1] >= max(1, merge_samples))
    return out


def sustained_level(excess_nm: FloatArray, counts: IntArray) -> FloatArray:
    """(c,) the threshold below which rule (6) alarms at all, for each persistence; -inf where none does.

    Args:
        excess_nm: (…, n) of :func:`excess`; the last axis is time.
        counts: (c,) persistences, samples, rising.

    Returns:
        (…, c) the largest over all windows of n samples of the smallest excess inside, N·m.
    """
    out = np.full((*excess_nm.shape[:-1], counts.size), -np.inf)
    for c, n in enumerate(counts.tolist()):
        lowest = lowest_in_row(excess_nm, n)
        if lowest.shape[-1] == 0:
            break
        out[..., c] = lowest.max(axis=-1)
    return out


def grid_gammas(floor_nm: float, set_nm: Sequence[float], largest_nm: float) -> FloatArray:
    """(100,) thresholds in equal ratios, from the noise to well above everything seen or set, N·m.

    Args:
        floor_nm: level of the clean residual.
        set_nm: thresholds that the grid must enclose.
        largest_nm: the largest clean excess.
    """
    known = [x for x in (*set_nm, largest_nm, floor_nm) if np.isfinite(x) and x > 0]
    low, high = 0.01, 10.0
    if known:
        low = 0.5 * min(floor_nm if floor_nm > 0 else np.inf, *known)
        high = max(2.5 * max(known), 10.0 * low)
    return np.asarray(np.geomspace(low, high, GAMMAS))


def grid_counts(period_s: float, set_n: int) -> IntArray:
    """(50,) persistences, dense where they are short, up to a quarter of a second or more; with the one set."""
    longest = max(COUNTS, round(_LONGEST_S / period_s), set_n)
    steps = np.round(np.geomspace(1, longest, COUNTS)).astype(np.int64)
    values = np.maximum(np.arange(1, COUNTS + 1), steps)
    nearest = int(np.argmin(np.abs(np.log(values / set_n))))
    values[nearest] = set_n
    return np.unique(values)


@dataclass(frozen=True, slots=True, eq=False)
class JointSeries:
    """One joint of a log as rule (6) sees it.

    Attributes:
        residual_nm, uncertainty_nm: (n,).
        clean: (n,) samples without contact at which the rule can fire.
        period_s: sample period, s.
        merge_samples: alarms closer than this are one.
    """

    residual_nm: FloatArray
    uncertainty_nm: FloatArray
    clean: BoolArray
    period_s: float
    merge_samples: int

    @property
    def hours(self) -> float:
        """Of clean samples."""
        return float(np.count_nonzero(self.clean)) * self.period_s / 3600.0

    def excess(self) -> FloatArray:
        """(n,) of :func:`excess`."""
        return excess(self.residual_nm, self.uncertainty_nm, self.clean)


@dataclass(frozen=True, slots=True, eq=False)
class AddedTorque:
    """A torque of one newton metre added to one joint at many moments, through the filters.

    Attributes:
        around: the joint there, (1, k, t).
        unit_nm: (1, k, t) or (1, 1, t).
    """

    around: Windows
    unit_nm: FloatArray


def joint_plane(joint: JointSeries, gamma_nm: float, n: int, push: AddedTorque | None) -> JointPlane:
    """The plane of one joint, with the rule that is set and no recommendation.

    Args:
        joint: its residual.
        gamma_nm, n: the rule that is set.
        push: reference push at moments of the log; None where its sensitivity is not known.
    """
    found = joint.excess()
    seen = found[np.isfinite(found)]
    floor = robust_sd(seen - np.median(seen)) if seen.size else 0.0
    every = grid_gammas(floor, [gamma_nm], float(seen.max(initial=0.0)))
    gammas = np.array([float(f"{x:.5g}") for x in every])  # for files
    counts = grid_counts(joint.period_s, n)
    alarms = alarm_grid(found, gammas, counts, joint.merge_samples)
    torque = np.full(alarms.shape, np.nan) if push is None else smallest_torques(push, gammas, counts)
    return JointPlane(
        gamma_nm=tuple(float(x) for x in gammas),
        n=tuple(int(x) for x in counts),
        clean_hours=joint.hours,
        alarms=tuple(tuple(int(x) for x in row) for row in alarms),
        torque_nm=tuple(tuple(_known(row)) for row in torque),
        configured=plane_point(joint, gamma_nm, n, push),
        chosen=None,
        frontier=(),
    )


def plane_point(joint: JointSeries, gamma_nm: float, n: int, push: AddedTorque | None) -> PlanePoint:
    """One rule of a joint, computed as the cells of the plane are."""
    gammas, counts = np.array([gamma_nm]), np.array([n])
    alarms = int(alarm_grid(joint.excess(), gammas, counts, joint.merge_samples)[0, 0])
    torque = None if push is None else _known(smallest_torques(push, gammas, counts)[0])[0]
    return _point(gamma_nm, n, alarms, joint.hours, torque)


def _point(gamma_nm: float, n: int, alarms: int, hours: float, torque_nm: float | None) -> PlanePoint:
    return PlanePoint(gamma_nm, n, alarms, *alarm_rate(alarms, hours), torque_nm)


def alarm_rate(alarms: int, hours: float) -> tuple[float | None, float | None]:
    """Alarms an hour, and their one-sided 95 % Poisson bound (3 where none was seen); None without time."""
    if hours <= 0:
        return None, None
    return alarms / hours, float(gamma_quantile(alarms + 1.0, 0.95)) / hours


def smallest_torques(push: AddedTorque, gammas: FloatArray, counts: IntArray) -> FloatArray:
    """(g, c) smallest torque, N·m, that alarms at 95 % of the moments; NaN where none of those tried does.

    At each moment the level that is sustained for n samples rises with the torque, and an alarm is where it exceeds
    gamma: between the torques tried it is taken as straight, which it is where friction is a value.
    """
    torques = _torques(gammas, push)
    moments = push.around.above_nm.shape[1]
    level = np.empty((torques.size, moments, counts.size))
    for i, torque in enumerate(torques):
        level[i] = sustained_level(shown(push.around, torque * push.unit_nm), counts)[0]
    level = np.maximum.accumulate(level, axis=0)
    needed = _crossings(level, torques, gammas)
    place = min(moments - 1, int(np.ceil(NOTICED_SHARE * moments)) - 1)
    out = np.partition(needed, place, axis=1)[:, place]
    return np.where(np.isfinite(out), out, np.nan)


def _torques(gammas: FloatArray, push: AddedTorque) -> FloatArray:
    """(a,) torques to try: what hides behind friction is to be exceeded too."""
    width = push.around.width_nm
    hidden = float(np.max(width, where=np.isfinite(width), initial=0.0))
    peak = max(float(np.max(np.abs(push.unit_nm))), 1e-3)
    return np.concatenate(([0.0], np.geomspace(0.3 * gammas[0], 2.0 * (gammas[-1] + hidden) / peak, _TORQUES)))


def _crossings(level: FloatArray, torques: FloatArray, gammas: FloatArray) -> FloatArray:
    """(g, k, c) torque at which the rising levels (a, k, c) pass each threshold; infinite where they do not."""
    out = np.full((gammas.size, *level.shape[1:]), np.inf)
    for g, gamma in enumerate(gammas):
        above = level > gamma
        passes = above[-1]
        first = np.argmax(above, axis=0)
        low = np.maximum(first - 1, 0)
        at_low = np.take_along_axis(level, low[None], axis=0)[0]
        at_high = np.take_along_axis(level, first[None], axis=0)[0]
        with np.errstate(invalid="ignore", divide="ignore"):
            share = (gamma - at_low) / (at_high - at_low)
        share = np.where(np.isfinite(at_low) & np.isfinite(share), share, 1.0)
        out[g] = np.where(passes, torques[low] + share * (torques[first] - torques[low]), np.inf)
        out[g][passes & (first == 0)] = 0.0
    return out


def _known(values: Sequence[float] | FloatArray) -> list[float | None]:
    """Numbers in three significant digits; None for what is not known."""
    return [float(f"{x:.3g}") if np.isfinite(x) else None for x in values]


def frontier(plane: JointPlane) -> tuple[PlanePoint, ...]:
    """Rules by rising number of alarms, each noticing less torque than those before it."""
    cells = [
        (plane.alarms[g][c], torque, g, c)
        for g, row in enumerate(plane.torque_nm)
        for c, torque in enumerate(row)
        if torque is not None
    ]
    best, out = inf, []
    for _, torque, g, c in sorted(cells):
        if torque < best:
            best = torque
            out.append(point_of(plane, g, c))
    return tuple(out)


def point_of(plane: JointPlane, g: int, c: int) -> PlanePoint:
    """One cell of a plane."""
    return _point(plane.gamma_nm[g], plane.n[c], plane.alarms[g][c], plane.clean_hours, plane.torque_nm[g][c])
