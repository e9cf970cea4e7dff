"""What is in a log, for `inspect`: never fails on a readable file, whatever it holds."""

from __future__ import annotations

from pathlib import Path

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.log_formats import is_table
from collaudit.core.logs.log_summary import LogSummary
from collaudit.core.logs.message_description import describe_by_overview, describe_messages
from collaudit.core.logs.opening import check_there, data_files, log_name, misnamed, open_messages
from collaudit.core.logs.storage.reading_bounds import ReadingBounds
from collaudit.core.logs.table_description import describe_tables


def describe(paths: tuple[Path, ...], settings: LogConfig | None = None) -> LogSummary:
    """Say what is in a log.

    Args:
        paths: one file or bag folder, or several tables of one log.
        settings: column patterns of tables; common names are recognised without.

    Raises:
        LogError: a file cannot be read at all, or is of no known format.
    """
    check_there(paths)
    if all(is_table(path) for path in paths):
        try:
            return describe_tables(paths, settings)
        except LogError as error:
            raise misnamed(paths[0], error) from error
    summary = describe_by_overview(paths, settings)
    if summary is not None:
        return summary
    files = [file for path in paths for file in data_files(path)]
    bounds = ReadingBounds.of(files, log_name(paths), None if settings is None else settings.limits)
    reader = open_messages(paths, bounds)
    try:
        return describe_messages(paths, reader, settings, bounds)
    finally:
        reader.close()
