"""Columns in which a controller writes its own mode: stopped, guided by hand, without power."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from collaudit.core.data.joint_log import Annotation
from collaudit.core.logs.signals.annotation_spans import spans_of
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.vendors.controller_modes import (
    FRANKA_MODE,
    MODE_WORDS,
    ROBOT_COLUMNS,
    SAFETY_COLUMNS,
    UR_ROBOT_MODE,
    UR_RUNNING,
    UR_SAFETY_MODE,
)


def mode_columns(names: Sequence[str]) -> tuple[str, ...]:
    """The columns of a table that hold a mode, by their names."""
    return tuple(name for name in names if _letters(name).endswith((*SAFETY_COLUMNS, *ROBOT_COLUMNS)))


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
        # whole numbers without their decimals
        values = np.array([texts[name][row].strip().removesuffix(".0") for row in rows.tolist()], dtype=object)
        meaning = _meaning(name, set(values.tolist()))
        for state in dict.fromkeys(meaning.values()):
            holds = np.array([meaning.get(value) == state for value in values.tolist()], dtype=np.bool_)
            if holds.any():
                out.append(Annotation(state, f"{where}, column {name.strip()}", tuple(spans_of(stamps, holds))))
    return out


def _meaning(name: str, values: set[str]) -> dict[str, str]:
    """Value to state. A robot_mode that is ever 7, running, is UR's; libfranka's stays below."""
    of_robot = UR_ROBOT_MODE if str(UR_RUNNING) in values else FRANKA_MODE
    states = UR_SAFETY_MODE if _letters(name).endswith(SAFETY_COLUMNS) else of_robot
    bare = {value: _letters(value).removeprefix("robotmode").removeprefix("k") for value in values}
    words = {value: MODE_WORDS[word] for value, word in bare.items() if word in MODE_WORDS}
    return {**{str(number): state for number, state in states.items()}, **words}


def _letters(text: str) -> str:
    return re.sub(r"[^a-z]", "", text.lower())
