"""The smallest force at which each of many injected contacts alarms, and how long after its onset."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.sliding_extremes import lowest_in_row
from collaudit.core.numeric.tables import blocks
from collaudit.core.rule_study.shown_torque import Windows, shown

#: Forces between which the smallest is looked for, N: beyond the largest no contact with a person is.
LEAST_N, LARGEST_N = 0.1, 5000.0
#: Halvings of that range: the force is found to 1 %.
_HALVINGS = 10
#: Contacts that are computed together: few enough to stay in the cache.
_AT_ONCE = 8


def first_alarms(excess_nm: FloatArray, gamma_nm: FloatArray, n: int) -> IntArray:
    """(k,) sample of the window at which rule (6) first fires on any joint; -1 where it does not.

    Args:
        excess_nm: (j, k, t).
        gamma_nm: (j,) thresholds.
        n: persistence, samples.
    """
    lasting: BoolArray = np.asarray(lowest_in_row(excess_nm, n) > gamma_nm[:, None, None])
    if lasting.shape[-1] == 0:
        return np.full(excess_nm.shape[1], -1, dtype=np.int64)
    fires = np.asarray(lasting.any(axis=0))
    return np.where(fires.any(axis=1), np.argmax(fires, axis=1) + n - 1, -1).astype(np.int64)


def alarmed(around: Windows, added_nm: FloatArray, gamma_nm: FloatArray, n: int) -> BoolArray:
    """(k,) whether rule (6) fires on any joint with these torques (j, k, t) added."""
    return np.asarray(first_alarms(shown(around, added_nm), gamma_nm, n) >= 0)


def noticed_forces(around: Windows, unit_nm: FloatArray, gamma_nm: FloatArray, n: int) -> FloatArray:
    """(k,) smallest force of each contact that alarms, N; infinite where none does, NaN where the log alarms anyway.

    Args:
        around: the log around the contacts.
        unit_nm: (j, k, t) torque through the filters of a contact of one newton.
        gamma_nm: (j,) thresholds.
        n: persistence, samples.
    """
    parts = [
        _noticed_forces(around.part(rows), np.ascontiguousarray(unit_nm[:, rows]), gamma_nm, n)
        for rows in blocks(unit_nm.shape[1], _AT_ONCE)
    ]
    return np.concatenate(parts) if parts else np.empty(0)


def _noticed_forces(around: Windows, unit_nm: FloatArray, gamma_nm: FloatArray, n: int) -> FloatArray:
    count = unit_nm.shape[1]
    low, high = np.full(count, np.log(LEAST_N)), np.full(count, np.log(LARGEST_N))
    seen = alarmed(around, LARGEST_N * unit_nm, gamma_nm, n)
    anyway = alarmed(around, np.zeros_like(unit_nm), gamma_nm, n)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        fires = alarmed(around, np.exp(middle)[None, :, None] * unit_nm, gamma_nm, n)
        high, low = np.where(fires, middle, high), np.where(fires, low, middle)
    return np.asarray(np.where(anyway, np.nan, np.where(seen, np.exp(high), np.inf)))


def alarm_delays(
    around: Windows, unit_nm: FloatArray, force_n: FloatArray, gamma_nm: FloatArray, n: int, onset: int
) -> IntArray:
    """(k,) samples from the onset to the alarm of contacts of these forces (k,); counted only where they alarm."""
    fired = first_alarms(shown(around, force_n[None, :, None] * unit_nm), gamma_nm, n)
    return np.asarray(fired[fired >= 0] - onset)
