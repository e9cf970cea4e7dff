"""Alarms of one joint for every threshold and persistence of a grid at once, exactly as rule (6) counts them.

A threshold only removes samples from those above a lower one: thresholds are taken by rising height, and of each only
the samples that are still above it are looked at. Runs follow from the breaks between their numbers, and a longer
persistence only removes runs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.sliding_extremes import lowest_in_row

IndexArray = NDArray[np.int32]
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
        gamma_nm: (g,) thresholds, rising, at most 255.
        counts: (c,) persistences, samples, rising.
        merge_samples: alarms closer than this are one, as in ``[detect] merge_ms``.
    """
    out = np.zeros((gamma_nm.size, counts.size), dtype=np.int64)
    exceeded = np.searchsorted(gamma_nm, excess_nm, side="left").astype(np.uint8)  # thresholds that a sample is above
    at = np.flatnonzero(exceeded).astype(np.int32)
    exceeded = exceeded[at]
    for k in range(gamma_nm.size):
        if k:
            still = exceeded > k
            at, exceeded = at[still], exceeded[still]
        if at.size < counts[0]:
            break
        last = np.append(np.flatnonzero(at[1:] - at[:-1] > 1), at.size - 1)
        _count(at[np.concatenate(([0], last[:-1] + 1))], at[last] + 1, counts, max(1, merge_samples), out[k])
    return out


def _count(starts: IndexArray, stops: IndexArray, counts: IntArray, gap: int, out: IntArray) -> None:
    """Alarms of the runs of one threshold by rising persistence, into (c,)."""
    for c, n in enumerate(counts):
        long = stops - starts >= n
        if not long.all():
            starts, stops = starts[long], stops[long]
        if starts.size == 0:
            return
        out[c] = 1 + np.count_nonzero(starts[1:] - stops[:-1] >= gap)


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
    values = np.arange(1, COUNTS + 1)
    if longest > COUNTS:
        ratio = _ratio(longest)
        steps = ratio ** np.arange(COUNTS)
        values = np.maximum(values, np.round(steps).astype(np.int64))
        values[-1] = longest
    nearest = int(np.argmin(np.abs(np.log(values / set_n))))
    values[nearest] = set_n
    return np.unique(values)


def _ratio(longest: int) -> float:
    """Ratio of a geometric series of the grid's length from 1 to the longest persistence."""
    return float(longest ** (1.0 / (COUNTS - 1)))
