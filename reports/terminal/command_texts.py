"""What nights, fits, plans, forces beside limits and the checks of an installation say on a terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from collaudit.core.data.audit_result import AuditResult, FrictionFile, Verdict
from collaudit.core.data.plan_result import PlanFile
from collaudit.core.history.retention import KeptRun
from collaudit.reports.sections.body_region_sections import (
    CANNOT_BE_CONCLUDED,
    BodyLimits,
    body_region_section,
)
from collaudit.reports.sections.fit_sections import fit_sections
from collaudit.reports.sections.plan_sections import brief_section, plan_sections
from collaudit.reports.sections.section import Section, section_of
from collaudit.reports.terminal.text_table import section_text, sections_text, table
from collaudit.reports.values.entries import IndexEntry, brief_reason, verdict_counts, worst_first
from collaudit.reports.values.numbers import duration
from collaudit.reports.values.visible_text import visible, wrapped
from collaudit.reports.values.words import NONE, VERDICT_WORD, plural


def plan_text(plan: PlanFile, width: int | None = None, brief: bool = False) -> str:
    """The statement, how long the motion takes, and every section; in brief a row a joint and what is assumed.

    Args:
        plan: the plan.
        width: columns of the terminal; None: any.
        brief: for a screen.
    """
    exciting = "" if plan.exciting_s is None else (
        f", with {plan.exciting_moves} exciting moves from {plan.exciting_s[0]:.1f} s on "
        f"({duration(plan.exciting_s[1] - plan.exciting_s[0])})")  # fmt: skip
    head = (
        f"{wrapped(plan.statement, width)}\n\nMotion: {duration(plan.duration_s)} of at most "
        f"{plan.minutes_asked:g} min{exciting}\n"
    )
    if not brief:
        of_arm = sum(one.joint is None for one in plan.predictions)
        more = f"{of_arm} parameters of the whole arm besides: plan.html, plan.json\n"
        return f"{head}{sections_text(plan_sections(plan, of_joints_only=True), width)}\n{more}"
    taken = [text.replace(", ".join(plan.limits), "every joint") for text in plan.assumed]
    said = f"Taken for granted: {'; '.join(taken)}."
    more = "All half widths, limits and surroundings: plan.txt, plan.html.\n"
    return f"{head}\n{section_text(brief_section(plan), width)}\n{wrapped(said, width)}\n{more}"


def fit_text(friction: FrictionFile, width: int | None = None, detail: bool = False) -> str:
    """The joints with what to do, what was left out, and in detail all that was identified.

    Args:
        friction: the fit.
        width: columns of the terminal that tables are cut to; None: any.
        detail: as of :func:`~collaudit.reports.sections.fit_sections.fit_sections`.
    """
    joints, *others = fit_sections(friction, detail)
    return section_text(joints, width, text_below=True) + sections_text(others, width)


def checks_text(checks: Sequence[tuple[bool, str, str, str, str]], width: int | None = None) -> str:
    """One line a check, then how many passed.

    Args:
        checks: of each, whether it passed, the robot, what was checked, what was wanted, what was found.
        width: columns of the terminal that the table is cut to; None: any.
    """
    lines = [("ok" if passed else "WRONG", *cells) for passed, *cells in checks]
    passed = sum(check[0] for check in checks)
    head = ("", "robot", "check", "wanted", "found")
    return table(head, lines, width=width) + f"\n{passed} of {len(checks)} checks passed\n"


def body_region_text(results: Sequence[AuditResult], limits: BodyLimits, width: int | None = None) -> str:
    """A table of each log with contacts, then what cannot be concluded.

    Args:
        results: of the runs.
        limits: as the user's file states them.
        width: columns of the terminal that tables are cut to; None: any.
    """
    head = wrapped(f"Limits by body region, as stated by: {visible(limits.source)}", width)
    found = sections_text((body_region_section(result, limits) for result in results), width)
    return f"{head}\n{found}\n{wrapped(CANNOT_BE_CONCLUDED, width)}\n"


#: Characters of the one reason beside a log among many.
_REASON = 120


def summary_table(entries: Sequence[IndexEntry], width: int | None = None, most: int | None = None) -> str:
    """One line per log, worst first, then the counts.

    Args:
        entries: one per log.
        width: columns of the terminal that the table is cut to; None: any.
        most: lines at most, each with its first reason and how many follow; None: any, with every reason.

    Returns:
        Text that ends in a line feed.
    """
    head = ("verdict", "log", "would have noticed", "contacts", "near misses", "reasons")
    listed = worst_first(entries)[:most]
    lines = [
        (
            entry.word,
            entry.name,
            entry.noticed or NONE,
            entry.counted(entry.contacts),
            entry.counted(entry.near_misses),
            _reasons(entry, brief=most is not None),
        )
        for entry in listed
    ]
    left = len(entries) - len(listed)
    more = f"… and {plural(left, 'more log')}; -v lists all\n" if left else ""
    return table(head, lines, (2, 3, 4), width, text_below=True) + more + "\n" + total_text(entries)


def _reasons(entry: IndexEntry, brief: bool) -> str:
    """Why, then what the verdict leaves out; in brief the first of it, which a line of a file can hold."""
    every = (*entry.reasons, *entry.exclusions)
    if not brief or not every:
        return "; ".join(every)
    first = brief_reason(entry, _REASON)
    return f"{first} (and {len(every) - 1} more)" if len(every) > 1 else first


def prune_text(runs: Sequence[KeptRun], gone: Sequence[KeptRun], width: int | None = None) -> str:
    """What goes and what stays, by verdict, and why runs stay that are needed.

    Args:
        runs: all that are stored.
        gone: those that go.
        width: columns of the terminal that the table is cut to; None: any.
    """
    going = {id(run) for run in gone}
    kept = [run for run in runs if id(run) not in going]
    lines = [(VERDICT_WORD[verdict], *_counted(gone, verdict), *_counted(kept, verdict)) for verdict in VERDICT_WORD]
    needed = Counter(run.needed for run in kept if run.needed)
    text = table(("verdict", "go", "MB", "stay", "MB"), lines, (1, 2, 3, 4), width)
    if gone:
        text += f"\nThe runs that go are from {gone[0].night} to {gone[-1].night}.\n"
    return text + "".join(f"{plural(count, 'run')}: stays, {visible(why)}\n" for why, count in sorted(needed.items()))


def _counted(runs: Sequence[KeptRun], verdict: Verdict) -> tuple[str, str]:
    """How many have the verdict, and their MB."""
    own = [run for run in runs if run.verdict == verdict]
    return str(len(own)), f"{sum(run.size for run in own) / 1e6:.1f}"


def total_text(entries: Sequence[IndexEntry]) -> str:
    """How many logs have which verdict, in one line."""
    counts = verdict_counts(entries)
    total = ", ".join(f"{counts[verdict]} {word.lower()}" for verdict, word in VERDICT_WORD.items())
    return f"{plural(len(entries), 'log')}: {total}\n"


@dataclass(frozen=True, slots=True)
class TruthRow:
    """A friction parameter against its truth.

    Attributes:
        joint, parameter: whose it is; its unit is in the parameter's name.
        true: value of the simulation.
        found: fitted value, None where it could not be identified.
        ci95: 95 % interval; a side that is open is None. Empty when there is none.
        inside: whether the truth lies in it, None when that cannot be said.
    """

    joint: str
    parameter: str
    true: float
    found: float | None
    ci95: tuple[float | None, ...]
    inside: bool | None


@dataclass(frozen=True, slots=True)
class PushRow:
    """A push of the simulated person against what was found.

    Attributes:
        run: name of the run.
        link: link pushed, counted from 1.
        onset_s: when.
        joint: joint that raised the alarm, None when it was missed.
        delay_s: from the residual above gamma to the alarm.
        delay_from_truth_s: from the true external torque above gamma to the alarm.
        peak_nm: of the residual.
    """

    run: str
    link: int
    onset_s: float
    joint: str | None
    delay_s: float | None
    delay_from_truth_s: float | None
    peak_nm: float | None


@dataclass(frozen=True, slots=True)
class LevelRow:
    """Residual of a run away from collisions.

    Attributes:
        run, joint: whose it is.
        clean_mean_abs_nm: its mean magnitude, None when nothing was clean.
        false_alarms: alarms without a push.
    """

    run: str
    joint: str
    clean_mean_abs_nm: float | None
    false_alarms: int


def demo_text(
    parameters: Sequence[TruthRow],
    pushes: Sequence[PushRow],
    levels: Sequence[LevelRow],
    width: int | None = None,
) -> str:
    """The tables printed at the end: friction, pushes, residual level; cut to ``width``, None: any."""
    tables = sections_text((_friction(parameters), _pushes(pushes)), width).removeprefix("\n")
    return tables + "\n" + "".join(f"{_level(level)}\n" for level in levels)


def _friction(parameters: Sequence[TruthRow]) -> Section:
    records = (
        {
            "joint": check.joint,
            "parameter": check.parameter,
            "true": f"{check.true:.4g}",
            "found": "not identifiable" if check.found is None else f"{check.found:.4g}",
            "95 % interval": " to ".join("open" if bound is None else f"{bound:.4g}" for bound in check.ci95),
            "truth inside": {True: "yes", False: "no", None: ""}[check.inside],
        }
        for check in parameters
    )
    return section_of("Friction: true values and fitted ones with their 95 % intervals", records)


def _pushes(pushes: Sequence[PushRow]) -> Section:
    records = (
        {
            "run": push.run,
            "push": f"link {push.link} at {push.onset_s:g} s",
            "found": "no" if push.joint is None else f"yes, on {push.joint}",
            "after residual > gamma": _ms(push.delay_s),
            "after true torque > gamma": _ms(push.delay_from_truth_s),
            "peak residual": "" if push.peak_nm is None else f"{push.peak_nm:.1f} N·m",
        }
        for push in pushes
    )
    return section_of("Polishing: pushes by a person, watched on joint 1 at 4 N·m for 25 ms", records)


def _ms(seconds: float | None) -> str:
    return "" if seconds is None else f"{1e3 * seconds:.0f} ms"


def _level(check: LevelRow) -> str:
    level = "unknown" if check.clean_mean_abs_nm is None else f"{check.clean_mean_abs_nm:.2f} N·m"
    return (
        f"Run {check.run}: mean |residual| of {check.joint} without collision {level}; "
        f"{check.false_alarms or 'no'} false alarm{'' if check.false_alarms == 1 else 's'}."
    )
