"""Messages about names that a model does not have."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from collaudit.core.errors import RobotError


def unknown_name(message: str, where: str, found: str, known: Sequence[str]) -> RobotError:
    """An error that lists the known names and suggests the closest."""
    close = difflib.get_close_matches(found, known, n=1)
    return RobotError(
        message,
        where=where,
        found=repr(found),
        expected="one of " + ", ".join(known) if known else None,
        hint=f"did you mean {close[0]!r}?" if close else None,
    )
