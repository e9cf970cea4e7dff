"""``-c/--config`` and the flags that override it, declared once for all commands.

A flag names the key it overrides; its value waits in the context until :func:`load_settings` merges file and
flags. Commands therefore take no parameters for settings.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from collaudit.cli.console import note

if TYPE_CHECKING:
    from collaudit.core.config import LoadedConfig

_PATH = "collaudit.config.path"
_FOUND = "collaudit.config.found"
_OVERRIDES = "collaudit.config.overrides"
#: Found in the working folder, this file is used by every command that takes ``-c`` and was given none.
DEFAULT = Path("collaudit.toml")

_FILE = click.Path(path_type=Path)
CommandFunction = Callable[..., int]
Decorator = Callable[[CommandFunction], CommandFunction]


def settings_file() -> Path | None:
    """The file given by ``-c``, else ``collaudit.toml`` of the working folder."""
    return given_config() or (DEFAULT if DEFAULT.is_file() else None)


def given_config() -> Path | None:
    """The file given by ``-c``; not the one that is used because it is in the working folder."""
    path = click.get_current_context().meta.get(_PATH)
    return path if isinstance(path, Path) else None


def given_paths() -> dict[str, str]:
    """Dotted key to file, as the flags were typed."""
    return {key: str(value) for key, value in _stated().items() if isinstance(value, Path)}


def overrides() -> dict[str, object]:
    """Dotted key to value, of the flags given; files are absolute."""
    return {key: str(value.absolute()) if isinstance(value, Path) else value for key, value in _stated().items()}


def _stated() -> dict[str, object]:
    stated: dict[str, object] = click.get_current_context().meta.get(_OVERRIDES, {})
    return stated


def load_settings(replaced: Path | None = None) -> LoadedConfig:
    """The effective configuration of the running command.

    Args:
        replaced: a file that the command will write anew, and that is therefore not looked up by itself.

    Raises:
        ConfigError: file or flags do not say what is needed.
    """
    from collaudit.core.config import load_config

    meta = click.get_current_context().meta
    own = replaced is not None and _PATH in meta and meta[_PATH] is None and replaced.resolve() == DEFAULT.resolve()
    path = None if own else settings_file()
    if path is not None and path != meta.get(_PATH) and not meta.get(_FOUND):
        meta[_FOUND] = True
        note(f"settings of {DEFAULT} in this folder are used; -c names another file")
    return load_config(path, overrides())


def _keep_config(ctx: click.Context, _param: click.Parameter, value: Path | None) -> None:
    ctx.meta[_PATH] = value


def _keep_assignments(ctx: click.Context, _param: click.Parameter, given: tuple[tuple[str, object], ...]) -> None:
    ctx.meta.setdefault(_OVERRIDES, {}).update(given)


def _flag(name: str, key: str, kind: Any, metavar: str, words: str) -> Decorator:
    """An option whose value overrides ``key``."""

    def keep(ctx: click.Context, _param: click.Parameter, given: object) -> None:
        if given is not None:
            ctx.meta.setdefault(_OVERRIDES, {})[key] = given

    return click.option(name, type=kind, callback=keep, expose_value=False, metavar=metavar, help=words)


def _assignment(text: str) -> tuple[str, object]:
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise click.BadParameter(f"{text!r} is not KEY=VALUE, such as detect.n=13")
    from collaudit.core.small_files import parse_toml

    try:
        return key.strip(), parse_toml(f"v = {value}")["v"]
    except tomllib.TOMLDecodeError:
        return key.strip(), value.strip()


def config_option(function: CommandFunction) -> CommandFunction:
    """``-c``, and any key."""
    any_key = click.option(
        "--set",
        type=_assignment,
        multiple=True,
        callback=_keep_assignments,
        expose_value=False,
        metavar="KEY=VALUE",
        help='Any key of docs/config.md, value as in TOML: detect.n=13, \'robot.joints=["a", "b"]\'.',
    )
    file = click.option(
        "-c",
        "--config",
        type=_FILE,
        callback=_keep_config,
        expose_value=False,
        metavar="FILE",
        help="Configuration (see collaudit init).",
    )
    return file(any_key(function))


def part_options(function: CommandFunction) -> CommandFunction:
    """Which part of a log."""
    begin = _flag("--from", "log.from_s", float, "S", "Judge the log from here on only, s from its first sample.")
    return begin(_flag("--to", "log.to_s", float, "S", "Judge it up to here only.")(function))


#: Which robot.
urdf_option = _flag("--urdf", "robot.urdf", _FILE, "FILE", "Robot model.")
#: What it is judged by.
friction_option = _flag("--friction", "friction.file", _FILE, "FILE", "Friction to judge with (see collaudit fit).")
