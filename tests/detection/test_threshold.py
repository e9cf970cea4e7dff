"""The threshold in force: gamma as printed, raised by what is uncertain, lowered by nothing."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import gamma_in_force

N = 400
LOOSE = slice(3 * N // 4, N)


def in_force(uncertainty_nm: float = 0.0, gamma_nm: float = 4.0, **rule: Any) -> np.ndarray:
    """(n, 3) of joints a and b, and c without a threshold; friction of all is an interval in the last quarter."""
    state = np.full((N, 3), State.JUDGED, dtype=np.int8)
    state[LOOSE] = State.FRICTION_INTERVAL
    residual = SimpleNamespace(
        torque_nm=np.zeros((N, 3)), still=frozenset(), uncertainty_nm=np.full((N, 3), uncertainty_nm), state=state
    )
    known = {"at_rest_nm": {}, "motion_nm": {"a": 0.5 * gamma_nm, "b": 1.0}}
    facts = SimpleNamespace(gamma_nm={"a": gamma_nm, "b": 2.0}, **{**known, **rule})
    return gamma_in_force(SimpleNamespace(joint_names=("a", "b", "c")), residual, facts)  # type: ignore[arg-type]


def test_it_is_the_printed_gamma_where_nothing_is_uncertain() -> None:
    found = in_force(gamma_nm=1.92)
    assert found.dtype == np.float32
    assert (found[:, 0] == np.float32(1.92)).all() and (found[:, 1] == 2.0).all()
    assert np.isnan(found[:, 2]).all(), "no threshold is not a threshold of nothing"


@given(st.floats(1e-3, 1e4), st.floats(0.0, 1e3))
def test_uncertainty_raises_it_and_nothing_lowers_it(gamma_nm: float, uncertainty_nm: float) -> None:
    found = in_force(uncertainty_nm, gamma_nm)[:, 0]
    least = gamma_nm + uncertainty_nm
    assert (found >= least * (1 - 1e-6)).all() and (found <= least + gamma_nm / 256 + 1e-6 * least).all()


def test_a_stated_one_is_constant_as_stated() -> None:
    assert (in_force(1.0, motion_nm={})[:, 0] == 4.0).all()


def test_where_friction_is_an_interval_it_is_higher() -> None:
    found = in_force(at_rest_nm={"b": 0.75})
    assert found[LOOSE, 1] == pytest.approx(np.full(N // 4, 2.75))
    assert (found[: LOOSE.start, 1] == 2.0).all() and (found[:, 0] == 4.0).all()
