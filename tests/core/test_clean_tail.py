"""The tail of the clean residual's peaks against laws whose tails are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from collaudit.core.clean_tail import clean_tail
from collaudit.core.recommend import TARGET_H, CleanResidual, recommend_rule, sustained_peaks


def test_exponential_peaks_give_their_own_rate() -> None:
    """Over seeds the logarithm of the estimated rate at a far level scatters around the truth as its error says."""
    scale, hours, far = 0.4, 1.0, 4.0
    true = 3600.0 * np.exp(-far / scale)  # peaks an hour above the far level
    errors = []
    for seed in range(200):
        tail = clean_tail(np.random.default_rng(seed).exponential(scale, 3600), hours)
        assert tail is not None
        assert tail.level_at(tail.rate_per_hour(far)) == pytest.approx(far)
        expected_sd = (far - tail.level_nm) / tail.scale_nm / np.sqrt(tail.peaks)
        errors.append((np.log(tail.rate_per_hour(far)) - np.log(true)) / expected_sd)
    assert abs(np.mean(errors)) < 4 / np.sqrt(200)
    assert 0.8 < np.std(errors) < 1.25


def test_too_few_peaks_have_no_tail() -> None:
    assert clean_tail(np.arange(39.0), 0.01) is None
    assert clean_tail(np.ones(100), 0.03) is None


def test_a_coloured_residual_alarms_more_seldom_than_the_target() -> None:
    """From five minutes each, tried on a hundred times as long: Gaussian tails fall faster than the law's."""
    period, alarms, hours = 0.01, 0, 0.0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        x = lfilter([np.sqrt(1 - 0.98**2)], [1, -0.98], rng.standard_normal(30_000 + 3_000_000))
        learnt, other = (CleanResidual(part, np.ones(part.size, bool), period) for part in (x[:30_000], x[30_000:]))
        rule = recommend_rule([learnt], 0.05)
        assert rule.gamma_nm is not None and rule.false_alarms_per_hour is not None
        assert rule.false_alarms_per_hour <= 1 / TARGET_H
        alarms += int(np.count_nonzero(sustained_peaks(other, rule.n) > rule.gamma_nm))
        hours += other.residual_nm.size * period / 3600
    assert alarms <= 2 * hours / TARGET_H, (alarms, hours)


def test_a_margin_alone_would_not_have_held() -> None:
    """What the tail is for: the largest of five minutes, times 1.25, is passed soon after."""
    alarms = 0
    for seed in range(6):
        peaks = np.random.default_rng(seed).exponential(0.4, 30_000)
        alarms += int(np.count_nonzero(peaks[300:] > 1.25 * peaks[:300].max()))
    assert alarms > 5
