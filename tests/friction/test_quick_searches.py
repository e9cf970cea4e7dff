"""Sums along the rates are those of whole fits; a column that others explain has no bounds."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.friction import least_squares as ls
from collaudit.core.friction_laws.friction_law import SeparableLaw
from collaudit.core.friction_laws.law_registry import LAWS


def _points(seed: int, scatter_nm: float = 0.02, timing_nm: float = 0.0) -> ls.Points:
    rng = np.random.default_rng(seed)
    speed = np.tile(np.geomspace(0.02, 0.6, 16), 2)
    direction = np.repeat([1.0, -1.0], 16)
    friction = 3.0 + 1.2 * np.exp(-14.0 * speed) + 5.0 * speed + 0.1 * direction
    friction += rng.normal(0.0, scatter_nm, speed.size)
    sd = rng.uniform(0.01, 0.02, speed.size)
    return ls.Points(speed, friction, sd, direction, direction, timing_nm * direction * np.cos(8.0 * speed))


@pytest.mark.parametrize("timing_nm", [0.0, 0.02])
@pytest.mark.parametrize("law", [law for law in LAWS.values() if getattr(law, "rate", None) is not None])
def test_sums_along_the_rates_are_those_of_whole_fits(law: SeparableLaw, timing_nm: float) -> None:
    points, rates = _points(4, timing_nm=timing_nm), np.geomspace(0.5, 200.0, 30)
    whole = [ls.fit_at(points, law, float(c)).sum_squares for c in rates]
    np.testing.assert_allclose(ls.sums_along(points, law, rates), whole, rtol=1e-6)


@pytest.mark.parametrize("gone", [lambda x: 0.0 * x, lambda x: x, lambda x: np.ones(x.size)])
def test_a_column_that_others_explain_is_kept_without_bounds(gone) -> None:
    x = np.linspace(1.0, 2.0, 9)
    design = np.column_stack([x, np.ones(x.size), gone(x)])
    found = ls.solve(design, 2.0 * x)
    np.testing.assert_allclose(design @ found.estimate, 2.0 * x, atol=1e-9)
    assert np.all(np.isfinite(found.covariance)) and found.covariance[2, 2] > 1e20
    assert found.sum_squares < 1e-18


def test_an_error_that_all_points_share_is_weighed_as_generalised_least_squares() -> None:
    """The covariance of the points is diag(sd²) + timing timingᵀ: estimate and covariance by its inverse."""
    points, law = _points(4, timing_nm=0.05), LAWS["coulomb-viscous"]
    assert isinstance(law, SeparableLaw)
    x, inverse = points.raw(law), np.linalg.inv(np.diag(points.sd**2) + np.outer(points.timing, points.timing))
    covariance = np.linalg.inv(x.T @ inverse @ x)
    found = ls.fit_at(points, law, 0.0)
    np.testing.assert_allclose(found.estimate, covariance @ x.T @ inverse @ points.friction, rtol=1e-8)
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-8)
