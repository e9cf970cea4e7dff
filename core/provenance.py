"""Origin of a result: versions and hashes of the inputs."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from collaudit.core.config import LoadedConfig
from collaudit.core.data.audit_result import Provenance
from collaudit.core.errors import ConfigError
from collaudit.core.small_files import check_regular

#: Distributions whose version can change a number.
_COMPUTING = ("numpy", "scipy", "pin", "pandas", "pyarrow", "mcap", "rosbags")


def make_provenance(loaded: LoadedConfig, friction_sha256: str | None, model_sha256: str | None) -> Provenance:
    """Provenance of a run.

    Args:
        loaded: the effective configuration.
        friction_sha256: hash of the friction file judged with, None when there is none.
        model_sha256: hash of the robot model.
    """
    return Provenance(
        collaudit=installed_version("collaudit"),
        packages=versions(),
        config_sha256=loaded.sha256,
        friction_sha256=friction_sha256,
        model_sha256=model_sha256,
    )


def versions() -> dict[str, str]:
    """Installed versions of what can change a number."""
    return {name: found for name in _COMPUTING if (found := _version_or_none(name))}


def file_sha256(path: Path) -> str:
    """Hash of a file's bytes.

    Raises:
        ConfigError: it cannot be read.
    """
    try:
        check_regular(path)
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", where=str(path)) from error


@cache  # what is installed does not change under a running program
def installed_version(name: str) -> str:
    """The version of an installed distribution.

    Raises:
        importlib.metadata.PackageNotFoundError: it is not installed.
    """
    return version(name)


def _version_or_none(name: str) -> str | None:
    try:
        return installed_version(name)
    except PackageNotFoundError:
        return None
