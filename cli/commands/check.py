"""``collaudit check``: whether configurations can be used, without a log."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import click

from collaudit.cli.console import note, say, say_object
from collaudit.cli.group import example_command
from collaudit.core.errors import EXIT_PASS, EXIT_USAGE, CollauditError, ConfigError


@example_command("check", "collaudit check", "collaudit check collaudit.toml fleet/collaudit-cell1.toml")
@click.argument("configs", nargs=-1, type=click.Path(path_type=Path), metavar="[CONFIG]...")
@click.option("--json", "as_json", is_flag=True, help="Print JSON: whether each can be used, and why not.")
def command(configs: tuple[Path, ...], as_json: bool) -> int:
    """Check configurations: keys, values, keys without effect, files, the fleet, and accepted contacts that are over.

    Without an argument collaudit.toml of this folder is checked. As a hook of pre-commit: collaudit-check.

    Exit codes: 0 all can be used; 2 one cannot. An acceptance that is over is said, and is no error.
    """

    problems: dict[str, str | None] = {}
    for path in configs or (Path("collaudit.toml"),):
        try:
            _check(path)
        except CollauditError as error:
            note(error.render())
            problems[str(path)] = error.render()
        else:
            problems[str(path)] = None
            if not as_json:
                say(f"ok  {path}")
    if as_json:
        say_object("collaudit/check/1", {"problems": problems})
    return EXIT_USAGE if any(problems.values()) else EXIT_PASS


def _check(path: Path) -> None:
    from collaudit.cli.fleet.precedents import read_accepted
    from collaudit.cli.fleet.robot_matching import robot_settings
    from collaudit.core.config import load_config
    from collaudit.core.config.describe import without_effect
    from collaudit.core.contacts.contact_states import day_refusal
    from collaudit.reports.files.run_files import read_friction

    loaded = load_config(path)
    robots = loaded.config.fleet.robots
    for settings in (loaded, *robot_settings(loaded, {}, robots).values()):
        if idle := without_effect(settings.config):
            raise ConfigError(
                "a key is stated that has no effect",
                where=str(settings.path or path),
                found=", ".join(need.key for need in idle),
                expected="; ".join(f"{need.key} with {need.needs}" for need in idle),
                hint="state what it goes with, or take it out",
            )
        urdf = settings.urdf_path
        if urdf is not None and not urdf.is_file():
            raise ConfigError("the robot's description is not there", where=str(path), found=str(urdf))
        if settings.friction_path is not None:
            read_friction(settings.friction_path)
    today = datetime.now(UTC).date()
    for entry in read_accepted(loaded):
        why = day_refusal(entry, today)
        if why is not None:
            note(f"accepted contact that does not count, {why}: {entry.words}")
