"""``collaudit simulate``: a log whose truth is known."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from inspect import cleandoc
from pathlib import Path

import click

from collaudit.cli.console import note, progress, say_object
from collaudit.cli.group import example_command
from collaudit.core.errors import EXIT_PASS
from collaudit.fixtures.scenarios import FORMATS, IMPERFECTIONS, ROBOTS, SCENARIOS, format_of_suffix


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
def command(
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


command.help = "\n\n".join(
    [
        cleandoc(command.help or ""),
        _listed("Scenarios:", SCENARIOS),
        _listed("Imperfections:", IMPERFECTIONS),
        _listed("Robots:", ROBOTS),
        _listed("Formats:", {name: form.summary for name, form in FORMATS.items()}),
    ]
)
