"""Planes of several logs as one, against the plane of all their samples."""

from __future__ import annotations

import numpy as np
import pytest
from residual_audits import coloured

from collaudit.core.data.rule_study_result import STUDY_SCHEMA, RuleStudy
from collaudit.core.rule_study.alarm_grid import GAMMAS, alarm_grid, excess, grid_gammas
from collaudit.core.rule_study.joint_plane import JointSeries, joint_plane, pooled_planes


def series(residual: np.ndarray) -> JointSeries:
    return JointSeries(residual, np.zeros(residual.size), np.ones(residual.size, dtype=bool), 0.002, 100)


def test_alarms_of_two_logs_add_up_exactly() -> None:
    logs = [scale * coloured(seed, 60.0)[:, 0] for seed, scale in ((1, 1.0), (2, 3.0))]
    planes = [joint_plane(series(x), 2.0, 13, None) for x in logs]
    studies = [RuleStudy(STUDY_SCHEMA, str(k), str(k), 0.002, joints={"j": p}) for k, p in enumerate(planes)]
    pooled = pooled_planes(studies)["j"]
    assert len(pooled.gamma_nm) > 0.5 * GAMMAS and pooled.n == planes[0].n
    assert pooled.clean_hours == pytest.approx(2 / 60.0)
    gammas, counts = np.array(pooled.gamma_nm), np.array(pooled.n)
    every = sum(alarm_grid(excess(x, np.zeros(x.size), np.ones(x.size, bool)), gammas, counts, 100) for x in logs)
    assert np.array_equal(np.array(pooled.alarms), every) and np.max(every) > 10
    assert pooled.configured is not None and pooled.configured.alarms == sum(
        p.configured.alarms for p in planes if p.configured
    )
    assert pooled_planes(studies[:1])["j"] == planes[0]


@pytest.mark.parametrize("largest", [0.3, 3.0, 300.0, 3e5])
def test_grids_enclose_what_is_asked_and_share_thresholds(largest: float) -> None:
    base, other = grid_gammas(0.1, [4.0], 1.0), grid_gammas(0.13, [4.0], largest)
    assert other.size == GAMMAS and other[0] <= 0.5 * 0.13 and other[-1] >= 2.5 * max(4.0, largest)
    shared = {f"{x:.5g}" for x in base} & {f"{x:.5g}" for x in other}
    assert len(shared) >= 5
