"""Peaks of a held-out residual that stand alone: contacts that cleaning missed, stops, faults; no evidence of a tail.

A push at a reversal or at rest is not seen when a log is cleaned, since friction is not known there. One such push
makes the threshold of its joint as high as itself. Errors of a model and of friction come again with every reversal and
pose: of simulated and real arms the largest peak of clean motion is at most 2.7 times what four of five blocks stay
below.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil

import numpy as np

from collaudit.core.data.threshold_result import IsolatedPeak
from collaudit.core.detection.rule import persistence_samples
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.runs import run_bounds, widened
from collaudit.core.recommend.clean_tail import BLOCK_S
from collaudit.core.recommend.recommendation import CleanResidual, sustained_peaks

#: A peak stands alone above so many times the level that this share of the blocks stays below, of so many blocks.
_ALONE, _MOST, _FEWEST_BLOCKS = 3.0, 0.8, 20
#: Above so many times it is contact or a fault in any log: fast strokes of a real wrist, seldom driven, reach 8 times.
_PLAIN = 10.0
#: More of them than this share of the blocks do not stand alone.
_SELDOM = 0.1
_PERSISTENCE_S = 0.025
#: What is left out around it, s.
_MARGIN_S = 0.5


def without_isolated_peaks(
    data: Sequence[CleanResidual],
    moving: Sequence[BoolArray],
    touched: Sequence[bool],
    names: Sequence[str],
    times_s: Sequence[FloatArray],
) -> tuple[list[CleanResidual], tuple[IsolatedPeak, ...]]:
    """The evidence of one joint without peaks that stand alone, and all such peaks.

    Args:
        data: one entry a log.
        moving: (n,) of each, where friction is a value: a joint that mostly rests tells nothing of peaks in motion.
        touched: whether contact was found in each log: then such a peak is taken for contact, too. In another log only
            a very large one is; others are counted, and said.
        names: of the logs.
        times_s: (n,) of each.
    """
    counts = [persistence_samples(_PERSISTENCE_S, d.period_s) for d in data]
    at_speed = [replace(d, clean=np.asarray(d.clean & mask)) for d, mask in zip(data, moving, strict=True)]
    peaks = np.concatenate([sustained_peaks(d, n, BLOCK_S) for d, n in zip(at_speed, counts, strict=True)])
    if peaks.size < _FEWEST_BLOCKS:
        return list(data), ()
    usual = float(np.quantile(peaks, _MOST))
    kept, isolated = [], []
    for one, n, contact, name, time_s in zip(data, counts, touched, names, times_s, strict=True):
        size = np.where(one.clean, np.abs(one.residual_nm), 0.0)
        lasting = np.zeros(size.size, dtype=np.bool_)
        for a, b in zip(*run_bounds(size > _ALONE * usual), strict=True):
            lasting[a:b] = b - a >= n
        clean = one.clean.copy()
        for a, b in zip(*run_bounds(widened(lasting, ceil(_MARGIN_S / one.period_s))), strict=True):
            peak = float(size[a:b].max())
            counted = not contact and peak < _PLAIN * usual
            isolated.append(IsolatedPeak(name, float(time_s[a]), float(time_s[b - 1]), peak, usual, counted))
            clean[a:b] &= counted
        kept.append(replace(one, clean=clean))
    if len(isolated) > _SELDOM * peaks.size:  # they come again: no exception, whatever they are
        return list(data), ()
    return kept, tuple(isolated)
