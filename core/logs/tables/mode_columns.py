"""Columns in which a controller writes its own mode: stopped, guided by hand, without power."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from collaudit.core.data.joint_log import Annotation
from collaudit.core.logs.signals.annotation_spans import spans_of
from collaudit.core.numeric.arrays import FloatArray, IntArray

#: Values of UR's safety_mode and robot_mode (RTDE), and of libfranka's robot_mode; other values are ordinary.
_UR_SAFETY = {"3": "protective_stop", "5": "safeguard_stop", "6": "emergency_stop", "7": "emergency_stop",
              "8": "safety_stop", "9": "safety_stop"}  # fmt: skip
_UR_ROBOT = {"3": "power_off", "4": "power_off", "5": "power_off", "6": "backdrive"}
_UR_RUNNING = "7"
_FRANKA = {"3": "guiding", "4": "reflex", "5": "user_stop"}
#: The same in words, letters only and in lower case, libfranka's with and without their k.
_WORDS = {"protectivestop": "protective_stop", "safeguardstop": "safeguard_stop", "emergencystop": "emergency_stop",
          "robotemergencystop": "emergency_stop", "systememergencystop": "emergency_stop", "poweroff": "power_off",
          "backdrive": "backdrive", "freedrive": "freedrive", "guiding": "guiding", "handguiding": "guiding",
          "reflex": "reflex", "userstopped": "user_stop"}  # fmt: skip
_SAFETY, _ROBOT = ("safetymode", "safetystatus"), ("robotmode",)


def mode_columns(names: Sequence[str]) -> tuple[str, ...]:
    """The columns of a table that hold a mode, by their names."""
    return tuple(name for name in names if _letters(name).endswith((*_SAFETY, *_ROBOT)))


def mode_annotations(
    texts: Mapping[str, Sequence[str]], rows: IntArray, stamps: FloatArray, where: str
) -> list[Annotation]:
    """The states that mode columns tell, one annotation each.

    Args:
        texts: column name to the text of each row.
        rows: (k,) rows with a stamp, in time order.
        stamps: (k,) s.
        where: the file.
    """
    out = []
    for name in mode_columns(list(texts)):
        values = np.array([_value(texts[name][row]) for row in rows.tolist()], dtype=object)
        meaning = _meaning(name, set(values.tolist()))
        for state in dict.fromkeys(meaning.values()):
            holds = np.array([meaning.get(value) == state for value in values.tolist()], dtype=np.bool_)
            if holds.any():
                out.append(Annotation(state, f"{where}, column {name.strip()}", tuple(spans_of(stamps, holds))))
    return out


def _meaning(name: str, values: set[str]) -> dict[str, str]:
    """Value to state. A robot_mode that is ever 7, running, is UR's; libfranka's stays below."""
    letters = _letters(name)
    numbers = _UR_SAFETY if letters.endswith(_SAFETY) else _UR_ROBOT if _UR_RUNNING in values else _FRANKA
    words = {value: _WORDS[key] for value in values if (key := _letters(value).removeprefix("robotmode")) in _WORDS}
    words |= {value: _WORDS[key] for value in values if (key := _letters(value).removeprefix("k")) in _WORDS}
    return {**numbers, **words}


def _value(text: str) -> str:
    """The cell, whole numbers without their decimals."""
    cell = text.strip()
    return cell.removesuffix(".0")


def _letters(text: str) -> str:
    return re.sub(r"[^a-z]", "", text.lower())
