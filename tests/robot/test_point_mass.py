"""Inertial parameters of a point mass against Pinocchio's."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from collaudit.core.robot.pinocchio_model import point_mass_parameters


@pytest.mark.parametrize("seed", range(5))
def test_as_the_library_has_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mass, centre = rng.uniform(0.1, 5.0), rng.normal(size=3)
    expected = pin.Inertia(mass, centre, np.zeros((3, 3))).toDynamicParameters()
    np.testing.assert_allclose(point_mass_parameters(mass, mass * centre), expected, rtol=1e-12, atol=1e-12)


def test_no_mass_has_no_parameters() -> None:
    np.testing.assert_array_equal(point_mass_parameters(0.0, np.zeros(3)), np.zeros(10))
