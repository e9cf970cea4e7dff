"""Messages about names that a model does not have."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.errors import RobotError, did_you_mean


def unknown_name(message: str, where: str, found: str, known: Sequence[str]) -> RobotError:
    """An error that lists the known names and suggests the closest."""
    return RobotError(
        message,
        where=where,
        found=repr(found),
        expected="one of " + ", ".join(known) if known else None,
        hint=did_you_mean(found, known),
    )
