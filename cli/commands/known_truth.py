"""Logs whose truth is known: ``collaudit simulate`` makes one, ``selftest`` and ``demo`` audit some and compare."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass
from inspect import cleandoc
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import click

from collaudit.cli.console import note, progress, say, say_json, say_object, terminal_width
from collaudit.cli.group import example_command
from collaudit.core.errors import EXIT_FAIL, EXIT_PASS
from collaudit.fixtures.scenarios import FORMATS, IMPERFECTIONS, ROBOTS, SCENARIOS, format_of_suffix

if TYPE_CHECKING:
    from collaudit.core.api import Progress
    from collaudit.core.data.audit_result import FrictionFile
    from collaudit.fixtures.compare import PushCheck
    from collaudit.fixtures.simulation import SimulatedFiles
    from collaudit.reports.terminal.command_texts import LevelRow, PushRow, TruthRow

#: What the demonstration simulates, and where it looks for pushes.
_ROBOT, _WATCHED = "paper6", "joint1"
_RUNS = {"A": "polish-const", "B": "polish-sine"}


def _listed(title: str, names: dict[str, str]) -> str:
    """A paragraph of the help that click must not wrap."""
    width = max(len(name) for name in names)
    return "\b\n" + "\n".join([title, *(f"  {name:<{width}}  {text}" for name, text in names.items())])


def _names(known: Iterable[str]) -> Callable[[click.Context, click.Parameter, str], list[str]]:
    return lambda _context, _param, begun: [name for name in known if name.startswith(begun)]


@example_command(
    "simulate",
    "collaudit simulate friction -o friction.mcap",
    "collaudit simulate polish-const --seed 7 --format bag -o run.bag",
    "collaudit simulate free-hits --robot seven --mismatch 2 -o hits.mcap",
)
@click.argument("scenario", metavar="SCENARIO", shell_complete=_names(SCENARIOS))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, metavar="LOG", help="Log to write.")
@click.option(
    "--robot",
    default="paper6",
    show_default=True,
    metavar="NAME",
    shell_complete=_names(ROBOTS),
    help="Simulated arm.",
)
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Same seed, same bytes.")
@click.option(
    "--format",
    "fmt",
    metavar="NAME",
    shell_complete=_names(FORMATS),
    help="csv, mcap, bag or db3; by the suffix of LOG when absent.",
)
@click.option(
    "--mismatch",
    type=float,
    default=0.0,
    show_default=True,
    metavar="PERCENT",
    help="Largest error of each inertial property in the robot file.",
)
@click.option(
    "--with",
    "imperfections",
    multiple=True,
    metavar="NAME",
    shell_complete=_names(IMPERFECTIONS),
    help="Imperfection of the recording, from the list below; may be given several times.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the written files as JSON.")
@click.option("--duration", type=float, metavar="S", help="Length of free motion and stop-go, s.")
def simulate_command(
    scenario: str,
    output: Path,
    robot: str,
    seed: int,
    fmt: str | None,
    mismatch: float,
    imperfections: tuple[str, ...],
    as_json: bool,
    duration: float | None,
) -> int:
    """Simulate a recording whose truth is known, with real sensors and full dynamic friction.

    Beside LOG stand its configuration (.toml), its truth (.truth.json) and, for a URDF robot, its model
    (.urdf). A simulation's own files are replaced, others are not.
    """
    from collaudit.fixtures.simulation import simulate_to

    with progress("simulating") as report:
        files = simulate_to(
            scenario,
            robot,
            seed,
            fmt or format_of_suffix(output.suffix),
            output,
            mismatch_percent=mismatch,
            duration_s=duration,
            imperfections=imperfections,
            progress=report,
        )
    if as_json:
        robot_file = None if files.robot_file is None else str(files.robot_file)
        content = {"log": [str(path) for path in files.log], "config": str(files.config)}
        say_object("collaudit/simulated/1", {**content, "robot": robot_file, "truth": str(files.truth)})
    written = [*files.log, files.config, files.robot_file, files.truth]
    note("written: " + ", ".join(str(path) for path in written if path is not None))
    return EXIT_PASS


simulate_command.help = "\n\n".join(
    [
        cleandoc(simulate_command.help or ""),
        _listed("Scenarios:", SCENARIOS),
        _listed("Imperfections:", IMPERFECTIONS),
        _listed("Robots:", ROBOTS),
        _listed("Formats:", {name: form.summary for name, form in FORMATS.items()}),
    ]
)


@example_command("selftest", "collaudit selftest", "collaudit selftest --json")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def selftest_command(as_json: bool) -> int:
    """Simulate logs whose truth is known, audit them on this machine, and compare.

    Friction curves, pushes and their delay, clean motion without alarms, the same audit from every log
    format, and a named finding for spoilt logs.

    Exit code 0 when everything is as it should be, 1 otherwise.
    """
    from collaudit.fixtures.installation_checks import run_selftest
    from collaudit.reports.files.written_files import json_text
    from collaudit.reports.terminal.command_texts import checks_text

    note("simulating and auditing known-truth logs (a minute or two) …")
    with TemporaryDirectory(prefix="collaudit-selftest-") as scratch, progress("selftest") as report:
        result = run_selftest(Path(scratch), progress=report)
    text = json_text(result)
    rows = [(row.passed, row.robot, row.check, row.wanted, row.found) for row in result.rows]
    if as_json:
        say_json(text)
    else:
        say(checks_text(rows, terminal_width()), nl=False)
    return EXIT_PASS if result.passed else EXIT_FAIL


@example_command("demo", "collaudit demo", "collaudit demo -o demo-out")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    default=Path("demo-out"),
    show_default=True,
    metavar="OUT",
    help="Folder for logs, runs and the report.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON: friction, pushes and residual beside their truth.")
def demo_command(output: Path, as_json: bool) -> int:
    """Run the whole chain on simulated logs: a friction run, two polishing runs with a person pushing the arm.

    Simulates the logs, identifies friction, judges both runs, writes the report, and prints what was found
    beside what is true.

    Exit code 0 when every push was found and nothing else; 1 otherwise.
    """
    from collaudit.reports.terminal.command_texts import demo_text

    output.mkdir(parents=True, exist_ok=True)
    note("simulating the friction run and polishing runs A and B (about a minute) …")
    files = _simulated_runs(output)
    with progress("auditing") as report:
        demo = _evaluated(files, output, report)
    if as_json:
        content = {"report": str(demo.report), "right": demo.right}
        rows = {"friction": demo.friction, "pushes": demo.pushes, "residual": demo.residual}
        say_object("collaudit/demo/1", {**content, **rows})
    else:
        say(demo_text(demo.friction, demo.pushes, demo.residual, terminal_width()), nl=False)
        say(f"Report: {demo.report}")
    return EXIT_PASS if demo.right else EXIT_FAIL


@dataclass(frozen=True, slots=True)
class _Demo:
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


def _simulated_runs(out: Path) -> dict[str, SimulatedFiles]:
    """Files of ``friction``, the run that tells it, and of the polishing runs ``A`` and ``B``, made two at a time."""
    from collaudit.fixtures.simulation import simulate_to

    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        scenarios = {"friction": "friction", **_RUNS}
        futures: dict[str, Future[SimulatedFiles]] = {
            name: pool.submit(simulate_to, scenario, _ROBOT, 1, "mcap", out / f"{scenario}.mcap")
            for name, scenario in scenarios.items()
        }
        return {name: future.result() for name, future in futures.items()}


def _evaluated(files: dict[str, SimulatedFiles], out: Path, report: Progress) -> _Demo:
    """Identify friction, judge both polishing runs with it, write runs and their page into ``out``."""
    from collaudit.cli.shared_steps import audit_files
    from collaudit.core import api
    from collaudit.core.config import load_config
    from collaudit.fixtures.compare import check_events, read_truth
    from collaudit.reports.files.run_files import write_friction, write_run
    from collaudit.reports.page.html import write_html
    from collaudit.reports.terminal.command_texts import LevelRow

    steps = len(_RUNS) + 2
    identification = load_config(files["friction"].config)
    friction = api.fit([files["friction"].log], identification)
    write_friction(out / "friction.json", friction)
    truth = read_truth(files["friction"].truth)
    report(1, steps)
    audits, pushes, levels = [], [], []
    for name in _RUNS:
        overrides = {"friction.file": str((out / "friction.json").absolute()), "detect.watch": [_WATCHED]}
        audit, used = audit_files(files[name].log, load_config(files[name].config, overrides))
        write_run(out / f"run-{name}", audit, used)
        events = check_events(audit, read_truth(files[name].truth))
        audits.append(audit)
        pushes += [_push_row(name, push) for push in events.pushes]
        clean_nm = audit.result.residual[_WATCHED].clean_mean_abs_nm
        levels.append(LevelRow(name, _WATCHED, clean_nm, len(events.false_alarms)))
        report(len(audits) + 1, steps)
    page = out / "report.html"
    write_html(page, audits)
    report(steps, steps)
    return _Demo(_truth_rows(friction, truth), pushes, levels, page)


def _truth_rows(friction: FrictionFile, truth: Mapping[str, Any]) -> list[TruthRow]:
    from collaudit.fixtures.compare import check_friction
    from collaudit.reports.terminal.command_texts import TruthRow

    rows = []
    for curve in check_friction(friction.joints, truth):
        fit = friction.joints[curve.joint]
        for name, true in truth["friction"][curve.joint]["parameters"].items():
            bounds, inside = fit.ci95.get(name) or (), curve.inside.get(name)
            rows.append(TruthRow(curve.joint, name, true, fit.parameters.get(name), bounds, inside))
    return rows


def _push_row(run: str, push: PushCheck) -> PushRow:
    from collaudit.reports.terminal.command_texts import PushRow

    alarm = push.found
    delay = None if push.delay_s is None or push.lag_s is None else push.delay_s + push.lag_s
    joint, peak = (None, None) if alarm is None else (alarm.joint, alarm.peak_nm)
    return PushRow(run, push.link, push.onset_s, joint, push.delay_s, delay, peak)
