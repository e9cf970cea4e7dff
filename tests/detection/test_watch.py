"""Which joints are watched, why, and how a user overrides it; eq. (1) with its times: on a simulated polishing run."""

from __future__ import annotations

from pathlib import Path

import pytest
from origins import NOBODY

from collaudit.core.api import prepare
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.errors import ConfigError


def audited(log: Path, friction: FrictionFile, **settings: object) -> AuditResult:
    loaded = load_config(log.with_suffix(".toml"), {k.replace("__", "."): v for k, v in settings.items()})
    return audit_log(prepare((log,), loaded), loaded.config, friction, NOBODY, siblings=None).result


def test_force_controlled_joints_are_lumped_and_a_neighbour_watches(polishing: Path, friction: FrictionFile) -> None:
    result = audited(polishing, friction, phases__force_control=[[24.0, 52.9]])
    joints = result.coverage.joints
    assert "force-controlled in contact" in joints["joint2"].why
    assert "joint1, position-controlled, watches it" in joints["joint2"].why
    assert "also watches the links of joint2" in joints["joint1"].why
    assert joints["joint2"].not_judged_s["not-watched"] == pytest.approx(28.0, abs=0.1)
    assert "not-watched" not in joints["joint1"].not_judged_s
    said = [f for f in result.findings if f.code == "coverage-low" and f.joint == "joint2"]
    assert len(said) == 1
    early = [f for f in result.findings if f.code == "log-label-missing"]
    assert [(f.start_s, f.end_s) for f in early] == [pytest.approx((24.0, 25.0), abs=0.01)]
    assert {c.joint for c in result.collisions} == {"joint1"}


def test_the_choice_can_be_overridden(polishing: Path, friction: FrictionFile) -> None:
    result = audited(polishing, friction, detect__watch=["joint1", "joint2"])
    assert result.rule.watch == ("joint1", "joint2")
    assert result.coverage.joints["joint2"].why == "named in [detect] watch"
    assert "not-watched" not in result.coverage.joints["joint2"].not_judged_s
    assert result.coverage.joints["joint3"].judged_s == 0.0
    with pytest.raises(ConfigError, match="watched joint"):
        audited(polishing, friction, detect__watch=["joint9"])
