"""Memory follows what was recorded, not how long it took: a gap of years takes none."""

from __future__ import annotations

import tracemalloc

import numpy as np
from arms import dh_robot, dh_row
from synthetic import make_log

from collaudit.core.config.schema import Config
from collaudit.core.prepare.hand_guiding import rough_friction
from collaudit.core.prepare.preparation import conditioned, modelled
from collaudit.core.robot.robot_building import build_robot

YEARS_S = 3e8
T = 0.002 * np.arange(6000)


def test_a_gap_of_years_takes_no_memory(tmp_path) -> None:  # type: ignore[no-untyped-def]
    names = ("joint1", "joint2")
    rows = [dh_row(1.0, (0, 0, 0), (0.1, 0.1, 0.1), a=0.3) for _ in names]
    config = Config.of({"robot": dh_robot(rows)}, tmp_path)
    stamps = T + np.where(np.arange(T.size) >= 3000, YEARS_S, 0.0)
    q = np.column_stack([np.sin(T), 0.5 * np.cos(1.7 * T)])
    v = np.column_stack([np.cos(T), -0.85 * np.sin(1.7 * T)])
    log = make_log(stamps, q, v, 2.0 * np.sign(v) + v, names)
    prepared = modelled(conditioned(log, build_robot(config.robot, tmp_path, names), config), config, None)
    tracemalloc.start()
    found = rough_friction(prepared)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert set(found) <= set(names)
    assert most < 100e6
