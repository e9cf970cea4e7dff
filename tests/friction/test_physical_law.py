"""Friction laws stay within what friction can be, and data that want otherwise are told from noise."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.data.friction_result import FrictionFit, FrictionPoint, ModelComparison
from collaudit.core.friction.friction_fitting import fit_friction
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.joint_fits import friction_findings
from collaudit.core.friction.law_candidates import FrictionUnits
from collaudit.core.friction.law_comparison import choose
from collaudit.core.friction.motion_points import any_motion_tells_more, covered, distinct_speeds
from collaudit.core.friction.physical_law import drives
from collaudit.core.prepare.effort_gain import EffortGain

UNITS = FrictionUnits.of("revolute", "Nm")


def points(speeds: np.ndarray, curve, sd: float = 0.05, offset: float = 0.0, seed: int = 0) -> list[FrictionPoint]:  # type: ignore[no-untyped-def]
    """Points of both directions that rely on the robot model, whose error is ``offset``."""
    rng = np.random.default_rng(seed)
    return [
        FrictionPoint(float(v), float(curve(v) + way * offset + rng.normal(0, sd)), sd, sd, "model", way, False)
        for v in speeds
        for way in (1, -1)
    ]


def fitted(speeds: np.ndarray, curve, **more: float) -> FrictionFit:  # type: ignore[no-untyped-def]
    return fit_friction(points(speeds, curve, **more), UNITS, "coulomb-viscous")


def test_viscous_friction_is_never_negative_and_what_the_data_want_is_said() -> None:
    fit = fitted(np.linspace(0.25, 0.38, 12), lambda v: 6.0 - 5.7 * v)
    assert fit.parameters["D_nm_s_per_rad"] == 0.0
    assert fit.parameters["A_nm"] == pytest.approx(4.2, abs=0.1)  # the mean level, not the line's start
    assert fit.ci95["D_nm_s_per_rad"] == (0.0, 0.0)
    assert "D = -5" in fit.unphysical[0]
    assert next(f.code for f in friction_findings({"j": fit})) == "friction-not-physical"


def test_a_slope_within_its_uncertainty_of_zero_is_no_finding() -> None:
    fit = fitted(np.linspace(0.2, 2.0, 10), lambda v: 4.0 - 0.002 * v)
    assert fit.parameters["D_nm_s_per_rad"] >= 0.0
    assert fit.unphysical == ()
    low, high = fit.ci95["D_nm_s_per_rad"] or (None, None)
    assert low == 0.0
    assert high is not None
    assert high > 0.0


def test_friction_does_not_vanish_below_the_slowest_speed_measured() -> None:
    """Friction that levels off looks like a hyperbolic tangent whose fall towards rest lies below all points."""

    def level(v: float) -> float:
        return 8.0 + 12.0 * (1 - np.exp(-1.2 * v)) + 2.0 * v

    seen = fit_friction(points(np.geomspace(0.3, 2.0, 8), level, sd=0.25), UNITS, "auto")
    law = FrictionModel.of(seen)
    assert law is not None
    assert seen.model != "smooth-coulomb-viscous"
    assert float(law.torque(np.array([0.05]))[0]) > 5.0
    (row,) = (row for row in seen.comparison if row.model == "smooth-coulomb-viscous")
    assert "vanish below the slowest speed" in row.note
    fallen = fit_friction(points(np.geomspace(0.02, 2.0, 16), lambda v: 8 * np.tanh(6 * v) + v), UNITS, "auto")
    assert fallen.model == "smooth-coulomb-viscous"  # where slow points show it, it is taken


def test_breakaway_below_coulomb_is_not_taken() -> None:
    fit = fit_friction(points(np.geomspace(0.02, 2, 20), lambda v: 5 - 3 * np.exp(-8 * v) + v), UNITS, "auto")
    assert fit.model is not None
    refused = next(row for row in fit.comparison if row.model == "static-lugre")
    assert not refused.chosen
    assert "below Coulomb" in refused.note


def row(model: str, score: float, se: float, aicc: float) -> ModelComparison:
    return ModelComparison(model, 2.0, 0.15, 0.2, score, se, aicc, chosen=False, note="")


def test_a_law_that_misses_speeds_is_not_as_good_for_being_uncertain_of_it() -> None:
    """As of a UR3's last wrist, whose friction flattens with speed: the lines have 2.5 times the error."""
    wrist = [
        row("coulomb-viscous", 49.9, 23.5, 90.8),
        row("smooth-coulomb-viscous", 47.2, 22.2, 92.5),
        row("rbf", 2.89, 1.74, -14.8),
    ]
    assert choose(wrist, [True] * 3)[0] == 2
    within_noise = [row("coulomb-viscous", 1.2, 0.5, 8.0), row("rbf", 0.25, 0.1, 7.0)]
    assert choose(within_noise, [True] * 2)[0] == 0


@pytest.mark.parametrize("offset", [0.0, 8.0])
def test_inverted_effort_is_told_from_an_error_of_gravity(offset: float) -> None:
    speeds = np.linspace(0.1, 1.5, 10)
    assert drives(points(speeds, lambda v: -6.8 - 3.1 * v, offset=offset))
    assert not drives(points(speeds, lambda v: 6.8 + 3.1 * v, offset=offset))
    fit = fitted(speeds, lambda v: -6.8 - 3.1 * v, offset=offset)
    assert not fit.dissipates
    assert "inverted" in friction_findings({"j": fit})[0].text
    right_gravity = EffortGain("j", 0.9, (0.8, 1.0), 0.9)
    said = next(f for f in friction_findings({"j": fit}, [right_gravity]) if f.code == "friction-not-physical")
    assert said.excludes and said.doubts_alarms, "a law that gives power is no bare pass"
    assert "gravity torque has the right sign" in said.text and "base_rpy_deg" in said.text
    assert "effort_sign" not in said.text
    stated_already = [EffortGain("j", -0.9, (-1.0, -0.8), 0.9)]
    assert "friction-not-physical" not in {f.code for f in friction_findings({"j": fit}, stated_already)}


def test_no_friction_at_all_is_not_negative_friction() -> None:
    wrong = 0
    for seed in range(50):
        wrong += drives(points(np.linspace(0.1, 1.5, 8), lambda v: 0.0, sd=0.3, seed=seed))
    assert wrong == 0


def test_one_direction_alone_tells_no_sign() -> None:
    ahead = [p for p in points(np.linspace(0.1, 1, 8), lambda v: -3.0) if p.direction > 0]
    assert not drives(ahead)


def test_bounded_laws_oppose_the_motion_at_every_speed_measured() -> None:
    for seed in range(5):
        speeds = np.geomspace(0.05, 1.5, 8)
        fit = fit_friction(points(speeds, lambda v: 0.1 - 0.3 * v, sd=0.4, seed=seed), UNITS, "auto")
        law = FrictionModel.of(fit)
        if law is not None and fit.dissipates:
            grid = np.linspace(0.05, 1.5, 40)
            assert np.min(law.torque(grid) - law.torque(-grid)) >= -1e-3


def test_many_points_at_one_speed_are_one_speed() -> None:
    same = points(np.full(6, 0.30) + 0.001 * np.arange(6), lambda v: 4.0)[:12]
    wide = points(np.geomspace(0.05, 1.2, 14), lambda v: 4.0)
    assert len(same) == 12
    assert distinct_speeds(same) == 1
    assert distinct_speeds(wide) == 14
    speeds = np.geomspace(0.05, 1.2, 1000)
    assert any_motion_tells_more(same, wide, speeds)
    assert not any_motion_tells_more(wide, same, speeds)
    assert covered(same, speeds) < 0.1


def test_a_gap_between_sections_is_not_covered() -> None:
    """One slow section and many fast ones say nothing of the fall from breakaway, which lies between them."""
    speeds = np.geomspace(0.02, 1.2, 1000)
    gap = points(np.r_[0.02, np.linspace(0.3, 1.2, 12)], lambda v: 4.0)
    loose = points(np.geomspace(0.02, 1.2, 14), lambda v: 4.0)
    assert covered(gap, speeds) == pytest.approx(np.log(1.2 / 0.3) / np.log(1.2 / 0.02), abs=0.05)
    assert covered(loose, speeds) == 1.0
    assert any_motion_tells_more(gap, loose, speeds)


def test_sections_that_cover_the_motion_are_kept() -> None:
    sections = points(np.geomspace(0.02, 1.2, 8), lambda v: 4.0)
    loose = points(np.geomspace(0.05, 1.1, 14), lambda v: 4.0)
    assert not any_motion_tells_more(sections, loose, np.geomspace(0.05, 1.2, 1000))
