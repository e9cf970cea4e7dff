"""The tail of the clean residual's peaks against laws whose tails are known."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.recommend.clean_tail import clean_tail


def test_the_scale_of_exponential_peaks() -> None:
    """Over seeds the estimated scale scatters around the truth as its error says, and its bound holds in 95 %."""
    errors, held = [], 0
    for seed in range(400):
        tail = clean_tail(np.random.default_rng(seed).exponential(0.4, 3600), 1.0)
        assert tail is not None
        assert tail.rate_per_hour(tail.level_at(0.1)) == pytest.approx(0.1)
        errors.append((tail.scale_nm / 0.4 - 1) * np.sqrt(tail.peaks))
        held += tail.scale_upper95_nm >= 0.4
    assert abs(np.mean(errors)) < 4 / np.sqrt(400)
    assert 0.85 < np.std(errors) < 1.15
    assert 0.91 <= held / 400 <= 0.985


def test_the_level_holds_its_confidence() -> None:
    """The level for a rate is passed no more often than that in 95 of 100 cases, from as few as 160 peaks."""
    scale, hours, rate = 0.4, 160 / 3600, 0.1
    needed = scale * np.log(3600 / rate)
    held = 0
    for seed in range(1000):
        tail = clean_tail(np.random.default_rng(seed).exponential(scale, 160), hours)
        assert tail is not None
        held += tail.level_at(rate) >= needed
    assert held >= 0.92 * 1000  # 95 %, three standard errors, and the scatter of the level it starts from


def test_too_few_peaks_have_no_tail() -> None:
    assert clean_tail(np.arange(39.0), 0.01) is None
    assert clean_tail(np.ones(100), 0.03) is None


def test_a_margin_alone_would_not_have_held() -> None:
    """What the tail is for: the largest of five minutes, times 1.25, is passed soon after."""
    alarms = 0
    for seed in range(6):
        peaks = np.random.default_rng(seed).exponential(0.4, 30_000)
        alarms += int(np.count_nonzero(peaks[300:] > 1.25 * peaks[:300].max()))
    assert alarms > 5
