"""``collaudit report``: the page of finished runs."""

from __future__ import annotations

from pathlib import Path

import click

from collaudit.cli.console import note, say_document, say_json
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, config_path, load_settings
from collaudit.core.errors import EXIT_PASS, ConfigError
from collaudit.reports.formats.registry import FORMATS, report_text, write_report

WRITTEN_SCHEMA = "collaudit/written/1"


@example_command(
    "report",
    "collaudit report run/ -o report.html",
    "collaudit report monday/ tuesday/ -o week.html",
    "collaudit report run/ -o report.html --format html,json,junit",
    "collaudit report run/ -o - --format markdown",
)
@click.argument("runs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RUN...")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, allow_dash=True),
    required=True,
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
@click.option("--json", "as_json", is_flag=True, help="Print the written files as JSON.")
@config_option
def command(runs: tuple[Path, ...], output: Path, formats: str, as_json: bool) -> int:
    """Write the report of finished runs as one self-contained page that works offline.

    The first format keeps the name given with -o; others are written beside it with their own suffix. With
    -c, a run that was judged with other settings is pointed out.

    Exit code 0 when the report was written, whatever its verdict: detect and audit judge.
    """
    from collaudit.cli.formats import parse_formats, report_paths
    from collaudit.reports.files.json_writer import json_text
    from collaudit.reports.files.run_files import read_run

    wanted = parse_formats(formats)
    paths = {} if str(output) == "-" else report_paths(output, wanted)
    audits = [read_run(run) for run in runs]
    if config_path() is not None:
        sha256 = load_settings().sha256
        for run, audit in zip(runs, audits, strict=True):
            if audit.result.provenance.config_sha256 != sha256:
                note(f"{run}: was judged with other settings than {config_path()}")
    if not paths:
        if as_json:
            raise ConfigError(
                "the report itself goes to stdout", where="--json", expected="a file with -o, or no --json"
            )
        if len(wanted) > 1:
            raise ConfigError("only one format fits on stdout", where="-o -", found=formats, expected="one of them")
        text = report_text(audits, wanted[0])
        (say_json if wanted[0] in ("json", "sarif") else say_document)(text)
    files: dict[str, list[str]] = {}
    for name, path in paths.items():
        files[name] = [str(each) for each in write_report(path, audits, name)]
        note(f"report written to {' and '.join(files[name])}")
    if as_json:
        verdicts = {str(run): audit.result.verdict for run, audit in zip(runs, audits, strict=True)}
        say_json(json_text({"schema": WRITTEN_SCHEMA, "files": files, "verdicts": verdicts}, indent=2))
    return EXIT_PASS
