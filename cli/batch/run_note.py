"""The inputs of a finished run, written after all its other files: content of the log, settings, and versions."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

from collaudit.core.api import LogFiles
from collaudit.core.config import LoadedConfig
from collaudit.core.logs.opening import also_files
from collaudit.core.provenance import versions
from collaudit.core.small_files import read_object, read_small
from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.files.json_files import json_text

#: Says that all files of a run were written; the first to go and the last to come.
FINISHED = "finished.json"
_SCHEMA = "collaudit/finished/1"
#: A file of that name is no longer than this.
_MOST_BYTES = 1 << 16


def note_finished(
    run: Path, files: LogFiles, log_sha256: str, loaded: LoadedConfig, origin: Mapping[str, object] | None = None
) -> None:
    """Write down, after all its other files, the inputs of a run.

    Args:
        run: its folder.
        files, log_sha256, loaded: as of :func:`rests_on`.
        origin: of a remote log what tells that it was replaced, and what was fetched.

    Raises:
        CollauditError: it cannot be written.
    """
    rested = rests_on(files, log_sha256, loaded)
    if origin is not None:
        rested["origin"] = origin
    atomic_write(run / FINISHED, json_text({"schema": _SCHEMA, "rests_on": rested}))


def read_note(run: Path) -> object:
    """The inputs that a run names; None where they cannot be read."""
    file = run / FINISHED
    if run.is_symlink() or file.is_symlink():
        return None
    content = read_object(file, _MOST_BYTES)
    return content.get("rests_on") if content.get("schema") == _SCHEMA else None


def rests_on(files: LogFiles, log_sha256: str, loaded: LoadedConfig) -> dict[str, object]:
    """The inputs of the run of a log, as they are written.

    Args:
        files: of the log.
        log_sha256: their hash.
        loaded: settings; the files that they name count by their content.

    Raises:
        OSError: such a file cannot be read. CollauditError: one is missing.
    """
    config = loaded.config
    named = [loaded.urdf_path, loaded.friction_path]
    other_files = [path for path in named if path is not None]
    other_files += also_files(files, config.log.csv)
    for folder in config.log.msg_path:
        other_files += sorted(folder.rglob("*.msg"))
    return {
        "log": log_sha256,
        "settings": loaded.sha256,
        "files": [hashlib.sha256(read_small(path, 1 << 30)).hexdigest() for path in other_files],
        "versions": {"collaudit": version("collaudit"), **versions()},
    }
