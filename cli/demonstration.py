"""The paper's experiment end to end: identification, runs A and B, reports, and the truth beside them."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from collaudit.core.api import Progress
from collaudit.core.data.audit_result import FrictionFile
from collaudit.fixtures.compare import PushCheck, check_events, check_friction, read_truth
from collaudit.fixtures.simulation import SimulatedFiles, simulate_to
from collaudit.reports.terminal.command_texts import LevelRow, PushRow, TruthRow

ROBOT = "paper6"
WATCHED = "joint1"
_RUNS = {"A": "polish-const", "B": "polish-sine"}


@dataclass(frozen=True, slots=True)
class Demo:
    """What the demonstration found beside what is true.

    Attributes:
        friction: every parameter.
        pushes: of both polishing runs.
        residual: of each polishing run, away from collisions.
        report: the page.
    """

    friction: list[TruthRow]
    pushes: list[PushRow]
    residual: list[LevelRow]
    report: Path

    @property
    def right(self) -> bool:
        """All pushes found, no false alarm."""
        return all(push.joint is not None for push in self.pushes) and not any(
            run.false_alarms for run in self.residual
        )


def simulate_all(out: Path) -> dict[str, SimulatedFiles]:
    """Simulate the friction run and both polishing runs, two at a time.

    Returns:
        ``friction``, ``A`` and ``B`` to their files.
    """
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        scenarios = {"friction": "friction", **_RUNS}
        futures: dict[str, Future[SimulatedFiles]] = {
            name: pool.submit(simulate_to, scenario, ROBOT, 1, "mcap", out / f"{scenario}.mcap")
            for name, scenario in scenarios.items()
        }
        return {name: future.result() for name, future in futures.items()}


def evaluate(files: dict[str, SimulatedFiles], out: Path, progress: Progress) -> Demo:
    """Identify friction, judge both runs with it, write runs and the report.

    Args:
        files: as :func:`simulate_all` gives them.
        out: folder for what is written.
        progress: called with steps done and in all.
    """
    from collaudit.cli.shared_steps import audit_files
    from collaudit.core import api
    from collaudit.core.config import load_config
    from collaudit.reports.files.run_files import write_friction, write_run
    from collaudit.reports.page.html import write_html

    steps = len(_RUNS) + 2
    identification = load_config(files["friction"].config)
    friction = api.fit([files["friction"].log], identification)
    write_friction(out / "friction.json", friction)
    truth = read_truth(files["friction"].truth)
    progress(1, steps)
    audits, pushes, levels = [], [], []
    for name in _RUNS:
        overrides = {"friction.file": str((out / "friction.json").absolute()), "detect.watch": [WATCHED]}
        audit, used = audit_files(files[name].log, load_config(files[name].config, overrides))
        write_run(out / f"run-{name}", audit, used)
        events = check_events(audit, read_truth(files[name].truth))
        audits.append(audit)
        pushes += [_push_row(name, push) for push in events.pushes]
        clean_nm = audit.result.residual[WATCHED].clean_mean_abs_nm
        levels.append(LevelRow(name, WATCHED, clean_nm, len(events.false_alarms)))
        progress(len(audits) + 1, steps)
    report = out / "report.html"
    write_html(report, audits)
    progress(steps, steps)
    return Demo(_truth_rows(friction, truth), pushes, levels, report)


def _truth_rows(friction: FrictionFile, truth: Mapping[str, Any]) -> list[TruthRow]:
    rows = []
    for curve in check_friction(friction.joints, truth):
        fit = friction.joints[curve.joint]
        for name, true in truth["friction"][curve.joint]["parameters"].items():
            bounds, inside = fit.ci95.get(name) or (), curve.inside.get(name)
            rows.append(TruthRow(curve.joint, name, true, fit.parameters.get(name), bounds, inside))
    return rows


def _push_row(run: str, push: PushCheck) -> PushRow:
    alarm = push.found
    delay = None if push.delay_s is None or push.lag_s is None else push.delay_s + push.lag_s
    joint, peak = (None, None) if alarm is None else (alarm.joint, alarm.peak_nm)
    return PushRow(run, push.link, push.onset_s, joint, push.delay_s, delay, peak)
