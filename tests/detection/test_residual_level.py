"""A threshold within the model's own error, or a residual unlike that of the fitted logs, makes alarms doubtful."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.data.audit_result import ResidualStats
from collaudit.core.data.signals import Signals, State
from collaudit.core.detection.detection_findings import residual_level_findings

N = 20_000


def signals(residual: np.ndarray, state: State = State.JUDGED) -> Signals:
    """Joints 'a' and 'unwatched' with the same residual (n,)."""
    both = np.column_stack([residual, residual])
    zero = np.zeros_like(both)
    states = np.full(both.shape, state, dtype=np.int8)
    time_s = np.arange(residual.size) * 0.002
    return Signals(
        time_s,
        ("a", "unwatched"),
        zero,
        zero,
        zero,
        zero,
        both,
        states,
        np.full(both.shape, 4.0, np.float32),
        np.full(2, 0.8),
    )


@pytest.mark.parametrize(("mean_nm", "said"), [(1.9, False), (2.1, True), (None, False)])
def test_a_residual_above_half_the_threshold_doubts_alarms(mean_nm: float | None, said: bool) -> None:
    stats = {"a": ResidualStats(9.0, 9.0, 9.0, 9.0, 60.0, mean_nm, 50.0), "unwatched": ResidualStats(*[9.0] * 7)}
    found = residual_level_findings(signals(np.zeros(N)), stats, {"a": 4.0}, {})
    assert [(f.code, f.joint, f.effect) for f in found] == [("residual-level", "a", "doubts-alarms")] * said


@pytest.mark.parametrize(
    ("scale", "offset_nm", "contact", "state", "said"),
    [
        (1.8, 0.0, 0.0, State.JUDGED, False),
        (2.2, 0.0, 0.0, State.JUDGED, True),
        (1.0, 2.0, 0.0, State.JUDGED, True),
        (1.0, 0.0, 0.3, State.JUDGED, False),  # contact for a third of the time is no other arm
        (9.0, 0.0, 0.0, State.FRICTION_INTERVAL, False),
    ],
)
def test_a_residual_unlike_that_of_the_fit_doubts_alarms(
    scale: float, offset_nm: float, contact: float, state: State, said: bool
) -> None:
    """The bulk of the residual where friction is a value, beside that of the fitted motion: 0.5 N·m."""
    residual = 0.5 * scale * np.random.default_rng(4).standard_normal(N) + offset_nm
    residual[: round(contact * N)] += 20.0
    stats = {"a": ResidualStats(9.0, 9.0, 9.0, 9.0, 60.0, 0.5, 50.0)}
    found = residual_level_findings(signals(residual, state), stats, {"a": 8.0}, {"a": 0.5})
    assert [(f.code, f.joint, f.effect) for f in found] == [("residual-level", "a", "doubts-alarms")] * said
    assert all("times that of the fitted logs" in f.text for f in found)
    assert all(("most of it is an offset" in f.text) == (offset_nm == 2.0) for f in found)
