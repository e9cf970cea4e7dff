"""Trends over nights: every robot in a line, what changed, and both as JSON values."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.history.robot_trend import RateOfNights, RobotTrend
from collaudit.core.history.series_changes import Change
from collaudit.reports.files.json_files import json_text
from collaudit.reports.sections.section import Section
from collaudit.reports.values.numbers import significant

TREND_SCHEMA = "collaudit/trend/1"
#: What a series is called, and its unit.
QUANTITY_WORDS = {
    "friction": ("Friction", "N·m"),
    "load": ("Load beyond the model", "% of rigid-body torque"),
    "offset": ("Constant torque beyond the model", "N·m"),
    "residual": ("Mean clean residual", "N·m"),
    "margin": ("γ over the largest clean level", ""),
}
CAUSE_WORDS = {
    "wear-like growth": "wear-like growth of friction",
    "friction step": "friction stepped up",
    "friction fell": "friction fell",
    "payload or tool": "payload or tool changed",
    "temperature": "friction follows temperature",
    "common cause": "friction of several joints changed together",
    "residual": "residual changed, cause not known",
}


def robot_section(trends: Sequence[RobotTrend]) -> Section:
    """A line a robot; the notes say what cannot be told, and of whom."""
    rows = tuple(
        (
            trend.robot,
            str(len(trend.nights)),
            str(trend.logs),
            str(trend.verdicts["fail"]),
            str(trend.not_judged),
            f"{significant(trend.contacts.hours)} h",
            rate_text(trend.contacts),
            rate_text(trend.near_misses),
        )
        for trend in trends
    )
    head = ("robot", "nights", "logs", "failed", "not judged", "judged", "contacts [95 %]", "near misses [95 %]")
    undetermined: dict[str, list[str]] = {}
    for trend in trends:
        for words in trend.undetermined:
            undetermined.setdefault(words, []).append(trend.robot)
    notes = tuple(
        f"Not told ({'all robots' if len(robots) == len(trends) else ', '.join(robots)}): {words}"
        for words, robots in undetermined.items()
    )
    return Section("Robots", head, rows, notes)


def change_text(change: Change) -> str:
    """A change in a line: since when, by how much, and when it could be told."""
    name, _ = QUANTITY_WORDS[change.quantity]
    low, high = change.night_ci95
    since = change.night if low == high else f"{change.night} (95 %: {low} to {high})"
    verb = (
        "grows" if change.shape == "drift" and change.grown > 0 else "falls" if change.shape == "drift" else "stepped"
    )
    return f"{name} of {change.joint} {verb} since {since}: {_size(change)}; told on {change.told_night}"


def _size(change: Change) -> str:
    unit = QUANTITY_WORDS[change.quantity][1]
    total = _with_unit(change.grown, change.grown_ci95, 100.0 if change.quantity == "load" else 1.0, unit)
    if change.quantity == "friction" and change.before > 0:
        share = [100.0 * x / change.before for x in (change.grown, *change.grown_ci95)]
        total += f", {share[0]:+.3g} % [{share[1]:+.3g}, {share[2]:+.3g}] of {significant(change.before)} N·m"
    if change.per_night is None or change.per_night_ci95 is None:
        return total
    if change.quantity in ("friction", "load"):
        ends = [100.0 * x for x in (change.per_night, *change.per_night_ci95)]
        return f"{ends[0]:+.3g} % [{ends[1]:+.3g}, {ends[2]:+.3g}] a night, {total} in all"
    return f"{_with_unit(change.per_night, change.per_night_ci95, 1.0, unit)} a night, {total} in all"


def _with_unit(value: float, ci95: tuple[float, float], scale: float, unit: str) -> str:
    short = "% of rigid-body torque" if unit.startswith("%") else unit
    return f"{scale * value:+.3g} {short} [{scale * ci95[0]:+.3g}, {scale * ci95[1]:+.3g}]"


def rate_text(rate: RateOfNights) -> str:
    """A rate with its interval."""
    if rate.per_hour is None or rate.ci95 is None:
        return f"{rate.count} in no judged hours"
    low, high = (significant(x) for x in rate.ci95)
    return f"{rate.count} in {significant(rate.hours)} h: {significant(rate.per_hour)} per hour [{low}, {high}]"


def trend_json(trends: Sequence[RobotTrend]) -> str:
    """All of it as JSON."""
    return json_text({"schema": TREND_SCHEMA, "robots": [_robot(trend) for trend in trends]})


def _robot(trend: RobotTrend) -> dict[str, object]:
    return {
        "robot": trend.robot,
        "nights": trend.nights,
        "logs": trend.logs,
        "verdicts": dict(trend.verdicts),
        "contacts": trend.contacts,
        "near_misses": trend.near_misses,
        "events": [{"cause": one.cause, "text": one.text, "changes": one.changes} for one in trend.events],
        "untold": trend.undetermined,
        "joints": {
            joint: {
                quantity: {
                    "nights": series.nights,
                    "value": series.value.tolist(),
                    "se": series.se.tolist(),
                    "temperature_c": series.temperature_c.tolist(),
                    "left_out": series.left_out,
                }
                for quantity, series in own.items()
            }
            for joint, own in trend.series.items()
        },
    }
