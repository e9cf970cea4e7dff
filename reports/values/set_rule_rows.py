"""Rows on the thresholds that are set: too tight, too loose or supported, with the figures behind it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from collaudit.core.data.recommendation_result import SetRule
from collaudit.reports.values.numbers import significant

SET_RULE_HEAD = (
    "joint",
    "set N·m",
    "n",
    "asked for N·m",
    "false alarms expected",
    "at most (95 %)",
    "goes unnoticed N·m",
    "verdict",
)


def set_rule_rows(set_rules: Mapping[str, SetRule]) -> Iterator[tuple[str, ...]]:
    """One row a joint, in the order of :data:`SET_RULE_HEAD`."""
    for joint, one in set_rules.items():
        unnoticed = one.unnoticed_nm
        yield (
            joint,
            f"{one.gamma_nm:.3g}",
            str(one.n) if one.n else "",
            "" if one.recommended_nm is None else f"{one.recommended_nm:.3g}",
            alarm_rate(one.false_alarms_per_hour),
            alarm_rate(one.false_alarms_per_hour_upper95),
            "" if unnoticed is None else f"{significant(unnoticed[0])} to {significant(unnoticed[1])}",
            one.opinion,
        )


def alarm_rate(per_hour: float | None) -> str:
    """A rate of false alarms: per hour, or per 1,000 h where it is rare."""
    if per_hour is None:
        return ""
    if per_hour >= 0.1:
        return f"{per_hour:.2g} /h"
    per_thousand = 1e3 * per_hour
    return "< 0.01 /1,000 h" if per_thousand < 0.01 else f"{per_thousand:.2g} /1,000 h"
