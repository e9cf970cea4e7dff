"""The demonstration for a terminal: what was found beside what is true."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from collaudit.reports.sections.section import Section
from collaudit.reports.terminal.text_table import sections_text


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
    rows = tuple(
        (
            check.joint,
            check.parameter,
            f"{check.true:.4g}",
            "not identifiable" if check.found is None else f"{check.found:.4g}",
            " to ".join("open" if bound is None else f"{bound:.4g}" for bound in check.ci95),
            {True: "yes", False: "no", None: ""}[check.inside],
        )
        for check in parameters
    )
    head = ("joint", "parameter", "true", "found", "95 % interval", "truth inside")
    return Section("Friction: true values and fitted ones with their 95 % intervals", head, rows)


def _pushes(pushes: Sequence[PushRow]) -> Section:
    rows = tuple(
        (
            push.run,
            f"link {push.link} at {push.onset_s:g} s",
            "no" if push.joint is None else f"yes, on {push.joint}",
            _ms(push.delay_s),
            _ms(push.delay_from_truth_s),
            "" if push.peak_nm is None else f"{push.peak_nm:.1f} N·m",
        )
        for push in pushes
    )
    head = ("run", "push", "found", "after residual > gamma", "after true torque > gamma", "peak residual")
    return Section("Polishing: pushes by a person, watched on joint 1 at 4 N·m for 25 ms", head, rows)


def _ms(seconds: float | None) -> str:
    return "" if seconds is None else f"{1e3 * seconds:.0f} ms"


def _level(check: LevelRow) -> str:
    level = "unknown" if check.clean_mean_abs_nm is None else f"{check.clean_mean_abs_nm:.2f} N·m"
    return (
        f"Run {check.run}: mean |residual| of {check.joint} without collision {level}; "
        f"{check.false_alarms or 'no'} false alarm{'' if check.false_alarms == 1 else 's'}."
    )
