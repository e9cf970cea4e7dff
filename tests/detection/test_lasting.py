"""What lasts alarms at a lower threshold, once: not beside an alarm of gamma, nor as a near miss as well."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from collaudit.core.data.audit_result import Collision, NearMiss
from collaudit.core.data.signals import State
from collaudit.core.detection.events import _events
from collaudit.core.residual.isolation import EachJoint

N, LASTING_N, GAMMA, LOWER = 5, 20, 4.0, 3.0


def found(*pushes: tuple[int, int, float]) -> tuple[list[Collision], list[NearMiss]]:
    """Events of one joint whose residual is noise but at some samples: (start, samples, N·m)."""
    x = np.random.default_rng(0).normal(0.0, 0.1, 400)
    for start, samples, nm in pushes:
        x[start : start + samples] = nm
    rule = SimpleNamespace(
        n=N,
        lasting_n=LASTING_N,
        gamma_nm={"a": GAMMA},
        lasting_nm={"a": LOWER},
        near_miss_amplitude=0.7,
        near_miss_persistence=0.5,
        near_miss_impulse=0.4,
    )
    threshold: Any = SimpleNamespace(
        rule=rule,
        of=lambda _: np.full(x.size, GAMMA),
        lasting=lambda _: np.full(x.size, LOWER),
        series=SimpleNamespace(time_s=np.arange(x.size, dtype=float), period_s=1.0, joint_names=("a",)),
        residual=SimpleNamespace(torque_nm=x[:, None], isolation=EachJoint(("a",))),
    )
    state = np.full(x.size, State.JUDGED, dtype=np.int8)
    return _events(threshold, 0, state, np.zeros(x.size, dtype=np.int8), (10, 3))


def test_what_lasts_alarms_below_gamma_and_is_no_near_miss_besides() -> None:
    hits, near = found((100, LASTING_N, 3.5))
    ((hit),) = hits
    assert (hit.onset_s, hit.duration_s, hit.gamma_nm, hit.lasting) == (100, LASTING_N, LOWER, True)
    assert 100 + 0.8 * LASTING_N < hit.detected_s < 100 + LASTING_N
    assert not near


def test_what_is_too_short_for_the_mean_is_a_near_miss() -> None:
    hits, near = found((100, LASTING_N - 4, 3.5))
    assert not hits
    assert [(e.onset_s, e.kind) for e in near] == [(100, "amplitude")]


def test_what_passes_gamma_is_one_alarm_of_gamma() -> None:
    hits, near = found((100, 2 * LASTING_N, 5.0), (250, N, 5.0))
    assert [(e.onset_s, e.gamma_nm, e.lasting) for e in hits] == [(100, GAMMA, False), (250, GAMMA, False)]
    assert not near
