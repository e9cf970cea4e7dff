"""How much of the tool's force was commanded: in contact what is usual there, and not a blow that stands out of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import PhasesConfig
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.runs import run_bounds
from collaudit.core.numeric.stats import quantile_of

#: A force this many times the level that contact keeps below for 95 % of its time, and this much above it, stands out.
_TIMES, _ABOVE_N = 1.5, 5.0
_SHARE = 0.95
#: Shorter than this is an impact of the tool that no rule would see, s.
_LEAST_S = 0.01
#: Stretches closer than this are one, s.
_TOGETHER_S = 0.2
_LISTED = 20


@dataclass(frozen=True, slots=True)
class ExcessForce:
    """A stretch in which the tool's force exceeded what is taken as meant.

    Attributes:
        start_s, end_s: seconds from the log's first sample.
        peak_n: its largest force.
        limit_n: what was taken as commanded.
    """

    start_s: float
    end_s: float
    peak_n: float
    limit_n: float


def commanded_share(
    time_s: FloatArray, force_n: FloatArray, contact: BoolArray, config: PhasesConfig
) -> tuple[FloatArray, tuple[ExcessForce, ...]]:
    """The share of the measured force that is taken as commanded.

    A force above the limit counts as commanded up to it; what exceeds it stays in the residual, where it can alarm.

    Args:
        time_s: (n,) s.
        force_n: (n,) size of the tool's force.
        contact: (n,) samples in which force is commanded; none where phases are not known.
        config: ``force_limit_n``; when absent, 1.5 times the level kept for 95 % of the contact, and 5 N more.

    Returns:
        (n,) factor of at most 1, and the stretches in which it was less.
    """
    share = np.ones(force_n.size)
    known = contact & np.isfinite(force_n)
    limit = config.force_limit_n
    if limit is None:
        if not known.any():
            return share, ()
        limit = _TIMES * quantile_of(force_n[known], _SHARE) + _ABOVE_N
    where = known if contact.any() else np.isfinite(force_n)
    above = where & (np.nan_to_num(force_n) > limit)
    share[above] = limit / force_n[above]
    return share, tuple(_stretches(time_s, np.where(above, force_n, 0.0), limit))


def _stretches(time_s: FloatArray, excess_n: FloatArray, limit: float) -> list[ExcessForce]:
    starts, stops = run_bounds(excess_n > 0.0)
    if starts.size == 0:
        return []
    fresh = np.flatnonzero(np.concatenate(([True], time_s[starts[1:]] - time_s[stops[:-1] - 1] > _TOGETHER_S)))
    out = []
    for group in np.split(np.arange(starts.size), fresh[1:]):
        a, b = int(starts[group[0]]), int(stops[group[-1]])
        first, last = float(time_s[a]), float(time_s[b - 1])
        if last - first >= _LEAST_S:
            out.append(ExcessForce(first, last, float(excess_n[a:b].max()), limit))
    return out


def excess_findings(excess: Sequence[ExcessForce], config: PhasesConfig) -> list[Finding]:
    """A finding for each of the first stretches."""
    usual = config.force_limit_n is None
    what = "the limit of what is usual in its contact" if usual else "[phases] force_limit_n"
    out = []
    for one in excess[:_LISTED]:
        text = (
            f"The tool's force rose to {one.peak_n:.3g} N between {one.start_s:.4g} and {one.end_s:.4g} s, above "
            f"{one.limit_n:.3g} N, {what}. Force up to this limit was taken as intended; the rest was judged."
        )
        out.append(Finding("tool-force-unusual", "warning", text, start_s=one.start_s, end_s=one.end_s))
    return out
