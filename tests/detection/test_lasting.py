"""What lasts alarms at a lower threshold, once: not beside an alarm of gamma, nor as a near miss as well."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from collaudit.core.data.signals import State
from collaudit.core.detection.events import _events

N, LASTING_N, GAMMA, LOWER = 5, 20, 4.0, 3.0


def found(*pushes: tuple[int, int, float]) -> Any:
    """Events of one joint whose residual is noise but at some samples: (start, samples, N·m)."""
    x = np.random.default_rng(0).normal(0.0, 0.1, 400)
    for start, samples, nm in pushes:
        x[start : start + samples] = nm
    rule = SimpleNamespace(
        n=N, lasting_n=LASTING_N, near_miss_amplitude=0.7, near_miss_persistence=0.5, near_miss_impulse=0.4
    )
    levels = (np.full(x.size, GAMMA), N), (np.full(x.size, LOWER), LASTING_N)
    threshold: Any = SimpleNamespace(rule=rule, with_persistences=lambda _: levels)
    return _events(x, np.full(x.size, State.JUDGED, dtype=np.int8), threshold, 0, 10, 3)


def test_what_lasts_alarms_below_gamma_and_is_no_near_miss_besides() -> None:
    events = found((100, LASTING_N, 3.5))
    assert [(e.span.start, len(e.span), e.detected) for e in events.lasting] == [(100, LASTING_N, 100 + LASTING_N - 1)]
    assert not (events.fired or events.low or events.brief or events.knocks)


def test_what_is_a_sample_shorter_is_a_near_miss() -> None:
    events = found((100, LASTING_N - 1, 3.5))
    assert not (events.fired or events.lasting)
    assert [e.span.start for e in events.low] == [100]


def test_what_passes_gamma_is_one_alarm_of_gamma() -> None:
    events = found((100, 2 * LASTING_N, 5.0), (250, N, 5.0))
    assert [e.span.start for e in events.fired] == [100, 250]
    assert not (events.lasting or events.low or events.brief or events.knocks)
