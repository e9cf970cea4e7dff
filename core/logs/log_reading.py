"""Reading one log as joint signals (topics chosen, joints mapped, units applied), and the hash of its bytes."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import ConfigError, LogError
from collaudit.core.findings import Finding
from collaudit.core.logs.log_formats import (
    check_there,
    data_files,
    is_table,
    log_name,
    misnamed,
    open_messages,
    open_tables,
)
from collaudit.core.logs.signals.joint_values import without_impossible
from collaudit.core.logs.storage.bounded_reading import ReadingBounds
from collaudit.core.numeric.parallel import Progress, begun


class Hashing:
    """The sha256 of files, computed in a thread while they are read. Copied and pickled it is the hash itself.

    It is made before the files are read. Where they have changed by the time that it is asked for, it may be of other
    bytes than were read: it is refused with a LogError.
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        self._paths = tuple(paths)
        self._state: _State | None = None
        with contextlib.suppress(OSError, LogError):  # who reads them will say it better
            self._state = _state_of(paths)
        self._result = begun(partial(sha256_of, self._paths))

    def result(self) -> str:
        """The hash."""
        return self._hash

    @cached_property
    def _hash(self) -> str:
        found = self._result()
        try:
            after = _state_of(self._paths)
        except OSError as error:
            raise LogError(f"cannot be read: {error.strerror}", where=str(error.filename)) from error
        if self._state is not None and self._state != after:
            changed = sorted({name for name, *_ in set(self._state) ^ set(after)})
            raise LogError(
                "the log has changed while it was read",
                where=changed[0],
                found="another size or time of change than when reading began",
                hint="judge it when its recording has ended",
            )
        return found

    def __reduce__(self) -> tuple[type[str], tuple[str]]:
        return str, (self.result(),)


#: Of each file its name, size, time of change in ns, and inode.
_State = list[tuple[str, int, int, int]]


def _state_of(paths: Sequence[Path]) -> _State:
    """What shows that files have changed."""
    files = [file for path in paths for file in data_files(path)]
    return [(str(file), (found := file.stat()).st_size, found.st_mtime_ns, found.st_ino) for file in files]


def sha256_of(paths: Sequence[Path]) -> str:
    """Hash of a file's bytes; of several files, the hash of their hashes in the order of their names.

    Raises:
        LogError: a file cannot be read.
    """
    files = sorted((file for path in paths for file in data_files(path)), key=lambda file: (file.name, str(file)))
    hashes = [_file_hash(file) for file in files]
    if len(hashes) == 1:
        return hashes[0]
    return hashlib.sha256("".join(hashes).encode("ascii")).hexdigest()


def _file_hash(path: Path) -> str:
    try:
        with path.open("rb", buffering=0) as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise LogError(f"cannot be read: {error.strerror}", where=str(path)) from error


def read_log(
    paths: tuple[Path, ...],
    settings: LogConfig,
    *,
    robot_joints: Sequence[str] | None,
    progress: Progress | None = None,
    prismatic: Sequence[str] = (),
    judged: Sequence[str] = (),
) -> JointLog:
    """Read one log.

    Args:
        paths: one file or bag folder, or several tables with the same time column.
        settings: topics, names, clock and units.
        robot_joints: the robot's joints in model order; None keeps all of the log's.
        progress: called with (bytes done, bytes in all).
        prismatic: the robot's prismatic joints, whose values are never angles.
        judged: the joints that ``[robot] joints`` states; a log of as many, under other names, is theirs.

    Returns:
        Joint signals in SI units in the robot's joint order, stamps as recorded.

    Raises:
        LogError: the log cannot be read or holds no joint signals of this robot.
        ConfigError: the configuration is ambiguous or contradicts itself.
    """
    check_there(paths)
    tables = [is_table(path) for path in paths]
    hashing = Hashing(paths)
    if all(tables):
        log = without_impossible(_read_tables(paths, settings, robot_joints, prismatic, judged, hashing), "row")
    elif any(tables):
        raise LogError("tables and recordings cannot be one log", where=log_name(paths))
    else:
        from collaudit.core.logs.topics.message_reading import read_message_log

        name = log_name(paths)
        bounds = ReadingBounds.of([file for path in paths for file in data_files(path)], name, settings.memory_gb)
        reader = open_messages(paths, bounds)
        log = read_message_log(reader, name, settings, robot_joints, prismatic, judged, hashing, progress, bounds)
        log = without_impossible(log, "message")
    return part_of_log(log, settings.from_s, settings.to_s)


def part_of_log(log: JointLog, from_s: float | None, to_s: float | None) -> JointLog:
    """The samples between two times; a finding says so, since what a part shows does not hold for the rest.

    Args:
        log: as recorded; its times stay those from its first sample.
        from_s, to_s: bounds, s from the log's first sample; None: none.

    Raises:
        ConfigError: the first is not before the second. LogError: there is no sample between them.
    """
    if from_s is None and to_s is None:
        return log
    start, end = from_s or 0.0, np.inf if to_s is None else to_s
    if start >= end:
        where, expected = "[log] from_s, to_s (--from, --to)", "a part that begins before it ends"
        raise ConfigError(
            "nothing lies between these times", where=where, found=f"{start:g} to {end:g} s", expected=expected
        )
    rows = np.asarray((log.time_s >= start) & (log.time_s < end))
    whole = float(np.nanmax(log.time_s))
    asked = f"{start:g} to {min(end, whole):g} s"
    if not rows.any():
        expected = f"a part of 0 to {whole:g} s"
        raise LogError("the log has no sample there", where=log.source.name, found=asked, expected=expected)
    text = f"Only {asked} of the {whole:.4g} s of the log were read, as asked for."
    return replace(log.samples(rows), findings=(*log.findings, Finding("part-of-log", "warning", text)))


def _read_tables(
    paths: tuple[Path, ...],
    settings: LogConfig,
    robot_joints: Sequence[str] | None,
    prismatic: Sequence[str],
    judged: Sequence[str],
    hashing: Hashing,
) -> JointLog:
    from collaudit.core.logs.tables.table_reading import read_table_log

    try:
        readers = open_tables(paths, settings.csv)
        bounds = ReadingBounds.of(paths, log_name(paths), settings.memory_gb)
        bounds.check_columns(sum(len(reader.names) for reader in readers))
        return read_table_log(readers, log_name(paths), settings, robot_joints, prismatic, judged, hashing, bounds)
    except LogError as error:
        raise misnamed(paths[0], error) from error
