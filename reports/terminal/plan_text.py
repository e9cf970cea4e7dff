"""A plan, and what a fit delivered of it, for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.plan_result import Delivered, PlanFile
from collaudit.reports.terminal.text_table import table, wrapped
from collaudit.reports.values.numbers import duration
from collaudit.reports.values.plan_rows import (
    DELIVERED_HEAD,
    LIMIT_HEAD,
    PREDICTION_HEAD,
    PREDICTION_NOTE,
    SWEEP_HEAD,
    clean_table,
    clean_words,
    delivered_rows,
    limit_rows,
    prediction_rows,
    sweep_rows,
)


def plan_text(plan: PlanFile, width: int | None = None) -> str:
    """The statement, limits, sweeps, exciting trajectory, predictions, clean hours, and what is missing.

    Args:
        plan: the plan.
        width: columns of the terminal; None: any.
    """
    asked = f"{plan.minutes_asked:g} min"
    exciting = "none" if plan.exciting_s is None else (
        f"{plan.exciting_moves} moves, {duration(plan.exciting_s[1] - plan.exciting_s[0])} from "
        f"{plan.exciting_s[0]:.1f} s on")  # fmt: skip
    of_joints = [one for one in plan.predictions if one.joint is not None]
    parts = [
        wrapped(plan.statement, width),
        f"\nMotion: {duration(plan.duration_s)} of at most {asked}\n",
        _part("Limits", LIMIT_HEAD, limit_rows(plan), width),
        _notes("Taken for granted, not stated", plan.assumed, width),
        _notes("Surroundings", (*plan.surroundings, *_shapes(plan)), width),
        _part("Sweeps", SWEEP_HEAD, sweep_rows(plan), width),
        f"\nExciting trajectory: {exciting}\n",
        _part("What it should tell", PREDICTION_HEAD, prediction_rows(of_joints), width),
        f"  and {len(plan.predictions) - len(of_joints)} parameters of the whole arm: plan.html, plan.json\n",
        wrapped(PREDICTION_NOTE, width) + "\n",
        _part("Clean hours", *clean_table(plan), width),
        wrapped(clean_words(plan), width) + "\n",
        _notes("Not planned or not predicted", plan.missing, width),
    ]
    return "".join(parts)


def delivered_text(found: Sequence[Delivered], width: int | None = None) -> str:
    """What the planned motion gave, beside what was predicted."""
    apart = [one for one in found if one.outcome == "not estimated"]
    rest = [one for one in found if one not in apart]
    told = [one for one in rest if one.predicted is not None]
    kept = sum(one.outcome in ("as predicted", "better") for one in told)
    head = f"\nThe plan predicted {len(told)} half widths: {kept} are as predicted or smaller.\n"
    rows = delivered_rows([one for one in rest if one.joint is not None])
    words = f"{len(apart)} more are of a fit that estimates inertials ([fit] estimate); this one takes them as exact."
    more = wrapped(words, width) + "\n" if apart else ""
    return head + table(DELIVERED_HEAD, rows, width=width, fold=True) + more


def _part(title: str, head: tuple[str, ...], rows: list[tuple[str, ...]], width: int | None) -> str:
    return f"\n{title}\n{table(head, rows, width=width, fold=True)}" if rows else f"\n{title}: none\n"


def _notes(title: str, lines: Sequence[str], width: int | None) -> str:
    return (
        "" if not lines else f"\n{title}:\n" + "".join(f"{wrapped(f'  - {line}', width, '    ')}\n" for line in lines)
    )


def _shapes(plan: PlanFile) -> list[str]:
    capsules = ", ".join(f"{joint} {1e3 * radius:.0f} mm" for joint, radius in plan.capsules_m.items())
    out = [f"shapes of the description: {', '.join(plan.shapes)}"] if plan.shapes else []
    if capsules:
        out.append(f"capsules with a radius guessed from the mass, or stated: {capsules}")
    return [*out, f"not kept apart, being neighbours or nearly so: {'; '.join(plan.unchecked)}"]
