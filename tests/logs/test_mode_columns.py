"""A controller's mode in a table's columns: what it says of stops, guiding and power."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.logs.signals.annotation_spans import mode_annotations, mode_columns


def states(name: str, cells: list[str]) -> dict[str, tuple[tuple[float, float], ...]]:
    rows = np.arange(len(cells), dtype=np.int64)
    found = mode_annotations({name: cells}, rows, rows.astype(float), "log.csv")
    return {annotation.name: annotation.intervals_s for annotation in found}


def test_columns_are_known_by_name() -> None:
    names = ["timestamp", "actual_q_0", "robot_mode", "safety_mode", "mode", "/rtde.safety_status"]
    assert mode_columns(names) == ("robot_mode", "safety_mode", "/rtde.safety_status")


@pytest.mark.parametrize(
    ("name", "cells", "expected"),
    [
        ("safety_mode", ["1", "1", "3", "3", "1"], {"protective_stop": ((2.0, 3.0),)}),
        ("safety_mode", ["1.0", "3.0", "1.0"], {"protective_stop": ((1.0, 1.0),)}),
        ("robot_mode", ["7", "6", "7", "5", "3"], {"backdrive": ((1.0, 1.0),), "power_off": ((3.0, 4.0),)}),
        ("robot_mode", ["2", "2", "4", "3"], {"reflex": ((2.0, 2.0),), "guiding": ((3.0, 3.0),)}),
        ("robot_mode", ["kMove", "kReflex", "kMove"], {"reflex": ((1.0, 1.0),)}),
        ("robot_mode", ["RUNNING", "BACKDRIVE"], {"backdrive": ((1.0, 1.0),)}),
        ("safety_mode", ["NORMAL", "PROTECTIVE_STOP"], {"protective_stop": ((1.0, 1.0),)}),
        ("robot_mode", ["2", "1", ""], {}),
    ],
)
def test_values_mean_states(name: str, cells: list[str], expected: dict[str, tuple[tuple[float, float], ...]]) -> None:
    assert states(name, cells) == expected
