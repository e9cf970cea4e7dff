"""A plan as rows of text: sweeps, what they should tell, clean hours; for page, terminal and table alike."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.plan_result import CleanTime, Delivered, PlanFile, Prediction
from collaudit.reports.values.numbers import duration, significant, stated

Rows = list[tuple[str, ...]]

#: Up to so many hours it is worth a thought to repeat the exciting trajectory for them.
_REPEATED_H = 8.0
SWEEP_HEAD = ("joint", "window, rad", "speeds, rad/s, each both ways", "begins", "takes")
PREDICTION_HEAD = ("joint", "parameter", "value", "half width before", "predicted after")
#: Beside the predictions.
PREDICTION_NOTE = (
    "Half widths of 95 % intervals, predicted from the scatter of earlier logs. “Open”: no interval so far. Guessed: "
    "of a joint whose law is open; the half widths go with what its law turns out to be. A and B in N·m, C in s/rad, "
    "D in N·m·s/rad, rotor inertia in kg·m² (of prismatic joints: N, s/m, N·s/m, kg)."
)
CLEAN_HEAD = ("joint", "clean time", "γ now, N·m", "γ with the plan, N·m", "clean hours for γ")
DELIVERED_HEAD = ("joint", "parameter", "predicted half width", "delivered", "outcome")
LIMIT_HEAD = ("joint", "range, rad", "start", "speed, rad/s", "acceleration, rad/s²", "jerk, rad/s³", "torque, N·m")


def sweep_rows(plan: PlanFile) -> Rows:
    """One line a joint."""
    return [
        (
            one.joint,
            f"{one.low_rad:.2f} to {one.high_rad:.2f}",
            " ".join(significant(speed) for speed in one.speeds_rad_s),
            f"{one.start_s:.1f} s",
            f"{one.end_s - one.start_s:.1f} s",
        )
        for one in plan.sweeps
    ]


def prediction_rows(predictions: Sequence[Prediction]) -> Rows:
    """One line a parameter."""
    return [
        (
            one.joint or "arm",
            one.parameter,
            "" if one.value is None else significant(one.value) + (" (guessed)" if one.guessed else ""),
            "open" if one.before is None else _half(one.before, one.value),
            "not predicted" if one.after is None else _half(one.after, one.value),
        )
        for one in predictions
    ]


def _half(half: float, value: float | None) -> str:
    """A half width, and what share of the value it is."""
    return f"±{significant(half)}" + (f" ({100.0 * half / abs(value):.2g} %)" if value else "")


def clean_table(plan: PlanFile) -> tuple[tuple[str, ...], Rows]:
    """Head, and one line a joint; thresholds where a run says them."""
    columns = len(CLEAN_HEAD) if any(one.gamma_nm is not None for one in plan.clean.values()) else 2
    rows = [(joint, duration(3600.0 * one.hours), *_gammas(one, plan)) for joint, one in plan.clean.items()]
    return CLEAN_HEAD[:columns], [row[:columns] for row in rows]


def _gammas(one: CleanTime, plan: PlanFile) -> tuple[str, str, str]:
    none = "no run says"
    if one.hours_for_gamma is not None:
        asked = duration(3600.0 * one.hours_for_gamma)
    else:
        asked = (
            none if one.gamma_nm is None else "no number of hours" if plan.gamma_asked_nm is not None else "none asked"
        )
    now, after = (none if gamma is None else significant(gamma) for gamma in (one.gamma_nm, one.gamma_after_nm))
    return now, after, asked


def clean_words(plan: PlanFile) -> str:
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
    runs = "" if len(clean_table(plan)[0]) > 2 else " Runs (RUN/ of an audit) among the inputs would say thresholds."
    return (
        f"Thresholds for {stated(plan.per_hour)} false alarms of the whole arm an hour need "
        f"{duration(3600.0 * enough)} of motion without contact, of the kind that is to be judged later; "
        f"{need}.{repeated}{runs}"
    )


def limit_rows(plan: PlanFile) -> Rows:
    """One line a joint."""
    return [
        (
            joint,
            f"{one.low_rad:.3f} to {one.high_rad:.3f}",
            f"{one.start_rad:.3f}",
            *(significant(x) for x in (one.speed_rad_s, one.acceleration_rad_s2, one.jerk_rad_s3, one.torque_nm)),
        )
        for joint, one in plan.limits.items()
    ]


def delivered_rows(found: Sequence[Delivered]) -> Rows:
    """One line a parameter."""
    return [
        (
            one.joint or "arm",
            one.parameter,
            "none" if one.predicted is None else f"±{significant(one.predicted)}",
            "open" if one.delivered is None else f"±{significant(one.delivered)}",
            one.outcome,
        )
        for one in found
    ]
