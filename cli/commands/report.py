"""``collaudit report``: the page of finished runs."""

from __future__ import annotations

from pathlib import Path

import click

from collaudit.cli.console import note, progress, say, say_document, say_json, say_object, terminal_width
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, given_config, load_settings
from collaudit.core.errors import EXIT_PASS, ConfigError
from collaudit.reports.files.run_files import open_run, read_run
from collaudit.reports.files.written_files import json_text
from collaudit.reports.formats.registry import FORMATS, report_text, write_report


@example_command(
    "report",
    "collaudit report run/ -o report.html",
    "collaudit report monday/ tuesday/ -o week.html",
    "collaudit report run/ -o report.html --format html,json,junit",
    "collaudit report run/ -o - --format markdown",
    "collaudit report run/ -o run.mcap --format mcap,csv",
    "collaudit report touched/ clean/ --overlay residual -o overlay.html",
    "collaudit report run/ --clips clips/ --log run.mcap",
)
@click.argument("runs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RUN...")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, allow_dash=True),
    metavar="FILE",
    help="The page to write; - for stdout.",
)
@click.option(
    "--format",
    "formats",
    default="html",
    show_default=True,
    metavar="LIST",
    help=f"Out of {', '.join(FORMATS)}, separated by commas.",
)
@click.option(
    "--limits",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Print estimated contact forces beside limits by body region from your own file (docs/choosing-gamma.md).",
)
@click.option(
    "--overlay",
    type=click.Choice(["residual", "measured", "model", "position", "velocity"]),
    help="Lay this signal of two runs over each other: each contact of the first and the same place in the second.",
)
@click.option(
    "--clips",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Write an MCAP of 3 s before to 3 s after each contact of a run into DIR, for Foxglove.",
)
@click.option(
    "--log",
    type=click.Path(path_type=Path, exists=True),
    metavar="LOG",
    help="The run's recording: --clips holds its topics, too.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON: the written files, or the forces beside limits.")
@config_option
def report_command(
    runs: tuple[Path, ...],
    output: Path | None,
    formats: str,
    limits: Path | None,
    overlay: str | None,
    clips: Path | None,
    log: Path | None,
    as_json: bool,
) -> int:
    """Write the report of finished runs as one self-contained page that works offline.

    The first format keeps the name given with -o; others are written beside it with their own suffix. With
    -c, a run that was judged with other settings is pointed out.

    With --limits, forces and limits are shown side by side, with what cannot be concluded from them: on stdout, or with
    -o on an HTML page.

    With --overlay, a signal of two runs stands on one plot: each contact of the first, and when the second was at the
    same place; of one run named twice, another cycle.

    With --clips, each contact is an MCAP: residual, γ, model and state beside the recorded topics of an MCAP or bag
    (--log), else beside the joints' series.

    The events of each run are counted again from its signals.parquet; where audit.json says otherwise, nothing is
    written.

    Exit code 0 when the report was written, whatever its verdict: detect and audit judge.
    """
    from collaudit.reports.files.event_recount import check_events
    from collaudit.reports.formats.registry import parse_formats, report_paths

    if limits is not None:
        if output is not None and str(output) != "-" and output.suffix.lower() not in (".html", ".htm"):
            raise ConfigError("this is written as HTML", where=f"-o {output}", found=output.suffix, expected=".html")
        return _report_limits(runs, output, limits, as_json)
    if clips is not None:
        return _write_clips(runs, clips, log, as_json)
    if output is None:
        for run in runs:
            open_run(run)  # a folder that is no run offers the runs inside
        raise click.UsageError("Missing option '-o' / '--output': the file to write, or - for stdout.")
    if overlay is not None:
        return _write_overlay(runs, output, overlay)
    wanted = parse_formats(formats)
    paths = {} if str(output) == "-" else report_paths(output, wanted)
    read = open_run if wanted == ["html"] else read_run  # a page draws joint by joint, and needs no more in memory
    audits = []
    with progress("reading runs") as step:
        for k, run in enumerate(runs, 1):
            stored = open_run(run)
            check_events(run, stored.result, stored.signals)
            audits.append(stored if read is open_run else read(run))
            step(k, len(runs))
    if given_config() is not None:
        sha256 = load_settings().sha256
        for run, audit in zip(runs, audits, strict=True):
            if audit.result.provenance.config_sha256 != sha256:
                note(f"{run}: was judged with other settings than {given_config()}")
    if not paths:
        if as_json:
            raise ConfigError(
                "the report itself goes to stdout", where="--json", expected="a file with -o, or no --json"
            )
        if len(wanted) > 1:
            raise ConfigError("only one format fits on stdout", where="-o -", found=formats, expected="one of them")
        with progress("drawing") as step:
            text = report_text(audits, wanted[0], progress=step)
        (say_json if wanted[0] in ("json", "sarif") else say_document)(text)
    files: dict[str, list[str]] = {}
    for name, path in paths.items():
        with progress(f"writing {name}") as step:
            files[name] = [str(each) for each in write_report(path, audits, name, progress=step)]
        note(f"report written to {' and '.join(files[name])}")
    if as_json:
        verdicts = {str(run): audit.result.verdict for run, audit in zip(runs, audits, strict=True)}
        say_object("collaudit/written/1", {"files": files, "verdicts": verdicts})
    return EXIT_PASS


def _write_overlay(runs: tuple[Path, ...], output: Path, signal: str) -> int:
    from collaudit.reports.files.written_files import atomic_write
    from collaudit.reports.page.matter_pages import overlay_page

    if len(runs) != 2:
        raise ConfigError("two runs are laid over each other", where="--overlay", found=f"{len(runs)} runs",
                          hint="name one twice for another cycle of it")  # fmt: skip
    page = overlay_page(read_run(runs[0]), read_run(runs[1]), signal)
    if str(output) == "-":
        say_document(page)
    else:
        atomic_write(output, page)
        note(f"page written to {output}")
    return EXIT_PASS


def _write_clips(runs: tuple[Path, ...], folder: Path, log: Path | None, as_json: bool) -> int:
    from collaudit.reports.formats.audit_mcap import write_clips
    from collaudit.reports.values.words import plural

    if len(runs) != 1:
        raise ConfigError("clips are of one run", where="--clips", found=f"{len(runs)} runs")
    audit = read_run(runs[0])
    with progress("writing clips"):
        made = write_clips(folder, audit, log)
    if as_json:
        files = {"clips": [str(path) for path in made]}
        say_object("collaudit/written/1", {"files": files, "verdicts": {str(runs[0]): audit.result.verdict}})
    note(f"written to {folder}: {plural(len(made), 'clip')}")
    return EXIT_PASS


def _report_limits(runs: tuple[Path, ...], output: Path | None, limits: Path, as_json: bool) -> int:
    from collaudit.reports.files.written_files import atomic_write
    from collaudit.reports.page.matter_pages import body_regions_html
    from collaudit.reports.sections.body_region_sections import CANNOT_BE_CONCLUDED, body_region_section, read_limits
    from collaudit.reports.terminal.command_texts import body_region_text

    stated = read_limits(limits)
    results = [read_run(run).result for run in runs]
    names = ("onset", "joints", "force", "region", "limit", "beside")
    logs = [
        {
            "log": result.log.name,
            "verdict": result.verdict,
            "contacts": [dict(zip(names, row, strict=True)) for row in body_region_section(result, stated).rows],
        }
        for result in results
    ]
    content = {"schema": "collaudit/body-regions/1", "source": stated.source, "note": CANNOT_BE_CONCLUDED, "logs": logs}
    to_file = output if output is not None and str(output) != "-" else None
    if to_file is not None:
        atomic_write(to_file, body_regions_html(results, stated))
        note(f"page written to {to_file}")
    if as_json:
        say_json(json_text(content, indent=2))
    elif to_file is None:
        say(body_region_text(results, stated, terminal_width()), nl=False)
    return EXIT_PASS
