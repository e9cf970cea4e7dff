"""Text as a cell of a CSV that no spreadsheet takes for a formula."""

from __future__ import annotations

#: What a spreadsheet computes when a cell begins with it.
_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def text_cell(text: str) -> str:
    """Text of a log, a file or a setting for a cell; with an apostrophe before what would be a formula.

    Source: OWASP, CSV injection. Cells of numbers are no text and stay as they are.
    """
    return f"'{text}" if text.startswith(_FORMULA) else text
