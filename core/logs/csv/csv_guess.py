"""A configuration for CSV files, guessed from the names of their columns."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from collaudit.core.errors import LogError
from collaudit.core.logs.csv.csv_columns import QUANTITIES, Found
from collaudit.core.logs.csv.csv_log import CsvFile, open_csvs
from collaudit.core.logs.log_reading import is_text

if TYPE_CHECKING:
    from collaudit.core.config.schema import CsvConfig


def guess_csv_columns(paths: Sequence[Path]) -> tuple[CsvConfig, tuple[str, ...]] | None:
    """Column patterns and joint names recognised in CSV files.

    Args:
        paths: the files of one log.

    Returns:
        A configuration that reads them without guessing, and the joints as the columns name them; None when no
        position columns are recognised.
    """
    from collaudit.core.config.schema import CsvConfig

    if not all(path.is_file() and is_text(path) for path in paths):
        return None
    try:
        files = open_csvs(paths, CsvConfig())
    except LogError:
        return None
    found = {q: parts for q in QUANTITIES if (parts := _parts(files, q))}
    if "position" not in found:
        return None
    patterns = {quantity: _pattern(parts) for quantity, parts in found.items()}
    time = next((_column(file, file.assignment.time) for file in files if file.assignment.time is not None), None)
    joints = tuple(dict.fromkeys(joint for _, part in found["position"] for joint in part.joints))
    config = CsvConfig.model_validate(
        {"time": time, **patterns, "delimiter": files[0].dialect.delimiter, "decimal": files[0].dialect.decimal}
    )
    return config, joints


def _parts(files: Sequence[CsvFile], quantity: str) -> list[tuple[CsvFile, Found]]:
    return [(file, file.assignment.quantities[quantity]) for file in files if quantity in file.assignment.quantities]


def _pattern(parts: Sequence[tuple[CsvFile, Found]]) -> str | list[str]:
    patterns = {found.pattern for _, found in parts}
    if len(patterns) == 1:
        return patterns.pop()
    return [_column(file, column) for file, found in parts for column in found.columns]


def _column(file: CsvFile, index: int) -> str:
    return file.dialect.names[index]
