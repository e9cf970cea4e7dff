"""The modes of controllers: which numbers and words stand for a stop, guiding by hand or drives without power."""

from __future__ import annotations

import re
from typing import Literal

StateKind = Literal["stopped", "guided", "off"]

#: Values of UR's safety_mode and robot_mode (RTDE, ur_dashboard_msgs), and of libfranka's robot_mode, by the state that
#: each stands for; other values are ordinary.
UR_SAFETY_MODE = {3: "protective_stop", 5: "safeguard_stop", 6: "emergency_stop", 7: "emergency_stop",
                  8: "safety_stop", 9: "safety_stop"}  # fmt: skip
UR_ROBOT_MODE = {3: "power_off", 4: "power_off", 5: "power_off", 6: "backdrive"}
FRANKA_MODE = {3: "guiding", 4: "reflex", 5: "user_stop"}
#: A robot_mode that is ever this is UR's: running.
UR_RUNNING = 7
#: The same in words, letters only and in lower case, libfranka's with and without their k.
MODE_WORDS = {"protectivestop": "protective_stop", "safeguardstop": "safeguard_stop", "emergencystop": "emergency_stop",
              "robotemergencystop": "emergency_stop", "systememergencystop": "emergency_stop", "poweroff": "power_off",
              "backdrive": "backdrive", "freedrive": "freedrive", "guiding": "guiding", "handguiding": "guiding",
              "reflex": "reflex", "userstopped": "user_stop"}  # fmt: skip
#: Ends of the names of columns that hold UR's safety mode, and a robot_mode, letters only and in lower case.
SAFETY_COLUMNS, ROBOT_COLUMNS = ("safetymode", "safetystatus"), ("robotmode",)

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
