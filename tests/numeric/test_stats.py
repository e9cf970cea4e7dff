"""Constants of statistics against SciPy's distributions, and that no module has its own."""

from __future__ import annotations

import tokenize
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from collaudit.core.numeric import stats

PROJECT = Path(__file__).resolve().parents[2]


def test_constants_are_those_of_the_normal_distribution() -> None:
    assert pytest.approx(norm.ppf(0.975), abs=5e-3) == stats.STANDARD_ERRORS_95
    assert pytest.approx(norm.ppf(0.975), abs=5e-7) == stats.NORMAL_QUANTILE_975
    assert pytest.approx(1.0 / norm.ppf(0.75), abs=5e-5) == stats.SD_PER_MAD


def test_robust_sd_of_normal_values() -> None:
    x = np.random.default_rng(1).normal(0.0, 3.0, 200_000)
    assert stats.robust_sd(x) == pytest.approx(3.0, rel=0.01)
    x[:20_000] = 1e6  # a tenth of outliers moves it a little, and a standard deviation altogether
    assert stats.robust_sd(x) == pytest.approx(3.0, rel=0.2)


def test_the_median_of_nothing_is_unknown() -> None:
    assert np.isnan(stats.median_of(np.empty(0)))


def test_the_minimum_of_a_parabola_is_found_exactly() -> None:
    at = np.array([-0.4, 0.0, 0.3, 1.7])
    values = [2.0 * (x - at) ** 2 + 5.0 for x in (-1.0, 0.0, 1.0)]
    np.testing.assert_allclose(stats.parabola_minimum(*values), at, atol=1e-12)
    assert float(stats.parabola_minimum(*(v[2] for v in values))) == pytest.approx(0.3)


def test_without_a_minimum_the_middle_stays() -> None:
    flat, falling = np.ones(3), np.array([1.0, 0.0, -2.0])
    assert stats.parabola_minimum(*flat) == 0.0
    assert stats.parabola_minimum(*falling) == 0.0


def test_no_module_has_its_own() -> None:
    own = {"1.96", "1.959964", "1.4826", "1.2533", "1.345"}
    found = []
    for path in [p for part in ("core", "reports", "fixtures") for p in (PROJECT / part).rglob("*.py")]:
        with path.open("rb") as file:
            numbers = {token.string for token in tokenize.tokenize(file.readline) if token.type == tokenize.NUMBER}
        if numbers & own or any(number.startswith("1.95996") for number in numbers):
            found.append(path.relative_to(PROJECT).as_posix())
    assert found == ["core/numeric/stats.py"]


def test_a_weighted_median_is_that_of_each_number_as_often_as_it_weighs() -> None:
    rng = np.random.default_rng(0)
    x, weight = rng.standard_normal(101), rng.integers(0, 5, 101)
    assert stats.weighted_median(x, weight.astype(float)) == np.sort(np.repeat(x, weight))[(weight.sum() + 1) // 2 - 1]
