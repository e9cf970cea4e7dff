"""``collaudit explain``: which single cause takes a log's residual away."""

from __future__ import annotations

import click

from collaudit.cli.console import progress, say, say_object, say_result, terminal_width
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, friction_option, load_settings
from collaudit.cli.shared_steps import audit_files, exit_code, one_log

EXPLAIN_SCHEMA = "collaudit/explain/1"


@example_command(
    "explain",
    "collaudit explain run.mcap -c collaudit.toml --friction friction.json",
    "collaudit explain run.csv -c collaudit.toml --friction friction.json --json",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option("--json", "as_json", is_flag=True, help="Print JSON: causes with share, interval and line to paste.")
@config_option
@friction_option
def command(logs: tuple[str, ...], as_json: bool) -> int:
    """Try causes on a log that fails or is not judged: tool, mounting, scale, friction, zero, delay, exchanged joints.

    Each is a small solve on what the residual has beyond that of the fitted motion, and is tried on blocks of time that
    the solve has not seen. A cause tells what to state before the next run; it never changes a verdict.

    Exit codes: as of detect.
    """
    from collaudit.reports.terminal.screen_text import causes_text
    from collaudit.reports.values.visible_text import visible, wrapped
    from collaudit.reports.values.words import cause_sentence, verdict_word

    loaded = load_settings()
    with progress("judging") as report:
        audit, _ = audit_files(one_log(logs, loaded), loaded, report)
    result = audit.result
    if as_json:
        say_object(EXPLAIN_SCHEMA, {"log": result.log.name, "verdict": result.verdict, "causes": result.causes})
        return exit_code([result.verdict])
    width = terminal_width()
    say_result(f"{verdict_word(result.verdict, result.exclusions)}  {visible(result.log.name)}\n")
    passed = "It passes: there is nothing to explain."
    nothing = passed if result.verdict == "pass" else "Its residual is not off for long enough for a cause."
    say_result(f"{wrapped(cause_sentence(result) or nothing, width, '  ')}\n")
    say(causes_text(result, width), nl=False)
    return exit_code([result.verdict])
