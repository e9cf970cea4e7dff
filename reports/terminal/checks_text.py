"""The checks of an installation for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.reports.terminal.text_table import table


def checks_text(checks: Sequence[tuple[bool, str, str, str, str]], width: int | None = None) -> str:
    """One line a check, then how many passed.

    Args:
        checks: of each, whether it passed, the robot, what was checked, what was wanted, what was found.
        width: columns of the terminal that the table is cut to; None: any.
    """
    lines = [("ok" if passed else "WRONG", *cells) for passed, *cells in checks]
    passed = sum(check[0] for check in checks)
    head = ("", "robot", "check", "wanted", "found")
    return table(head, lines, width=width, fold=True) + f"\n{passed} of {len(checks)} checks passed\n"
