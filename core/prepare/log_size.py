"""Whether a log fits into memory: one that does not is refused before it is judged."""

from __future__ import annotations

from collaudit.core.errors import NotJudgedError
from collaudit.core.numeric.linear_algebra import memory_bytes

#: So many tables of a log's size must fit in memory: an audit keeps twelve, and the columns that are worked on at the
#: same time take as much as six.
_AT_ONCE = 18


def refuse_larger_than_memory(rows: int, columns: int, name: str) -> None:
    """Refuse a log whose tables do not fit.

    Args:
        rows, columns: samples and joints.
        name: of the log.

    Raises:
        NotJudgedError: they do not.
    """
    needed, there = 8.0 * rows * columns * _AT_ONCE, memory_bytes()
    if needed > there:
        raise NotJudgedError(
            "the log is larger than memory allows to judge at once",
            where=name,
            found=f"{rows} samples of {columns} joints: {needed / 1e9:.3g} GB of tables",
            expected=f"at most {there / 1e9:.3g} GB",
            hint="judge it in parts: --set log.to_s=3600, then --set log.from_s=3600 --set log.to_s=7200",
        )
