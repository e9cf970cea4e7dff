"""Friction above the fastest fitted speed: an interval that grows from nothing, and holds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from collaudit.core.data.friction_result import FrictionPoint
from collaudit.core.friction.friction_fitting import fit_friction
from collaudit.core.friction.friction_model import FrictionModel, extrapolation_doubt, scatter_beyond
from collaudit.core.friction.law_candidates import FrictionUnits

UNITS = FrictionUnits.of("revolute", "Nm")


def fitted(curve: np.ndarray, speed: np.ndarray, seed: int = 0, model: str = "auto") -> FrictionModel:
    noise = 0.05 * np.random.default_rng(seed).standard_normal(speed.size)
    points = [
        FrictionPoint(float(v), float(f), 0.05, 0.05, "pair", 0, False)
        for v, f in zip(speed, curve + noise, strict=True)
    ]
    law = FrictionModel.of(fit_friction(points, UNITS, model))
    assert law is not None
    return law


def test_it_grows_from_nothing_and_is_odd_in_nothing() -> None:
    speed = np.linspace(0.05, 1.0, 20)
    law = fitted(5.0 + 3.0 * speed, speed, model="coulomb-viscous")
    v = np.array([-3.0, -1.0, -0.2, 0.0, 0.7, 1.0, 1.01, 1.5, 2.0, 3.0, np.nan])
    doubt = extrapolation_doubt(law, v)
    assert doubt[:-1] == pytest.approx(extrapolation_doubt(law, -v)[:-1])
    assert (doubt[1:6] == 0).all() and doubt[-1] == 0
    assert 0 < doubt[6] < 0.1
    assert doubt[8] == pytest.approx(3.0, rel=0.15), "growth itself, and what the slope's error adds"
    assert (np.diff(doubt[5:10]) > 0).all()
    assert (extrapolation_doubt(replace(law, spread=None), v) <= doubt).all()


@pytest.mark.parametrize("kind", ["line", "saturating", "root", "stribeck"])
def test_the_truth_lies_in_it_up_to_twice_the_speed(kind: str) -> None:
    speed, beyond = np.geomspace(0.05, 1.0, 20), np.linspace(1.0, 2.0, 11)
    truth = {
        "line": lambda v: 5.0 + 3.0 * v,
        "saturating": lambda v: 5.0 + 2.0 * np.tanh(1.5 * v),
        "root": lambda v: 3.0 + 3.0 * np.cbrt(v),
        "stribeck": lambda v: 4.0 + 2.0 * np.exp(-12.0 * v) + 2.5 * v,
    }[kind]
    held = 0
    for seed in range(20):
        law = fitted(truth(speed), speed, seed)
        error = np.abs(law.torque(beyond) - truth(beyond)) - np.abs(law.torque(beyond[:1]) - truth(beyond[:1]))
        held += bool((error <= extrapolation_doubt(law, beyond) + 1e-9).all())
    assert held >= 19


def test_a_log_tells_how_friction_goes_on() -> None:
    """Strokes to twice the fitted speed: the curve is off by 1.5 N·m there, a push of 6 N·m lies on one of them."""
    speed = np.linspace(0.05, 1.0, 20)
    law = fitted(5.0 + 3.0 * speed, speed, model="coulomb-viscous")
    t = np.arange(0.0, 40.0, 0.002)
    v = 2.0 * np.sin(2.0 * np.pi * t / 4.0)
    noise = 0.2 * np.random.default_rng(1).standard_normal(t.size)
    off = np.where(np.abs(v) > 1.0, 1.5, 0.0) * np.sign(v) + noise
    everywhere = np.ones(t.size, dtype=bool)
    clean = scatter_beyond(law, v, off, everywhere, 0.002)
    assert clean == pytest.approx(1.5 + 1.96 * 0.2, rel=0.05)
    assert clean < extrapolation_doubt(law, np.array([2.0]))[0]
    pushed = off + np.where((t > 13.0) & (t < 13.13), 6.3, 0.0)
    assert scatter_beyond(law, v, pushed, everywhere, 0.002) == pytest.approx(clean, rel=0.05)
    brief = np.asarray(t < 1.9)  # one stroke
    assert np.isinf(scatter_beyond(law, v, off, brief, 0.002))
