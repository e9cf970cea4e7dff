"""The paper's experiment end to end: identification, runs A and B, reports, and the truth beside them."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from collaudit.core.api import Progress
from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.fixtures.compare import CurveCheck, EventCheck, check_events, check_friction, read_truth
from collaudit.fixtures.simulation import SimulatedFiles, simulate_to
from collaudit.reports.terminal.demo_text import LevelRow, PushRow, TruthRow

ROBOT = "paper6"
WATCHED = "joint1"
_RUNS = {"A": "polish-const", "B": "polish-sine"}


@dataclass(frozen=True, slots=True)
class DemoRun:
    """A polishing run: its name in the paper, its audit, and what the truth says to it."""

    name: str
    audit: Audit
    events: EventCheck

    @property
    def right(self) -> bool:
        """All pushes found and nothing else."""
        return not self.events.false_alarms and all(push.found is not None for push in self.events.pushes)


@dataclass(frozen=True, slots=True)
class Demo:
    """What the demonstration found.

    Attributes:
        friction: as identified.
        true_parameters: joint to parameter to true value.
        curves: fitted curves against the true ones.
        runs: both polishing runs.
        report: the page.
    """

    friction: FrictionFile
    true_parameters: dict[str, dict[str, float]]
    curves: tuple[CurveCheck, ...]
    runs: tuple[DemoRun, ...]
    report: Path

    @property
    def right(self) -> bool:
        """All pushes found, no false alarm."""
        return all(run.right for run in self.runs)


def simulate_all(out: Path, seed: int) -> dict[str, SimulatedFiles]:
    """Simulate the friction run and both polishing runs, two at a time.

    Returns:
        ``friction``, ``A`` and ``B`` to their files.
    """
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        scenarios = {"friction": "friction", **_RUNS}
        futures: dict[str, Future[SimulatedFiles]] = {
            name: pool.submit(simulate_to, scenario, ROBOT, seed, "mcap", out / f"{scenario}.mcap")
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
    from collaudit.cli.log_arguments import audit_files
    from collaudit.core import api
    from collaudit.core.config import load_config
    from collaudit.reports.files.run_files import write_friction
    from collaudit.reports.files.run_folder import write_run
    from collaudit.reports.page.html import write_html

    steps = len(_RUNS) + 2
    identification = load_config(files["friction"].config)
    friction = api.fit([files["friction"].log], identification)
    write_friction(out / "friction.json", friction)
    truth = read_truth(files["friction"].truth)
    progress(1, steps)
    runs = []
    for name in _RUNS:
        overrides = {"friction.file": str((out / "friction.json").absolute()), "detect.watch": [WATCHED]}
        audit, used = audit_files(files[name].log, load_config(files[name].config, overrides))
        write_run(out / f"run-{name}", audit, used)
        runs.append(DemoRun(name, audit, check_events(audit, read_truth(files[name].truth))))
        progress(len(runs) + 1, steps)
    report = out / "report.html"
    write_html(report, [run.audit for run in runs])
    progress(steps, steps)
    true = {joint: facts["parameters"] for joint, facts in truth["friction"].items()}
    return Demo(friction, true, check_friction(friction.joints, truth), tuple(runs), report)


def parameter_checks(demo: Demo) -> list[TruthRow]:
    """Every friction parameter beside its truth."""
    checks = []
    for curve in demo.curves:
        fit = demo.friction.joints[curve.joint]
        for name, true in demo.true_parameters[curve.joint].items():
            bounds, inside = fit.ci95.get(name) or (), curve.inside.get(name)
            checks.append(TruthRow(curve.joint, name, true, fit.parameters.get(name), bounds, inside))
    return checks


def push_checks(runs: Sequence[DemoRun]) -> list[PushRow]:
    """Every push beside its alarm."""
    checks = []
    for run in runs:
        for push in run.events.pushes:
            alarm = push.found
            delay = None if push.delay_s is None or push.lag_s is None else push.delay_s + push.lag_s
            joint, peak = (None, None) if alarm is None else (alarm.joint, alarm.peak_nm)
            checks.append(PushRow(run.name, push.link, push.onset_s, joint, push.delay_s, delay, peak))
    return checks


def level_checks(runs: Sequence[DemoRun]) -> list[LevelRow]:
    """The residual of every run away from collisions."""
    return [
        LevelRow(run.name, WATCHED, run.audit.result.residual[WATCHED].clean_mean_abs_nm, len(run.events.false_alarms))
        for run in runs
    ]
