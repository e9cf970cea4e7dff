"""The combined statistic: a push that no joint shows alone, named after the joint that shows most of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from origins import NOBODY

from collaudit.core.api import prepare
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.errors import ConfigError
from collaudit.core.residual.isolation import WholeArm


def test_every_joint_alone_alarms_at_its_threshold() -> None:
    share = np.zeros((500, 3))
    share[100:200, 2] = -9.0
    share[100:200, 0] = 4.0
    named = WholeArm(("a", "b", "c"), np.array([1.0, 0.1, 0.5]), share, 100)
    assert named.joint_of(0, 90) == "c"
    gamma = {"a": 6.0, "b": 0.5, "c": 4.0}
    assert named.judged_columns([0, 1, 2], gamma) == [1], "five of its standard deviations"
    assert named.judged_columns([0, 2], gamma) == [0]


def test_pushes_are_found_and_named(hits: Path, friction: FrictionFile) -> None:
    def alarms(detector: str) -> list[tuple[float, str]]:
        loaded = load_config(hits.with_suffix(".toml"), {"detect.detector": detector})
        found = audit_log(prepare((hits,), loaded), loaded.config, friction, NOBODY).result
        return [(c.onset_s, c.joint) for c in found.collisions]

    direct, combined = alarms("direct"), alarms("combined")
    assert combined
    near = [any(abs(t - at) < 0.5 for at, _ in combined) for t, _ in direct]
    assert np.mean(near) > 0.9, "nearly all that the joints show is in the norm"
    named = [any(abs(t - at) < 0.5 and joint == other for at, other in direct) for t, joint in combined]
    assert np.mean(named) > 0.6


def test_it_has_no_causal_form(hits: Path, friction: FrictionFile) -> None:
    loaded = load_config(hits.with_suffix(".toml"), {"detect.detector": "combined", "detect.causal": True})
    with pytest.raises(ConfigError, match="both ways"):
        audit_log(prepare((hits,), loaded), loaded.config, friction, NOBODY)
