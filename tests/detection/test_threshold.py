"""The level that a residual has to exceed: it follows the motion where evidence says how, and rests higher."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from collaudit.core.data.recommendation_result import MotionScale
from collaudit.core.data.signals import State
from collaudit.core.detection.threshold import Threshold

N = 400
#: 0.2 N·m and 0.5 for each rad/s of the joint; usually 0.4.
SCALE = MotionScale(0.2, 0.0, 0.5, 0.0, 0.0, 0.4)


def threshold(**rule: object) -> Threshold:
    """Of two joints; the first moves at 0.4 rad/s, then at 1.2; friction of both is an interval in the last quarter."""
    velocity = np.zeros((N, 2))
    velocity[:, 0] = np.where(np.arange(N) < N // 2, 0.4, 1.2)
    state = np.full((N, 2), State.JUDGED, dtype=np.int8)
    state[3 * N // 4 :] = State.FRICTION_INTERVAL
    series = SimpleNamespace(
        joint_names=("a", "b"), time_s=0.01 * np.arange(N), velocity_rad_s=velocity, segments=(), period_s=0.01
    )
    kernel = SimpleNamespace(apply=lambda x, *_: x)
    residual = SimpleNamespace(
        uncertainty_nm=np.full((N, 2), 0.1),
        state=state,
        balance=SimpleNamespace(kernel=kernel, velocity_rad_s=velocity),
    )
    none = {"follows": {}, "at_rest_nm": {}, "lasting_nm": {}, "n": 3, "lasting_n": 10, "lasting_follows": {}}
    facts = SimpleNamespace(gamma_nm={"a": 4.0, "b": 2.0}, **{**none, **rule})
    return Threshold(series, residual, facts)  # type: ignore[arg-type]


def test_a_threshold_follows_the_motion_of_its_joint_only() -> None:
    level = threshold(follows={"a": SCALE}).all_joints()
    assert level[0, 0] == pytest.approx(0.1 + 4.0 * (0.2 + 0.5 * 0.4) / 0.4)
    assert level[N // 2, 0] == pytest.approx(0.1 + 4.0 * (0.2 + 0.5 * 1.2) / 0.4)
    assert level[:, 1] == pytest.approx(np.full(N, 2.1)), "no scale, no change"
    assert threshold().all_joints()[:, 0] == pytest.approx(np.full(N, 4.1))


def test_where_friction_is_an_interval_it_is_higher() -> None:
    found = threshold(at_rest_nm={"b": 0.7})
    level = found.all_joints()
    assert level[: 3 * N // 4, 1] == pytest.approx(np.full(3 * N // 4, 2.1))
    assert level[3 * N // 4 :, 1] == pytest.approx(np.full(N // 4, 2.8))
    assert level[:, 0] == pytest.approx(np.full(N, 4.1))
    rows = np.array([0, N - 1])
    assert found.of(1, rows) == pytest.approx([2.1, 2.8]), "the same for a part of the samples"


def test_the_lower_threshold_of_what_lasts_follows_the_motion_in_its_own_way_and_rests_higher_too() -> None:
    own = MotionScale(0.1, 0.0, 0.1, 0.0, 0.0, 0.2)
    found = threshold(
        follows={"a": SCALE, "b": SCALE}, at_rest_nm={"a": 0.7}, lasting_nm={"a": 1.0}, lasting_follows={"a": own}
    )
    lower = found.lasting(0)
    assert lower is not None
    assert lower[0] == pytest.approx(0.1 + 1.0 * (0.1 + 0.1 * 0.4) / 0.2)
    assert lower[-1] == pytest.approx(0.8 + 1.0 * (0.1 + 0.1 * 1.2) / 0.2)
    assert found.lasting(1) is None
    found.series.velocity_rad_s[:10, 0] = 0.05
    slow, level = found.lasting(0), found.of(0)
    assert slow is not None
    assert (slow[:10] >= level[:10]).all(), "friction errs for as long as a joint is slow"
    assert (slow[10:] < level[10:]).all()
