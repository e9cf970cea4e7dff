"""Thresholds from what contact-free motion does by itself: scale in any motion, and the law of the peaks over it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
import scipy

from collaudit.core.data.recommendation_result import LastingThreshold, MotionScale, ThresholdLevel
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.detection.rule import persistence_samples
from collaudit.core.detection.rule_settings import LASTING_S
from collaudit.core.detection.threshold import LEAST_SHARE, motion_features, scale_over
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.null_tail import (
    ARM_PER_HOUR,
    BLOCK_S,
    FEWEST_BLOCKS,
    MARGIN,
    NullTail,
    block_peaks,
    null_tail,
)
from collaudit.core.numeric.runs import run_bounds, trailing_means, whole_window_minima
from collaudit.core.numeric.stats import SD_PER_MAD, median_of

#: A residual counts as at most so many times the scale while the scale is found.
_CLIP = 2.5
_ROUNDS = 6
#: Samples that tell a scale as well as all of a long log would: neighbours are alike.
_BULK = 50_000
#: Keeps columns that are zero from making the normal equations singular, as a share of their trace.
_RIDGE = 1e-12
#: Level of the stretches at rest or after a reversal: nine of ten of them, and at most so many times three of four.
#: On real logs, without contact, nine of ten reach 1.0 to 1.9 times three of four.
_REST_SHARE, _REST_BULK, _OVER_BULK = 0.9, 0.75, 1.5
#: What lasts counts as at least this share of what half of the peaks of single samples reach: most of its own are zero
#: where a residual swings.
_LASTING = 0.4
#: On top of what the mean reaches: from one recording of an arm to another, slow errors grow by up to a quarter.
_LASTING_MARGIN = 1.3
#: Share of the samples in which a feature must show to be followed.
_SEEN = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class NullEvidence:
    """One joint of one log.

    Attributes:
        residual_nm: (n,) residual.
        moving: (n,) samples in motion at which it counts.
        features: (n, 5) what the scale may follow (:func:`motion_features`).
        period_s: sample period, s.
    """

    residual_nm: FloatArray
    moving: BoolArray
    features: FloatArray
    period_s: float

    @classmethod
    def of(
        cls, series: UniformSeries, j: int, residual_nm: FloatArray, moving: BoolArray, arm: FloatArray
    ) -> NullEvidence:
        """A column of residuals (n, j) and of the samples (n, j) at which they count; ``arm`` (n,) its speed."""
        features = motion_features(series.velocity_rad_s, j, series.period_s, arm)
        return cls(residual_nm[:, j], moving[:, j], features, series.period_s)


def motion_scale(size_nm: FloatArray, features: FloatArray) -> MotionScale:
    """Scale of a residual as a non-negative combination of features, robust against a minority of contacts.

    Args:
        size_nm: (m,) |residual| in motion.
        features: (m, 5).
    """
    usual = median_of(size_nm)
    features = features * (np.mean(features > 0.0, axis=0) >= _SEEN)  # rare motion tells no scale
    limit, level = np.full(size_nm.size, _CLIP * max(usual, 1e-9)), np.full(size_nm.size, usual)
    weights = np.zeros(features.shape[1])
    for _ in range(_ROUNDS):
        weights = _non_negative_fit(features, np.minimum(size_nm, limit))
        level = features @ weights
        level = np.maximum(level, LEAST_SHARE * max(median_of(level), 1e-9))
        limit = _CLIP * level
    sd = SD_PER_MAD * median_of(size_nm / level)
    base, slow, speed, arm, turn = (float(sd * w) for w in weights)
    return MotionScale(base, slow, speed, arm, turn, sd * median_of(level))


def _non_negative_fit(columns: FloatArray, target: FloatArray) -> FloatArray:
    """(k,) non-negative least-squares fit of columns (n, k) to (n,), of very many rows: by their normal equations."""
    gram = columns.T @ columns
    root = np.linalg.cholesky(gram + _RIDGE * np.trace(gram) * np.eye(len(gram)))  # the same minimum from k rows
    return np.asarray(scipy.optimize.nnls(root.T, np.linalg.solve(root, columns.T @ target))[0])


def sustained_ratios(one: NullEvidence, scale: MotionScale, n: int) -> FloatArray:
    """(b,) of each block mostly in motion the largest ratio to the scale that |residual| keeps for n samples."""
    return _sustained(one, _ratio(one, scale), n)


def _ratio(one: NullEvidence, scale: MotionScale) -> FloatArray:
    """(n,) |residual| over its scale, 0 where it does not count."""
    return np.where(one.moving, np.abs(one.residual_nm) / scale_over(scale, one.features), 0.0)


def _sustained(one: NullEvidence, ratio: FloatArray, n: int) -> FloatArray:
    return block_peaks(whole_window_minima(ratio, n), one.moving, one.period_s)


def scale_of(evidence: Sequence[NullEvidence]) -> MotionScale | None:
    """Scale of one joint over its logs; None without enough motion."""
    rows = [np.flatnonzero(one.moving) for one in evidence]
    seconds = sum(its.size * one.period_s for its, one in zip(rows, evidence, strict=True))
    if seconds < FEWEST_BLOCKS * BLOCK_S:
        return None
    step = max(1, sum(its.size for its in rows) // _BULK)  # the bulk of a long log is known from a part of it
    some = [its[::step] for its in rows]
    size = np.concatenate([np.abs(one.residual_nm[its]) for one, its in zip(evidence, some, strict=True)])
    return motion_scale(size, np.concatenate([one.features[its] for one, its in zip(evidence, some, strict=True)]))


def threshold_levels(
    evidence: Sequence[NullEvidence],
    scale: MotionScale,
    persistences: Iterable[Sequence[int]],
    joints: int,
    contact_free: bool = False,
) -> list[ThresholdLevel]:
    """Best estimates of one joint's threshold: ``ARM_PER_HOUR`` over the joints, with ``MARGIN``; none without peaks.

    Which blocks hold a contact is decided by their single samples. What is sustained for long is next to nothing in
    most of the motion, and where the model errs slowly it is not: by its own bulk, that would pass for contact.

    Args:
        evidence: of one joint, one entry a log.
        scale: of it.
        persistences: to be answered for, each in samples of each log.
        joints: that share the arm's false alarms.
        contact_free: nothing touched the arm, as its user states: no block alarms.
    """
    ratios = [_ratio(one, scale) for one in evidence]

    def peaks(counts: Sequence[int]) -> FloatArray:
        return np.concatenate([_sustained(*each) for each in zip(evidence, ratios, counts, strict=True)])

    rate = ARM_PER_HOUR / joints
    out: list[ThresholdLevel] = []
    highest = [block_peaks(ratio, one.moving, one.period_s) for one, ratio in zip(evidence, ratios, strict=True)]
    single, clean = _clean_blocks(np.concatenate(highest), contact_free)
    if single is None:
        return []
    for counts in persistences:
        sustained = peaks(counts)
        lasting = null_tail(sustained[clean], contact_free=True)
        if lasting is None:
            continue
        # persistence strips noise, which is the bulk, and not the model's own errors: half of its gain is counted
        level = sqrt(single.level(rate) * max(lasting.level(rate), _LASTING * sqrt(single.start)))
        if contact_free:
            level = max(level, float(sustained.max()))  # what was seen without contact raises no alarm
        passed = float(np.mean(sustained[clean] > level)) > rate / lasting.per_hour
        if out and passed:
            continue  # the bulk has no law of what lasts so long: the level of a shorter persistence serves
        seconds = max(n * one.period_s for n, one in zip(counts, evidence, strict=True))
        over = float(np.mean(sustained > level))
        gamma = MARGIN * level * scale.usual_nm
        out.append(ThresholdLevel(max(counts), seconds, gamma, lasting.rate(level), lasting.interval(level), over))
    return out


def _clean_blocks(highest: FloatArray, contact_free: bool) -> tuple[NullTail | None, BoolArray]:
    """The law of the highest single samples (b,) of the blocks, and the blocks (b,) that hold no contact by it."""
    single = null_tail(highest, contact_free)
    ceiling = 0.0 if single is None else single.ceiling(highest.size)
    return single, (highest <= ceiling) | contact_free


def lasting_threshold(
    evidence: Sequence[NullEvidence], scale: MotionScale, joints: int, contact_free: bool = False
) -> LastingThreshold | None:
    """Best estimate of the level that the mean over ``LASTING_S`` passes as seldom as gamma; None without peaks.

    Noise is all but gone from the mean, and what the model errs by is left. So the mean has a scale of its own, and a
    margin of its own: such errors differ more from one log to the next than noise does.

    Args:
        evidence, scale, joints, contact_free: as of :func:`threshold_levels`.
    """
    counts = [persistence_samples(LASTING_S, one.period_s) for one in evidence]
    means = [_averaged(one, n) for one, n in zip(evidence, counts, strict=True)]
    own = scale_of(means)
    if own is None:
        return None
    _, clean = _clean_blocks(_peaks(evidence, evidence, scale), contact_free)
    peaks = _peaks(means, evidence, own)
    tail = null_tail(peaks[clean], contact_free=True)
    if tail is None:
        return None
    level = tail.level(ARM_PER_HOUR / joints)
    if contact_free:
        level = max(level, float(peaks.max()))
    seconds = max(n * one.period_s for n, one in zip(counts, evidence, strict=True))
    gamma, over = _LASTING_MARGIN * level * own.usual_nm, float(np.mean(peaks > level))
    found = ThresholdLevel(max(counts), seconds, gamma, tail.rate(level), tail.interval(level), over)
    return LastingThreshold(found, own)


def _averaged(one: NullEvidence, n: int) -> NullEvidence:
    """The mean of n samples up to each, where all of them count."""
    mean = trailing_means(one.residual_nm, one.moving, n)
    return NullEvidence(mean, np.isfinite(mean), one.features, one.period_s)


def _peaks(evidence: Sequence[NullEvidence], blocks_of: Sequence[NullEvidence], scale: MotionScale) -> FloatArray:
    """(b,) the largest ratio to the scale in each block of which most samples of ``blocks_of`` count."""
    pairs = zip(evidence, blocks_of, strict=True)
    return np.concatenate([block_peaks(_ratio(one, scale), of.moving, one.period_s) for one, of in pairs])


def rest_level(residual_nm: Sequence[FloatArray], loose: Sequence[BoolArray], most_nm: float = np.inf) -> float:
    """What nine of ten stretches stay below in which friction is an interval, N·m; 0 without any.

    How hard a joint breaks away differs from one standstill to the next, and is seldom seen: most of such samples are
    zero. So each stretch is one value, its largest residual. A tail far above the bulk is contact, at more than one
    standstill in ten; and where the bulk is contact too, it counts as at most what the joint itself can do.

    Args:
        residual_nm: (n,) of one joint, one entry a log.
        loose: (n,) samples at which the rule can fire and friction is an interval.
        most_nm: what friction and errors of the model can do without contact.
    """
    peaks = []
    for x, mask in zip(residual_nm, loose, strict=True):
        starts, _ = run_bounds(mask)
        if starts.size:
            size = np.where(mask, np.abs(np.nan_to_num(x)), 0.0)
            peaks.append(np.maximum.reduceat(size, starts))
    every = np.concatenate(peaks) if peaks else np.empty(0)
    if not every.size:
        return 0.0
    bulk, most = np.quantile(every, [_REST_BULK, _REST_SHARE], method="lower")
    return float(min(most, _OVER_BULK * bulk, most_nm))
