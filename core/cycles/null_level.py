"""The motion's level: what a joint's residual reaches by itself, from the law of its peaks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from collaudit.core.data.recommendation_result import ThresholdLevel
from collaudit.core.numeric.arrays import BoolArray, FloatArray, run_bounds, whole_window_minima
from collaudit.core.numeric.null_tail import ARM_PER_HOUR, ZERO_DOUBT_NM, block_peaks, margin_after, null_tail

#: Level of the stretches at rest or after a reversal: nine of ten of them, and at most so many times three of four.
#: On real logs, without contact, nine of ten reach 1.0 to 1.9 times three of four.
_REST_SHARE, _REST_BULK, _OVER_BULK = 0.9, 0.75, 1.5
#: What lasts counts as at least this share of what half of the peaks of single samples reach: most of its own are zero
#: where a residual swings.
_LASTING = 0.4


@dataclass(frozen=True, slots=True, eq=False)
class NullEvidence:
    """One joint of one log.

    Attributes:
        residual_nm: (n,) residual.
        moving: (n,) samples in motion at which it counts.
        period_s: sample period, s.
    """

    residual_nm: FloatArray
    moving: BoolArray
    period_s: float

    def peaks(self, n: int = 1) -> FloatArray:
        """(b,) of each block mostly in motion the largest level that |residual| keeps for n samples, N·m."""
        size = np.where(self.moving, np.abs(self.residual_nm), 0.0)
        return block_peaks(whole_window_minima(size, n) if n > 1 else size, self.moving, self.period_s)


def motion_levels(
    evidence: Sequence[NullEvidence],
    persistences: Iterable[Sequence[int]],
    joints: int,
    contact_free: bool = False,
) -> list[ThresholdLevel]:
    """The level of one joint at each persistence: ``ARM_PER_HOUR`` over the joints, with its margin.

    Which blocks hold a contact is decided by their single samples. What is sustained for long is next to nothing in
    most of the motion, and where the model errs slowly it is not: by its own bulk, that would pass for contact.

    Args:
        evidence: of one joint, one entry a log.
        persistences: to be answered for, each in samples of each log.
        joints: that share the arm's false alarms.
        contact_free: nothing touched the arm, as its user states: no block alarms.

    Returns:
        None without peaks.
    """
    rate = ARM_PER_HOUR / joints
    highest = np.concatenate([one.peaks() for one in evidence])
    single = null_tail(highest, contact_free)
    if single is None:
        return []
    clean = (highest <= single.ceiling(highest.size)) | contact_free
    margin = margin_after(sum(float(np.count_nonzero(one.moving)) * one.period_s for one in evidence))
    out: list[ThresholdLevel] = []
    for counts in persistences:
        sustained = np.concatenate([one.peaks(n) for one, n in zip(evidence, counts, strict=True)])
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
        false, interval = lasting.rate(level), lasting.interval(level)
        gamma = margin * level + ZERO_DOUBT_NM
        most = float(sustained.max())
        out.append(ThresholdLevel(max(counts), seconds, gamma, false, interval, over, margin, ZERO_DOUBT_NM, most))
    return out


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
