"""A plan: sweeps, what they should tell, clean hours, limits; and what a later fit delivered of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf

from collaudit.core.data.plan_result import CleanTime, Delivered, JointSweep, PlanFile, Prediction
from collaudit.reports.sections.section import Section, section_of
from collaudit.reports.values.numbers import duration, significant, stated

#: Up to so many hours it is worth a thought to repeat the exciting trajectory for them.
_REPEATED_H = 8.0
_NONE = "none"
_ARM = "What it should tell of inertial parameters of the whole arm, where a fit estimates them"
_PREDICTION_NOTE = (
    "Half widths of 95 % intervals, predicted from the scatter of earlier logs. “Open”: no interval so far. Guessed: "
    "of a joint whose law is open; the half widths go with what its law turns out to be. A and B in N·m, C in s/rad, "
    "D in N·m·s/rad, rotor inertia in kg·m² (of prismatic joints: N, s/m, N·s/m, kg)."
)


def plan_sections(plan: PlanFile, of_joints_only: bool = False) -> tuple[Section, ...]:
    """Sweeps, predictions, clean hours, limits, and in words what was taken for granted.

    Args:
        plan: the plan.
        of_joints_only: without the parameters of the whole arm, which are many.
    """
    of_arm = [one for one in plan.predictions if one.joint is None]
    assumed: dict[str, Sequence[str]] = {
        "Taken for granted, not stated": plan.assumed,
        "Surroundings": plan.surroundings,
        "Links with a shape of the description": plan.shapes,
        "Links as capsules, with a radius guessed from the mass, or stated": [
            f"{joint}: radius {1e3 * radius:.0f} mm" for joint, radius in plan.capsules_m.items()
        ],
        "Not kept apart, being neighbours or nearly so": plan.unchecked,
        "Not planned or not predicted": plan.missing,
    }
    return (
        _sweeps(plan),
        _predictions("What it should tell", [one for one in plan.predictions if one.joint is not None]),
        *([] if of_joints_only or not of_arm else [_predictions(_ARM, of_arm, folded=True)]),
        _clean(plan),
        _limits(plan),
        *(Section(title, (), (), tuple(lines)) for title, lines in assumed.items() if lines),
    )


def brief_section(plan: PlanFile) -> Section:
    """A row a joint: its sweeps, and the parameter that is known least, now and with the plan; then clean hours."""
    return replace(section_of("Sweeps", (_brief(one, plan) for one in plan.sweeps)), notes=(_clean_words(plan),))


def _brief(one: JointSweep, plan: PlanFile) -> dict[str, str]:
    own = [p for p in plan.predictions if p.joint == one.joint and p.value and p.after is not None]
    least = max(own, key=lambda p: inf if p.before is None else p.before / abs(p.value or 1.0), default=None)
    now, after = ("", "") if least is None else (_share(half, least.value) for half in (least.before, least.after))
    return {
        "joint": one.joint,
        "window, rad": f"{one.low_rad:.2f} to {one.high_rad:.2f}",
        "speeds, rad/s": f"{len(one.speeds_rad_s)}, {significant(min(one.speeds_rad_s))} to "
        f"{significant(max(one.speeds_rad_s))}",
        "known least": "" if least is None else least.parameter,
        "now": now,
        "with the plan": after,
    }


def _share(half: float | None, value: float | None) -> str:
    """Half width of the 95 % interval as a share of the value."""
    return "open" if half is None or not value else f"±{100.0 * half / abs(value):.2g} %"


def _or_none(found: Section) -> Section:
    return found if found.rows else replace(found, notes=(_NONE,))


def _sweeps(plan: PlanFile) -> Section:
    records = (
        {
            "joint": one.joint,
            "window, rad": f"{one.low_rad:.2f} to {one.high_rad:.2f}",
            "speeds, rad/s, each both ways": " ".join(significant(speed) for speed in one.speeds_rad_s),
            "begins": f"{one.start_s:.1f} s",
            "takes": f"{one.end_s - one.start_s:.1f} s",
        }
        for one in plan.sweeps
    )
    together = "All joints at once along a line and back, each at speeds of its own."
    return _or_none(section_of("Sweeps", records, together))


def _predictions(title: str, predictions: Sequence[Prediction], folded: bool = False) -> Section:
    records = (
        {
            "joint": one.joint or "arm",
            "parameter": one.parameter,
            "value": "" if one.value is None else significant(one.value) + (" (guessed)" if one.guessed else ""),
            "half width before": _half_width(one.before, "open", one.value),
            "predicted after": _half_width(one.after, "not predicted", one.value),
        }
        for one in predictions
    )
    return _or_none(section_of(title, records, _PREDICTION_NOTE, folded=folded))


def _half_width(half: float | None, without: str, value: float | None = None) -> str:
    """A half width, and what share of the value it is."""
    if half is None:
        return without
    return f"±{significant(half)}" + (f" ({100.0 * half / abs(value):.2g} %)" if value else "")


def _clean(plan: PlanFile) -> Section:
    known = any(one.gamma_nm is not None for one in plan.clean.values())
    records = (
        {"joint": joint, "clean time": duration(3600.0 * one.hours), **(_gammas(one, plan) if known else {})}
        for joint, one in plan.clean.items()
    )
    return replace(section_of("Clean hours", records), notes=(_clean_words(plan),))


def _gammas(one: CleanTime, plan: PlanFile) -> dict[str, str]:
    none = "no run says"
    if one.hours_for_gamma is not None:
        asked = duration(3600.0 * one.hours_for_gamma)
    else:
        open_end = "no number of hours" if plan.gamma_asked_nm is not None else "none asked"
        asked = none if one.gamma_nm is None else open_end
    both = {"γ now": one.gamma_nm, "γ with the plan": one.gamma_after_nm}
    shown = {name: none if gamma is None else f"{significant(gamma)} N·m" for name, gamma in both.items()}
    return {**shown, "clean hours for γ": asked}


def _clean_words(plan: PlanFile) -> str:
    """How much clean motion the rate needs, and which."""
    enough = max((one.hours_for_rate for one in plan.clean.values()), default=0.0)
    least = min((one.hours for one in plan.clean.values()), default=0.0)
    more = max(0.0, enough - least)
    need = "these are there" if more == 0.0 else f"{duration(3600.0 * more)} more are needed"
    repeated = ""
    if 0.0 < more <= _REPEATED_H and plan.exciting_s is not None:
        turn = plan.exciting_s[1] - plan.exciting_s[0]
        repeated = (
            f" The exciting trajectory takes {duration(turn)}: {3600.0 * more / turn:.0f} times would be as long."
        )
    known = any(one.gamma_nm is not None for one in plan.clean.values())
    runs = "" if known else " Runs (RUN/ of an audit) among the inputs would say thresholds."
    return (
        f"Thresholds for {stated(plan.per_hour)} false alarms of the whole arm an hour need "
        f"{duration(3600.0 * enough)} of motion without contact, of the kind that is to be judged later; "
        f"{need}.{repeated}{runs}"
    )


def _limits(plan: PlanFile) -> Section:
    records = (
        {
            "joint": joint,
            "range, rad": f"{one.low_rad:.3f} to {one.high_rad:.3f}",
            "start": f"{one.start_rad:.3f}",
            "speed, rad/s": significant(one.speed_rad_s),
            "acceleration, rad/s²": significant(one.acceleration_rad_s2),
            "jerk, rad/s³": significant(one.jerk_rad_s3),
            "torque, N·m": significant(one.torque_nm),
        }
        for joint, one in plan.limits.items()
    )
    return section_of("Limits", records, "Hard: no part of the motion passes one.")


def delivered_section(found: Sequence[Delivered]) -> Section:
    """What the planned motion gave of each joint, beside what was predicted."""
    estimated = [one for one in found if one.outcome != "not estimated"]
    predicted = [one for one in estimated if one.predicted is not None]
    kept = sum(one.outcome in ("as predicted", "better") for one in predicted)
    records = (
        {
            "joint": one.joint,
            "parameter": one.parameter,
            "predicted half width": _half_width(one.predicted, _NONE),
            "delivered": _half_width(one.delivered, "open"),
            "outcome": one.outcome,
        }
        for one in estimated
        if one.joint is not None
    )
    left = len(found) - len(estimated)
    words = f"{left} more are of a fit that estimates inertials ([fit] estimate); this one takes them as exact."
    title = f"The plan predicted {len(predicted)} half widths: {kept} are as predicted or smaller."
    return replace(section_of(title, records), notes=(words,) if left else ())
