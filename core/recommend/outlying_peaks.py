"""Peaks that do not belong to the rest: what may be unknown contact.

The peaks of a clean residual thin out upwards at least as fast as an exponential tail, whose normalised spacings
i (x_(i) - x_(i+1)), i counted from the largest, all have the same mean (Renyi 1953). Peaks of contacts lie further out:
the sum of the highest spacings is then too large beside those below, by an F-test. No peak in the highest tenth is used
to tell what is usual, so that up to a tenth of the peaks may be contacts.

A contact loads several joints at once, errors of friction and ripple one at a time. So the joints are tested together,
too: the sum over joints of the squares of their peaks in the same second, each over its usual.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import fdtrc as fisher_tail

from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.stats import median_of, quantile_of
from collaudit.core.recommend.arm_evidence import MARGIN_S, ArmEvidence, LeftOutStretch, LogEvidence, joined
from collaudit.core.recommend.evidence_range import acceleration
from collaudit.core.recommend.sustained_levels import BLOCK_S, SustainedPeaks

#: Chance that any peak of a clean joint is called an outlier.
_CHANCE = 1e-3
#: Share of the peaks that may be outliers; the usual is told from those below, down to three times as many.
_SUSPECT, _USUAL = 0.1, 0.3
_FEWEST = 60
#: How many times wider than usual their spacings are at least: motions of several kinds mix to a tail that is a little
#: heavier than exponential, which hours of data would tell from one.
_FURTHER = 3.0
#: Peaks are compared with others at like speed and acceleration: so many classes of each.
_CLASSES = (4, 3)
_FEWEST_IN_CLASS = 20
#: Joints that are tested together, at least; those are named that have this share of the highest ratio.
_FEWEST_JOINTS, _SHARES = 2, 0.5


def outlying_stretches(evidence: ArmEvidence, persistence_s: float) -> tuple[LeftOutStretch, ...]:
    """Stretches of clean time in which a joint's residual rose far beyond its usual peaks at like motion.

    Args:
        evidence: of the arm, events left out.
        persistence_s: of the rule.

    Returns:
        The stretches with their margin, log by log and in time order.
    """
    found: dict[int, list[LeftOutStretch]] = {}
    together: dict[tuple[int, int], dict[str, float]] = {}

    for joint, peaks in by_name(lambda joint: evidence.peaks(joint, persistence_s), evidence.joints).items():
        logs = [k for k, log in enumerate(evidence.logs) if joint in log.watched]
        if peaks.level_nm.size < _FEWEST:
            continue
        usual = _usual_nm(peaks, [evidence.logs[k] for k in logs], joint)
        ratio = peaks.level_nm / usual
        for i in _outliers(ratio):
            k = logs[int(peaks.log[i])]
            found.setdefault(k, []).append(_around(evidence.logs[k], float(peaks.time_s[i]), (joint,)))
        for own, second, size in zip(peaks.log, (peaks.time_s / BLOCK_S).astype(np.int64), ratio, strict=True):
            together.setdefault((logs[int(own)], int(second)), {})[joint] = float(size)
    for (k, second), joints in _together(together):
        found.setdefault(k, []).append(_around(evidence.logs[k], (second + 0.5) * BLOCK_S, joints, 0.5 * BLOCK_S))
    return tuple(stretch for k in sorted(found) for stretch in joined(found[k]))


def _around(log: LogEvidence, at_s: float, joints: tuple[str, ...], half_s: float = 0.0) -> LeftOutStretch:
    return LeftOutStretch(log.name, at_s - half_s - MARGIN_S, at_s + half_s + MARGIN_S, "suspicious", joints)


def _together(
    seconds: Mapping[tuple[int, int], Mapping[str, float]],
) -> list[tuple[tuple[int, int], tuple[str, ...]]]:
    """Seconds in which the joints together lie too far out, with the joints that are highest in them.

    Args:
        seconds: by log and second the peaks of the joints over their usual.
    """
    places = sorted(seconds, key=lambda place: place[0])
    count = max((len(ratios) for ratios in seconds.values()), default=0)
    if count < _FEWEST_JOINTS or len(places) < _FEWEST:
        return []
    # A joint whose peak was merged into the next second counts as usual.
    size = np.array([sum(x * x for x in seconds[at].values()) + count - len(seconds[at]) for at in places])
    out = []
    for at in (places[int(i)] for i in _outliers(size)):
        most = _SHARES * max(seconds[at].values())
        out.append((at, tuple(joint for joint, x in seconds[at].items() if x > most)))
    return out


def without_outliers(evidence: ArmEvidence, stretches: Sequence[LeftOutStretch]) -> ArmEvidence:
    """The evidence without suspicious stretches, in logs of which nobody said what was contact."""
    if not stretches:
        return evidence
    logs = tuple(
        log if log.contact_known else log.without([s for s in stretches if s.log == log.name]) for log in evidence.logs
    )
    return ArmEvidence(logs, evidence.joints)


def unsuspicious(evidence: ArmEvidence, persistence_s: float) -> ArmEvidence:
    """The evidence without what is suspicious in it; arguments as of :func:`outlying_stretches`."""
    return without_outliers(evidence, outlying_stretches(evidence, persistence_s))


def _usual_nm(peaks: SustainedPeaks, logs: Sequence[LogEvidence], joint: str) -> FloatArray:
    """(b,) the median peak at speeds and accelerations like those of each peak; of all where there are few like it."""
    speed, turn = np.empty(peaks.level_nm.size), np.empty(peaks.level_nm.size)
    for k, log in enumerate(logs):
        own = peaks.log == k
        velocity = log.signals.velocity_rad_s[:, log.signals.joint_names.index(joint)]
        at = np.round(peaks.time_s[own] / log.period_s).astype(np.int64).clip(0, velocity.size - 1)
        speed[own], turn[own] = np.abs(velocity[at]), acceleration(velocity, log.period_s)[at]
    like = _CLASSES[1] * _class(speed, _CLASSES[0]) + _class(turn, _CLASSES[1])
    usual = np.full(peaks.level_nm.size, max(median_of(peaks.level_nm), 1e-12))
    for label in np.unique(like):
        same = like == label
        if np.count_nonzero(same) >= _FEWEST_IN_CLASS:
            usual[same] = max(median_of(peaks.level_nm[same]), 1e-12)
    return usual


def _class(values: FloatArray, count: int) -> IntArray:
    known = np.nan_to_num(values)
    edges = [quantile_of(known, share) for share in np.linspace(0.0, 1.0, count + 1)[1:-1].tolist()]
    return np.searchsorted(edges, known, side="right").astype(np.int64)


def _outliers(ratio: FloatArray) -> IntArray:
    """Indices of the peaks that lie too far out; none where the highest are as the law has it."""
    order = np.argsort(ratio)[::-1]
    top, below = max(5, int(_SUSPECT * ratio.size)), int(_USUAL * ratio.size)
    ranked = ratio[order[: below + 1]]
    spacing = np.arange(1, below + 1) * (ranked[:-1] - ranked[1:])
    usual = float(np.mean(spacing[top:]))
    if usual <= 0:
        return np.empty(0, np.int64)
    count = np.arange(1, top + 1)
    further = np.cumsum(spacing[:top]) / count / usual
    chance = np.where(further > _FURTHER, fisher_tail(2.0 * count, 2.0 * (below - top), further), 1.0)
    if chance.min() >= _CHANCE / top:
        return np.empty(0, np.int64)
    return order[: int(np.argmin(chance)) + 1]
