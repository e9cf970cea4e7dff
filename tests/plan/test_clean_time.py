"""Clean hours: what runs say of thresholds now, with more of the same, and how much more a threshold needs."""

from __future__ import annotations

import pytest
from residual_audits import audit_of, coloured

from collaudit.core.plan.prediction import clean_times
from collaudit.core.recommend.arm_recommendation import recommend_arm


def test_more_clean_hours_narrow_the_threshold_down() -> None:
    audits = [audit_of(coloured(seed, 600.0), name=f"{seed}.mcap") for seed in (1, 2)]
    per_hour = 0.05
    recommended = recommend_arm(audits, per_hour=per_hour).joints["joint1"].gamma_nm
    found = clean_times(["joint1"], audits, None, per_hour, 10.0, None)["joint1"]
    assert found.gamma_nm == recommended  # the same answer as collaudit recommend gives
    assert found.gamma_after_nm is not None and found.gamma_nm is not None
    assert found.gamma_after_nm <= found.gamma_nm
    assert found.hours == pytest.approx(1200.0 / 3600.0, rel=0.02)
    assert found.hours_for_rate == pytest.approx(59.9, rel=1e-3)  # none in them is at most one in 20 h
    easy = clean_times(["joint1"], audits, None, per_hour, 0.0, 1.01 * found.gamma_nm)["joint1"]
    assert easy.hours_for_gamma == pytest.approx(found.hours)
    never = clean_times(["joint1"], audits, None, per_hour, 0.0, 0.1)["joint1"]
    assert never.hours_for_gamma is None  # the residual itself is larger


def test_without_runs_only_hours_are_said() -> None:
    found = clean_times(["joint1"], [], None, 1e-3, 0.1, 4.0)["joint1"]
    assert (found.hours, found.gamma_nm, found.gamma_after_nm, found.hours_for_gamma) == (0.0, None, None, None)
    assert found.hours_for_rate == pytest.approx(2995.7, rel=1e-3)
