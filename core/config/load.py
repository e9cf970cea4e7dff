"""Loading a configuration: TOML, flags on top, validated once, with a hash that names no folder.

What is computed by it says so: its origin, the versions and hashes of all that went in.
"""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import msgspec

from collaudit.core.config.config_table import toml_values
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import Provenance
from collaudit.core.errors import ConfigError
from collaudit.core.small_files import parse_toml, read_small

#: Keys that say the same thing in another way: a flag for the first takes the others out of the file's answer.
_REPLACES: dict[str, tuple[str, ...]] = {
    "detect.n": ("detect.persistence_ms",),
    "detect.persistence_ms": ("detect.n",),
    "robot.urdf": ("robot.dh", "robot.dh_convention"),
}
#: Distributions whose version can change a number.
_COMPUTING = ("numpy", "scipy", "pin", "pandas", "pyarrow", "mcap", "rosbags")


@dataclass(frozen=True, slots=True)
class LoadedConfig:
    """An effective configuration and where it came from.

    Attributes:
        config: the validated configuration, flags applied.
        base_dir: folder that the robot's description starts from; all other files are found from the working folder.
        sha256: hash of the effective configuration, defaults included; file paths enter as file names.
        path: the file, or None when there was none.
    """

    config: Config
    base_dir: Path
    sha256: str
    path: Path | None

    @property
    def friction_path(self) -> Path | None:
        """The friction file that the configuration names; None when it names none."""
        return self.config.friction.file

    @property
    def urdf_path(self) -> Path | None:
        """The robot's description as it is found from the working folder; None when the configuration names none."""
        urdf = self.config.robot.urdf
        return None if urdf is None else self.base_dir / urdf

    def provenance(self, friction_sha256: str | None, model_sha256: str | None) -> Provenance:
        """Origin of a result.

        Args:
            friction_sha256: hash of the friction file judged with, None when there is none.
            model_sha256: hash of the robot model.
        """
        return Provenance(version("collaudit"), versions(), self.sha256, friction_sha256, model_sha256)


def versions() -> dict[str, str]:
    """Installed versions of what can change a number."""
    return {name: found for name in _COMPUTING if (found := _installed(name))}


@cache  # what is installed does not change under a running program
def _installed(name: str) -> str | None:
    """The version of a distribution; None where it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def load_config(path: str | Path | None, overrides: Mapping[str, object] | None = None) -> LoadedConfig:
    """Read and validate a configuration file.

    Args:
        path: a TOML file; None for the defaults (relative paths then start from the working folder).
        overrides: dotted key to value, stronger than the file; a mapping is merged into the file's table.
            Relative paths in them start from the working folder, so callers make them absolute.

    Raises:
        ConfigError: the file cannot be read, is not TOML, or does not fit the schema; the first problem is named
            with its line.
    """
    file = Path(path) if path else None
    text = read_text(file, "collaudit init LOG -o collaudit.toml writes one for a log") if file else ""
    return parse_config(text, file, overrides)


def parse_config(text: str, path: Path | None, overrides: Mapping[str, object] | None = None) -> LoadedConfig:
    """As :func:`load_config`, of a text that is or will be the file's content.

    Raises:
        ConfigError: it is not TOML or does not fit the schema.
    """
    data = parsed(text, path)
    changes: dict[str, object] = toml_values(overrides or {})
    for rival in [name for dotted in changes for name in _REPLACES.get(dotted, ())]:
        _remove(data, rival)
    for dotted, value in changes.items():
        _override(data, dotted, value)
    base_dir = path.parent if path else Path()
    try:
        config = Config.of(data, base_dir)
    except msgspec.ValidationError as error:
        raise problem_of(error, text, data, path, changes, Config) from None
    return LoadedConfig(config, base_dir, config_sha256(config), path)


def parsed(text: str, path: Path | None) -> dict[str, object]:
    """The values of a TOML text; ConfigError with its line where it is none."""
    try:
        return parse_toml(text)
    except tomllib.TOMLDecodeError as error:
        from collaudit.core.config.describe import syntax_problem

        raise syntax_problem(error, str(path or "")) from error


def problem_of(
    error: msgspec.ValidationError,
    text: str,
    data: Mapping[str, object],
    path: Path | None,
    changes: Iterable[str],
    model: type[msgspec.Struct],
) -> ConfigError:
    """What does not fit a schema, with its place.

    Args:
        error: what msgspec says.
        text: of the file.
        data: its values, with those of the command line.
        path: the file; None without one.
        changes: dotted keys that the command line states.
        model: the schema.
    """
    from collaudit.core.config.describe import Places, schema_problem
    from collaudit.core.small_files import key_lines

    places = Places(str(path) if path else None, key_lines(text), [tuple(dotted.split(".")) for dotted in changes])
    return schema_problem(error, data, places, model)


def config_sha256(config: Config) -> str:
    """Hash of a configuration that is the same wherever its files lie.

    Which robots there are besides, and what motions are planned within, is no part of it.
    """
    values: dict[str, dict[str, object]] = msgspec.to_builtins(config, enc_hook=lambda path: path.name)
    del values["fleet"], values["plan"]
    canonical = json.dumps(values, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(canonical.encode()).hexdigest()


def read_text(path: Path, hint: str) -> str:
    """The text of a TOML file.

    Args:
        path: the file.
        hint: what makes one, where there is none.

    Raises:
        ConfigError: it cannot be read, or is not UTF-8.
    """
    try:
        return read_small(path).decode("utf-8-sig")
    except FileNotFoundError as error:
        raise ConfigError("there is no such configuration file", where=str(path), hint=hint) from error
    except IsADirectoryError as error:
        raise ConfigError(
            "this is a folder, not a configuration file", where=str(path), hint=f"{path / 'collaudit.toml'}"
        ) from error
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", where=str(path)) from error
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise ConfigError(
            "not UTF-8 text",
            where=f"{path}:{line}",
            found=f"byte 0x{error.object[error.start]:02x}",
            expected="a TOML file, which is always UTF-8",
            hint="save the file as UTF-8",
        ) from error


def _override(data: dict[str, object], dotted: str, value: object) -> None:
    """Set a key in nested tables; a mapping is merged into a table that is there."""
    front, _, last = dotted.rpartition(".")
    table = data
    for name in front.split(".") if front else ():
        inner = table.get(name)
        if not isinstance(inner, dict):
            inner = table[name] = {}
        table = inner
    before = table.get(last)
    if isinstance(before, dict) and isinstance(value, Mapping):
        value = {**before, **value}
    table[last] = value


def _remove(data: dict[str, object], dotted: str) -> None:
    *tables, last = dotted.split(".")
    table: object = data
    for name in tables:
        table = table.get(name) if isinstance(table, dict) else None
    if isinstance(table, dict):
        table.pop(last, None)
