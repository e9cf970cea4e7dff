"""The family of friction laws: each recovered from its own points, chosen automatically only where it must be."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from collaudit.core.data.friction_result import FrictionFit, FrictionPoint
from collaudit.core.friction.friction_fitting import fit_friction
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.law_candidates import FrictionUnits
from collaudit.core.friction_laws.law_registry import LAWS

UNITS = FrictionUnits.of("revolute", "Nm")
SPEEDS = np.geomspace(0.02, 1.2, 30)
BLOCKS = 12
TRUTH = {
    "coulomb-viscous": {"A": 7.0, "D": 3.0},
    "smooth-coulomb-viscous": {"A": 7.0, "C": 20.0, "D": 3.0},
    "static-lugre": {"A": 7.0, "B": 2.5, "C": 12.0, "D": 3.0},
    "stribeck-gauss": {"Fc": 7.0, "Fs": 9.5, "vs": 0.12, "sigma2": 3.0},
    "saturating-viscous": {"A": 5.0, "R": 3.0, "C": 6.0, "D": 2.0},
}


def points_of(model: str, sd: float, seed: int) -> list[FrictionPoint]:
    """Points of a law with noise whose size is itself estimated from 12 blocks."""
    rng = np.random.default_rng(seed)
    true = LAWS[model].curve(TRUTH[model], SPEEDS)
    size = sd * rng.uniform(0.5, 2.0, SPEEDS.size)
    seen = size * np.sqrt(rng.chisquare(BLOCKS - 1, SPEEDS.size) / (BLOCKS - 1))
    return [
        FrictionPoint(float(v), float(f), float(s * BLOCKS**0.5), float(s), "pair", 0, False)
        for v, f, s in zip(SPEEDS, true + size * rng.standard_normal(SPEEDS.size), seen, strict=True)
    ]


def value(fit: FrictionFit, symbol: str) -> float:
    return next(v for k, v in fit.parameters.items() if k.partition("_")[0] == symbol)


@pytest.mark.parametrize("model", TRUTH)
def test_every_law_is_recovered_from_its_own_points(model: str) -> None:
    fit = fit_friction(points_of(model, 1e-6, 0), UNITS, model)
    assert fit.model == model
    for symbol, true in TRUTH[model].items():
        assert value(fit, symbol) == pytest.approx(true, rel=1e-3)
    law = FrictionModel.of(fit)
    assert law is not None
    v = np.concatenate([-SPEEDS, SPEEDS])
    expected = np.sign(v) * LAWS[model].curve(TRUTH[model], np.abs(v))
    assert law.torque(v) == pytest.approx(expected, abs=1e-3)
    assert law.torque(np.zeros(3)).tolist() == [0.0, 0.0, 0.0]


@pytest.mark.slow
@pytest.mark.parametrize("model", TRUTH)
def test_intervals_of_every_law_cover_the_truth_as_stated(model: str) -> None:
    """95 % intervals over 200 seeds: 90 to 98 % (three binomial standard deviations wider for a single count)."""
    hits: Counter[str] = Counter()
    counted: Counter[str] = Counter()
    for seed in range(200):
        fit = fit_friction(points_of(model, 0.05, seed), UNITS, model)
        for key, bounds in fit.ci95.items():
            if bounds is not None and None not in bounds:
                symbol = key.partition("_")[0]
                counted[symbol] += 1
                hits[symbol] += bounds[0] <= TRUTH[model][symbol] <= bounds[1]
    assert set(counted) == set(TRUTH[model])
    for symbol, n in counted.items():
        assert n >= 190, f"{symbol} was left open {200 - n} times"
        assert 0.90 <= hits[symbol] / n <= 0.985, (symbol, hits[symbol] / n)


@pytest.mark.parametrize(
    ("true", "accepted"),
    [
        ("coulomb-viscous", {"coulomb-viscous"}),
        ("static-lugre", {"static-lugre"}),
        ("stribeck-gauss", {"stribeck-gauss"}),
        ("smooth-coulomb-viscous", {"smooth-coulomb-viscous"}),
        ("saturating-viscous", {"saturating-viscous"}),
    ],
)
def test_auto_finds_the_law_behind_the_points(true: str, accepted: set[str]) -> None:
    chosen = Counter(fit_friction(points_of(true, 0.04, seed), UNITS).model for seed in range(10))
    assert sum(chosen[m] for m in accepted) >= 9, chosen


def test_auto_shows_every_law_it_compared() -> None:
    fit = fit_friction(points_of("static-lugre", 0.04, 3), UNITS)
    table = {row.model: row for row in fit.comparison}
    assert set(table) == set(LAWS)
    assert [m for m, row in table.items() if row.chosen] == ["static-lugre"]
    best = table["static-lugre"]
    assert best.held_out_rmse_nm is not None
    assert best.held_out_rmse_nm < 0.2 * (table["coulomb-viscous"].held_out_rmse_nm or 0)
    assert (best.aicc or 0) < (table["coulomb-viscous"].aicc or 0)


def test_a_curve_no_law_knows_is_left_to_the_data_driven_one() -> None:
    rng = np.random.default_rng(1)
    friction = 6 + 3 * SPEEDS + 1.5 * np.sin(2.5 * np.log(SPEEDS)) + 0.03 * rng.standard_normal(SPEEDS.size)
    points = [
        FrictionPoint(float(v), float(f), 0.1, 0.03, "pair", 0, False) for v, f in zip(SPEEDS, friction, strict=True)
    ]
    fit = fit_friction(points, UNITS)
    assert fit.model == "rbf"
    law = FrictionModel.of(fit)
    assert law is not None
    assert law.torque(SPEEDS) == pytest.approx(friction, abs=0.15)
    # beyond the measured speeds it runs on as a line, it does not explode
    assert law.torque(np.array([2.4]))[0] == pytest.approx(law.torque(np.array([1.2]))[0] + 3.6, abs=2.0)
    assert any("only its curve" in text for text in fit.not_identifiable)


def test_open_sides_are_named_with_the_motion_that_would_close_them() -> None:
    gone = {"A": 7.0, "B": 2.5, "C": 400.0, "D": 3.0}
    friction = LAWS["static-lugre"].curve(gone, SPEEDS)
    rng = np.random.default_rng(2)
    points = [
        FrictionPoint(float(v), float(f + 0.05 * e), 0.2, 0.05, "pair", 0, False)
        for v, f, e in zip(SPEEDS, friction, rng.standard_normal(SPEEDS.size), strict=True)
    ]
    insisted = fit_friction(points, UNITS, "static-lugre")
    found = insisted.identifiability
    assert found is not None
    assert found.open_sides["C_s_per_rad"] in ("high", "both")
    assert insisted.ci95["C_s_per_rad"] is not None
    assert insisted.ci95["C_s_per_rad"][1] is None
    assert any(text.startswith("speeds below") and "both directions" in text for text in found.motion_needed)
    fallen_back = fit_friction(points, UNITS).identifiability
    assert fallen_back is not None
    assert any(text.startswith("speeds below") for text in fallen_back.motion_needed)


def test_singular_values_and_correlations_tell_a_good_fit_from_a_poor_one() -> None:
    good = fit_friction(points_of("static-lugre", 0.02, 0), UNITS, "static-lugre").identifiability
    slow = SPEEDS[SPEEDS < 0.06]
    friction = LAWS["static-lugre"].curve(TRUTH["static-lugre"], slow)
    points = [
        FrictionPoint(float(v), float(f), 0.02, 0.005, "pair", 0, False) for v, f in zip(slow, friction, strict=True)
    ]
    poor = fit_friction(points, UNITS, "static-lugre").identifiability
    assert good is not None
    assert poor is not None
    assert good.condition is not None
    assert len(good.singular_values) == 4
    assert poor.condition is None or poor.condition > 20 * good.condition
    assert all(-1 <= r <= 1 for r in good.correlations.values())
    assert set(good.correlations) >= {"A_nm ~ B_nm", "A_nm ~ D_nm_s_per_rad", "C_s_per_rad ~ D_nm_s_per_rad"}
