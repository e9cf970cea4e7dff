"""A threshold within the model's own error makes alarms doubtful."""

from __future__ import annotations

import pytest

from collaudit.core.data.audit_result import ResidualStats
from collaudit.core.detection.detection_findings import residual_level_findings


@pytest.mark.parametrize(("mean_nm", "said"), [(1.9, False), (2.1, True), (None, False)])
def test_a_residual_above_half_the_threshold_doubts_alarms(mean_nm: float | None, said: bool) -> None:
    stats = {"a": ResidualStats(9.0, 9.0, 9.0, 9.0, 60.0, mean_nm, 50.0), "unwatched": ResidualStats(*[9.0] * 7)}
    found = residual_level_findings(stats, {"a": 4.0})
    assert [(f.code, f.joint, f.effect) for f in found] == [("residual-level", "a", "doubts-alarms")] * said
