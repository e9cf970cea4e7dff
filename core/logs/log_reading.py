"""Reading one log as joint signals: topics chosen, joints mapped by name, units applied, clock chosen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import ConfigError, LogError
from collaudit.core.logs.file_kind import sniff
from collaudit.core.logs.opening import Hashing, sha256_of

if TYPE_CHECKING:
    from collaudit.core.config.schema import LogConfig

_BINARY_SUFFIXES = (".mcap", ".bag", ".db3")


def log_name(paths: Sequence[Path]) -> str:
    """File names without their folders, joined by ``+``."""
    return "+".join(path.name for path in paths)


def is_text(path: Path) -> bool:
    """Whether a file is a CSV, by its content; a compressed file is taken as one."""
    return sniff(path) in ("csv", "compressed")


def misnamed(path: Path, error: LogError) -> LogError:
    """Say of a text file that is called .mcap, .bag or .db3 that it is none, first of all."""
    if path.suffix.lower() not in _BINARY_SUFFIXES:
        return error
    return LogError(
        f"is called {path.suffix} and holds text, which is no table of joint signals either ({error.message})",
        where=str(path),
        found=error.found,
        hint="check that the file was copied whole, and not as a Git LFS pointer or an error page",
    )


def read_log(
    paths: tuple[Path, ...],
    settings: LogConfig,
    *,
    robot_joints: Sequence[str] | None,
    progress: Callable[[int, int], None] | None = None,
    prismatic: Sequence[str] = (),
    cache: Path | None = None,
) -> JointLog:
    """Read one log.

    Args:
        paths: one file or bag folder, or several CSV files with the same time column.
        settings: topics, names, clock and units.
        robot_joints: the robot's joints in model order; None keeps all of the log's.
        progress: called with (bytes done, bytes in all).
        prismatic: the robot's prismatic joints, whose values are never angles.
        cache: folder that keeps decoded logs; the next reading of the same bytes with the same settings is then
            only a hash and a load. None keeps nothing.

    Returns:
        Joint signals in SI units in the robot's joint order, stamps as recorded.

    Raises:
        LogError: the log cannot be read or holds no joint signals of this robot.
        ConfigError: the configuration is ambiguous or contradicts itself.
    """
    for path in paths:
        if not path.exists():
            raise LogError("there is no such file or folder", where=str(path))
    if cache is None:
        return _read(paths, settings, robot_joints, prismatic, progress)
    from collaudit.core.logs.cache import cache_key, load, store

    names = [path.name for path in paths]
    key = cache_key(sha256_of([*paths, *_also(paths, settings)]), names, settings, robot_joints, prismatic)
    found = load(cache, key)
    if found is None:
        found = _read(paths, settings, robot_joints, prismatic, progress)
        try:
            store(cache, key, found)
        except OSError as error:
            raise ConfigError(f"the cache cannot be written: {error.strerror}", where=str(cache)) from error
    return found


def _also(paths: Sequence[Path], settings: LogConfig) -> list[Path]:
    """The further CSV files of the configuration, on which the result depends too."""
    if not settings.csv.also or not all(is_text(path) for path in paths):
        return []
    from collaudit.core.logs.csv.csv_log import also_files

    return also_files(paths, settings.csv)


def _read(
    paths: tuple[Path, ...],
    settings: LogConfig,
    robot_joints: Sequence[str] | None,
    prismatic: Sequence[str],
    progress: Callable[[int, int], None] | None,
) -> JointLog:
    texts = [is_text(path) for path in paths]
    hashing = Hashing(paths)
    try:
        if all(texts):
            from collaudit.core.logs.csv.csv_reading import read_csv_log

            try:
                log = read_csv_log(paths, settings, robot_joints, prismatic, hashing)
            except LogError as error:
                raise misnamed(paths[0], error) from error
        elif any(texts):
            raise LogError("tables and recordings cannot be one log", where=log_name(paths))
        else:
            from collaudit.core.logs.messages.message_reading import read_message_log

            log = read_message_log(paths, settings, robot_joints, prismatic, hashing, progress)
    except BaseException:
        hashing.abandon()
        raise
    hashing.start()
    return log
