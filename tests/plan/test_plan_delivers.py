"""A planned motion determines what was open: friction of a simulated arm whose truth is known."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("ruckig")
sys.path.append(str(Path(__file__).parents[1] / "bench"))

from plan_arm import PERIOD_S, arm_named, of_arrays, short_run, write_run

from collaudit.core import api
from collaudit.core.data.audit_result import Provenance
from collaudit.core.errors import ConfigError
from collaudit.core.plan.planning import PlanRequest, make_plan
from collaudit.core.plan.prediction import delivered

JOINT = "joint2"


@pytest.mark.slow
def test_what_was_open_is_determined(tmp_path: Path) -> None:
    """Two joints swept at once: fast strokes of an earlier log do not tell what friction does near standstill."""
    arm, joints = arm_named("paper6", tmp_path), (JOINT, "joint4")
    log, settings = write_run(arm, short_run(arm, (1, 3)), 11, tmp_path / "earlier.mcap")
    before = api.fit([(log,)], settings)
    assert not any(before.joints[joint].identifiable for joint in joints)
    request = PlanRequest(minutes=1.4, joints=joints)
    plan = make_plan(settings, before, [], request, Provenance("0", {}))
    _, q, v, a = plan.motion.sampled(PERIOD_S)
    planned, _ = write_run(arm, of_arrays(q, v, a), 12, tmp_path / "planned.mcap")
    after = api.fit([(log,), (planned,)], settings)
    assert [min(sweeps.speeds_rad_s) < 0.05 for sweeps in plan.file.sweeps] == [True, True]
    for joint in joints:
        fit, truth = after.joints[joint], arm.friction[arm.joints.index(joint)].parameters()
        assert fit.identifiable and truth is not None
        assert sum(p.source == "pair" and p.others_moving for p in fit.points) >= 10
        for key, value in truth.items():
            low, high = fit.ci95[key] or (None, None)
            assert low is not None and high is not None
            assert low - 0.5 * (high - low) < value < high + 0.5 * (high - low)
        found = {one.parameter: one for one in delivered(plan.file, after) if one.joint == joint}
        for symbol in "ABCD":
            assert found[symbol].outcome != "not told"
        assert found["D"].delivered is not None and found["D"].predicted is not None
        assert 1 / 3 < found["D"].delivered / found["D"].predicted < 3


def test_what_was_guessed_is_predicted_as_a_share_and_another_arm_is_refused(tmp_path: Path) -> None:
    from dataclasses import replace

    arm = arm_named("paper6", tmp_path)
    log, settings = write_run(arm, short_run(arm, (1,)), 11, tmp_path / "earlier.mcap")
    fit = api.fit([(log,)], settings)
    plan = make_plan(settings, fit, [], PlanRequest(minutes=0.4, joints=(JOINT,)), Provenance("0", {})).file
    own = {one.parameter: one for one in plan.predictions if one.joint == JOINT}
    predicted = {one.parameter: one.predicted for one in delivered(plan, fit) if one.joint == JOINT}
    found = fit.joints[JOINT].parameters["A_nm"]  # A was guessed, and its half width is predicted as a share
    assert own["A"].guessed and own["A"].after and own["A"].value
    assert predicted["A"] == pytest.approx(own["A"].after * found / own["A"].value)
    stranger = replace(plan, limits={"elsewhere": plan.limits[JOINT]})
    with pytest.raises(ConfigError, match="another arm"):
        delivered(stranger, fit)


def test_information_of_points_gives_the_half_widths_of_a_linear_fit() -> None:
    """Against the textbook: s²(XᵀX)⁻¹ of a straight line."""
    from collaudit.core.friction_laws.law_registry import LAWS
    from collaudit.core.plan.friction_design import FrictionDesign

    line = LAWS["coulomb-viscous"]
    speeds = np.array([0.1, 0.2, 0.4, 0.8, 1.0])
    design = FrictionDesign(line, ({"A": 2.0, "D": 3.0},), np.zeros((1, 2, 2)), 0, 0.1, 0.0, True)
    added = sum(design.information(float(v), 4.0) for v in speeds)  # 0.1 of a second is 0.05 of four
    x = np.column_stack([np.ones(5), speeds])
    expected = 3.182446 * 0.05 * np.sqrt(np.diag(np.linalg.inv(x.T @ x)))  # Student's t, 3 degrees of freedom
    found = design.half_widths(np.asarray(added), 5)
    assert np.allclose([found["A"], found["D"]], expected, rtol=1e-4)


def test_gains_are_what_points_take_off_the_relative_variances() -> None:
    """Against the variances themselves, with the point and without."""
    from collaudit.core.friction_laws.law_registry import REFERENCE
    from collaudit.core.plan.friction_design import FrictionDesign

    values = {"A": 7.0, "B": 2.5, "C": 26.0, "D": 17.0}
    design = FrictionDesign(REFERENCE, (values,), np.zeros((1, 4, 4)), 0, 0.05, 0.01, True)
    speeds = np.array([0.01, 0.04, 0.1, 0.4, 1.0])
    added = np.asarray(sum(design.information(float(v), 1.0) for v in speeds))
    asked, seconds = np.array([0.02, 0.06, 0.5]), np.array([2.0, 1.0, 0.5])

    def variances(information: np.ndarray) -> float:
        size = np.array(list(values.values()))
        return float(np.sum(np.diag(np.linalg.inv(information[0])) / size**2))

    expected = [
        variances(added) - variances(added + design.information(float(v), float(t)))
        for v, t in zip(asked, seconds, strict=True)
    ]
    assert np.allclose(design.gains(design.gradients(asked, seconds), added), expected, rtol=1e-5)
