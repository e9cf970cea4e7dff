"""A log that fails at a stated threshold which the fit's residual exceeds says so, with likely causes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from collaudit.core import api
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.recommendation_result import JointThreshold, ThresholdLevel
from collaudit.core.detection.fitted_rule import rise_findings
from collaudit.fixtures.simulation import SimulatedFiles

Maker = Callable[..., SimulatedFiles]
Fitted = Callable[[str], FrictionFile]


def asking(friction: FrictionFile, gamma_nm: float) -> FrictionFile:
    """The friction file, with this threshold on every joint."""
    assert friction.thresholds is not None
    level = ThresholdLevel(1, 0.002, gamma_nm, 0.01, (0.0, 1.0), margin=1.2)
    known = {joint: JointThreshold((level,), 1.0, 2.5, 1.0, 1.0, 1.0) for joint in friction.joints}
    return replace(friction, thresholds=replace(friction.thresholds, joints=known))


def test_a_threshold_below_the_clean_residual_is_said_with_its_remedy(made: Maker, friction_of: Fitted) -> None:
    files = made("free-hits", "paper6")
    settings = load_config(files.config, {"detect.gamma_nm": 4.0})
    result = api.audit(files.log, settings, asking(friction_of("paper6"), 7.5)).result
    found = {f.joint: f.text for f in result.findings if f.code == "gamma-too-tight"}
    assert set(found) == {f"joint{k}" for k in range(1, 7)}
    assert "4 N·m, is below" in found["joint2"]
    assert "7.5 N·m" in found["joint2"] and "payload that the model lacks" in found["joint2"]
    assert '"auto"' not in found["joint2"], "a higher threshold is no remedy"
    below = [c for c in result.collisions if c.joint == "joint2" and abs(c.peak_nm) < 7.5]
    alarms = [c for c in result.collisions if c.joint == "joint2"]
    assert f"{len(below)} of this joint's {len(alarms)} alarms" in found["joint2"]
    assert result.verdict == "fail"


def test_a_threshold_that_the_fit_supports_says_nothing(made: Maker, friction_of: Fitted) -> None:
    files = made("free-hits", "paper6")
    for gamma, asked in ((4.0, 4.7), (8.0, 7.5), ("auto", 7.5)):  # within the margin; above; the fit's own
        settings = load_config(files.config, {"detect.gamma_nm": gamma})
        result = api.audit(files.log, settings, asking(friction_of("paper6"), asked)).result
        assert "gamma-too-tight" not in {f.code for f in result.findings}


def test_thresholds_that_rise_from_one_fit_to_the_next_are_said(friction_of: Fitted) -> None:
    before, after = (asking(friction_of("paper6"), gamma).thresholds for gamma in (2.0, 4.1))
    (said,) = rise_findings(after, before)
    assert said.code == "fit-exceeded" and "joint2 2 to 4.1" in said.text
    assert not rise_findings(before, after)
    assert not rise_findings(asking(friction_of("paper6"), 3.9).thresholds, before)
