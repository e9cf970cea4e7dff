"""Rows on the thresholds that are set: too tight, too loose or supported, with the figures behind it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from collaudit.core.data.recommendation_result import SetRule
from collaudit.reports.values.numbers import significant
from collaudit.reports.values.words import with_force_unit

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


def set_rule_rows(set_rules: Mapping[str, SetRule], units: Mapping[str, str]) -> Iterator[tuple[str, ...]]:
    """One row a joint, in the order of :data:`SET_RULE_HEAD`.

    Args:
        set_rules: opinions by joint.
        units: by joint, of what its drive exerts.
    """
    for joint, one in set_rules.items():
        unnoticed = one.unnoticed_nm
        yield (
            joint,
            with_force_unit(f"{one.gamma_nm:.3g}", joint, units),
            str(one.n) if one.n else "",
            "" if one.recommended_nm is None else with_force_unit(f"{one.recommended_nm:.3g}", joint, units),
            alarm_rate(one.false_alarms_per_hour),
            alarm_rate(one.false_alarms_per_hour_upper95),
            ""
            if unnoticed is None
            else with_force_unit(f"{significant(unnoticed[0])} to {significant(unnoticed[1])}", joint, units),
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
