"""Reading one log as joint signals: topics chosen, joints mapped by name, units applied, clock chosen."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import LogError
from collaudit.core.logs.log_formats import is_table
from collaudit.core.logs.log_hashing import Hashing
from collaudit.core.logs.opening import (
    also_files,
    check_there,
    data_files,
    log_name,
    misnamed,
    open_messages,
    open_tables,
)
from collaudit.core.logs.signals.impossible_values import without_impossible
from collaudit.core.logs.storage.reading_bounds import ReadingBounds
from collaudit.core.numeric.stage_progress import Progress


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
        bounds = ReadingBounds.of([file for path in paths for file in data_files(path)], name, settings.limits)
        reader = open_messages(paths, bounds)
        log = read_message_log(reader, name, settings, robot_joints, prismatic, judged, hashing, progress, bounds)
        log = without_impossible(log, "message")
    return log


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
        files = [*paths, *also_files(paths, settings.csv)]
        readers = open_tables(files, settings.csv)
        bounds = ReadingBounds.of(files, log_name(paths), settings.limits)
        bounds.check_columns(sum(len(reader.names) for reader in readers))
        return read_table_log(readers, log_name(paths), settings, robot_joints, prismatic, judged, hashing, bounds)
    except LogError as error:
        raise misnamed(paths[0], error) from error
