"""What a controller's own flags mean for judging: the arm was stopped, guided by hand, or its drives were off."""

from __future__ import annotations

import re
from typing import Literal

StateKind = Literal["stopped", "guided", "off"]

#: Names of flags, letters only and in lower case.
_NAMES: dict[StateKind, frozenset[str]] = {
    "stopped": frozenset(
        {"protectivestop", "robotprotectivestop", "safeguardstop", "emergencystop", "userstop", "userstopped", "reflex",
         "jointreflex", "cartesianreflex", "safetystop", "stopcategory0", "stopcategory1", "estop"}
    ),
    "guided": frozenset({"guiding", "handguiding", "freedrive", "backdrive", "leadthrough", "zerog"}),
    "off": frozenset({"poweroff", "drivesoff", "brakeson", "motorsoff"}),
}  # fmt: skip

WORDS: dict[StateKind, str] = {
    "stopped": "stopped by its controller",
    "guided": "guided by hand",
    "off": "without power at its drives",
}


def state_of(flag: str) -> StateKind | None:
    """The state that a flag of this name stands for; None for any other flag."""
    letters = re.sub(r"[^a-z0-9]", "", flag.lower())
    return next((kind for kind, names in _NAMES.items() if letters in names), None)
