"""How much of the tool's force was commanded: in contact what is usual there, and not a blow that stands out of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import PhasesConfig
from collaudit.core.data import shown
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.runs import closed, run_bounds
from collaudit.core.numeric.stats import quantile_of
from collaudit.core.prepare.phases import CONTACT_FORCE_N

#: A force this many times the level that contact keeps below for 95 % of its time, and this much above it, stands out.
_TIMES, _ABOVE_N = 1.5, 5.0
_SHARE = 0.95
#: So many phases that were found by their force show what is usual; two may be one obstacle that was met twice.
_LEAST_FOUND = 3
#: Shorter than this is an impact of the tool that no rule would see, s.
_IMPACT_S = 0.01
#: Stretches closer than this are one, s.
_TOGETHER_S = 0.2
_LISTED = 20


@dataclass(frozen=True, slots=True)
class ExcessForce:
    """A stretch in which the tool's force exceeded what is taken as commanded.

    Attributes:
        start_s, end_s: seconds from the log's first sample.
        peak_n: its largest force.
        limit_n: what was taken as commanded; 0 where nothing was.
    """

    start_s: float
    end_s: float
    peak_n: float
    limit_n: float


def commanded_share(
    time_s: FloatArray, force_n: FloatArray, contact: BoolArray, config: PhasesConfig, found: bool = False
) -> tuple[FloatArray, tuple[ExcessForce, ...]]:
    """The share of the measured force that is taken as commanded.

    A force above the limit counts as commanded up to it; what exceeds it stays in the residual, where it can alarm.

    Args:
        time_s: (n,) s.
        force_n: (n,) size of the tool's force.
        contact: (n,) samples in which force is commanded; none where phases are not known.
        config: ``force_limit_n``; when absent, 1.5 times the level kept for 95 % of the contact, and 5 N more.
        found: whether ``contact`` is where force was found. A phase is then measured by the others, not by itself.

    Returns:
        (n,) factor of at most 1, and the stretches in which it was less.
    """
    share = np.ones(force_n.size)
    known = contact & np.isfinite(force_n)
    if not known.any() and (found or config.force_limit_n is None):
        return share, ()
    if config.force_limit_n is not None:
        limit = np.full(force_n.size, config.force_limit_n)
    else:
        limit = _found_limit(force_n, contact) if found else _limit(force_n, quantile_of(force_n[known], _SHARE))
    where = known if contact.any() else np.isfinite(force_n)
    above = where & (np.nan_to_num(force_n) > limit)
    share[above] = limit[above] / force_n[above]
    return share, tuple(_stretches(time_s, np.where(above, force_n, 0.0), limit))


def _limit(force_n: FloatArray, level_n: float) -> FloatArray:
    return np.full(force_n.size, _TIMES * level_n + _ABOVE_N)


def _found_limit(force_n: FloatArray, contact: BoolArray) -> FloatArray:
    """(n,) limit from the median level of the other phases, none of too few; 0 in a phase that lies above it.

    Of two levels in the middle the lower counts. It is the same whichever phase above it is left out.
    """
    bounds = list(zip(*run_bounds(contact), strict=True))
    levels = [quantile_of(np.nan_to_num(force_n[a:b]), _SHARE) for a, b in bounds]
    limit = _limit(force_n, sorted(levels)[len(levels) // 2 - 1] if len(levels) >= _LEAST_FOUND else 0.0)
    for (a, b), level in zip(bounds, levels, strict=True):
        if level > limit[a]:
            limit[a:b] = 0.0  # as in free motion, for nothing says that any of it was commanded
    return limit


def _stretches(time_s: FloatArray, excess_n: FloatArray, limit_n: FloatArray) -> list[ExcessForce]:
    period_s = float(time_s[1] - time_s[0])
    out = []
    for a, b in zip(*run_bounds(closed(excess_n > 0.0, round(_TOGETHER_S / period_s))), strict=True):
        first, last = float(time_s[a]), float(time_s[b - 1])
        if last - first >= _IMPACT_S:
            out.append(ExcessForce(first, last, float(excess_n[a:b].max()), float(limit_n[a])))
    return out


def excess_findings(excess: Sequence[ExcessForce], config: PhasesConfig) -> list[Finding]:
    """A fact for each of the first stretches."""
    what = "[phases] force_limit_n" if config.force_limit_n is not None else "the limit of what is usual in its contact"
    out = []
    for one in excess[:_LISTED]:
        judged = (
            f"above {one.limit_n:.3g} N, {what}. Force up to this limit was taken as intended; the rest was judged."
        )
        if not one.limit_n > 0:
            judged = "more than other contact that was found shows to be usual. All of it was judged."
        text = (
            f"The tool's force rose to {one.peak_n:.3g} N between {one.start_s:.4g} and {one.end_s:.4g} s, {judged} "
            "[phases] force_limit_n states what is allowed."
        )
        out.append(fact(text, start_s=one.start_s, end_s=one.end_s))
    return out


def found_finding(time_s: FloatArray, force_n: FloatArray, contact: BoolArray, config: PhasesConfig) -> Finding:
    """What the force alone tells of contact: a tool that collides looks the same.

    Args:
        time_s: (n,) s.
        force_n: (n,) size of the tool's force; NaN where unknown.
        contact: (n,) samples in contact, some of them True.
        config: what they were found with.
    """
    bounds = list(zip(*run_bounds(contact), strict=True))
    spans = shown.first(f"{time_s[a]:.4g} to {time_s[b - 1]:.4g} s" for a, b in bounds)
    top = int(np.argmax(np.where(contact, np.nan_to_num(force_n), 0.0)))
    limit = config.force_limit_n
    usual = f"what is usual in {_LEAST_FOUND} or more phases" if limit is None else f"force up to {limit:g} N"
    text = (
        f"{len(bounds)} contact phase{'' if len(bounds) == 1 else 's'} found where the tool's force exceeds "
        f"{CONTACT_FORCE_N:g} N ({spans}; largest {force_n[top]:.3g} N at {time_s[top]:.4g} s). Nothing else "
        f"says that contact is intended: {usual} is taken as intended there, so a collision of the tool with no more "
        "cannot be seen. State in [phases] of the configuration when contact is intended."
    )
    return Finding("phases-unknown", "warning", text)
