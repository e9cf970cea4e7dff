"""Friction of the load and gear ripple: found where they are, not where they are not, and used with their doubt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from collaudit.core.data.friction_result import LoadFriction, RippleWave
from collaudit.core.friction.friction_model import load_doubt, load_torque
from collaudit.core.friction.friction_variation import correction_findings, joint_correction
from collaudit.core.friction.gear_ripple import ripple_torque
from collaudit.core.friction.motion_points import Settled

T = 0.01


def motion(seed: int, seconds: float = 240.0, slope: float = 0.0, ripple: float = 0.0, cad: float = 0.0) -> Settled:
    """A joint over smooth random motion; gravity 30 N·m; errors of the model and of friction that last for a while."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, seconds, T)
    w, phase = rng.uniform(0.2, 1.3, 6), rng.uniform(0, 2 * np.pi, 6)
    q = sum(0.25 * np.sin(a * t + b) for a, b in zip(w, phase, strict=True))
    v = np.gradient(q, T)
    other = sum(0.3 * np.sin(a * t + b) for a, b in zip(rng.uniform(0.1, 0.9, 3), rng.uniform(0, 6, 3), strict=True))
    torque = 30.0 * np.cos(q + other)
    friction = np.sign(v) * (8.0 + 3.0 * np.abs(v))
    slow = np.interp(t, np.arange(0, seconds + 2, 2.0), rng.standard_normal(np.arange(0, seconds + 2, 2.0).size))
    residual = 0.3 * slow + 0.3 * rng.standard_normal(t.size) + cad * 30.0 * np.cos(q + 0.5 * other)
    residual = residual + np.sign(v) * slope * (np.abs(torque) - np.mean(np.abs(torque)))
    residual = residual + ripple * np.sin(200 * q + 0.4)
    rows = np.abs(v) > 0.02
    everything = Settled(t, q, residual, friction, np.abs(v), np.gradient(torque, T), np.abs(torque), None, torque)
    picked = {n: getattr(everything, n)[rows] for n in Settled.__slots__ if n != "temperature"}
    return Settled(**picked, temperature=None)


def test_load_friction_is_found_with_its_error() -> None:
    errors = []
    for seed in range(12):
        found = joint_correction([motion(seed, slope=0.05)])
        assert found is not None and found.load is not None
        errors.append((found.load.per_nm - 0.05) / found.load.per_nm_sd)
        assert found.held_out_rms_nm < found.rms_nm
    assert np.sum(np.abs(errors) < 2.0) >= 10


@pytest.mark.parametrize("cad", [0.0, 0.05, 0.1], ids=["no error", "5 % of CAD", "10 % of CAD"])
def test_no_load_friction_is_found_where_there_is_none(cad: float) -> None:
    found = [joint_correction([motion(seed, cad=cad)]) for seed in range(20)]
    assert sum(x is not None and x.load is not None for x in found) == 0
    assert sum(x is not None and bool(x.ripple) for x in found) == 0


def test_ripple_is_found_with_amplitude_and_phase() -> None:
    data = motion(3, ripple=0.5)
    found = joint_correction([data])
    assert found is not None
    assert [wave.cycles_per_turn for wave in found.ripple] == pytest.approx([200.0], abs=0.05)
    there = ripple_torque(found.ripple, data.position, np.sign(data.friction))
    assert np.max(np.abs(there - 0.5 * np.sin(200 * data.position + 0.4))) < 0.1
    assert 0 < found.ripple[0].sd_nm < 0.05
    assert [f.text[:11] for f in correction_findings({"joint1": found})] == ["Gear ripple"]
    both = replace(found, load=LoadFriction(0.05, 0.01, (0.1, 1.0), (20.0, 10.0), (5.0, 25.0)))
    assert [f.text[:11] for f in correction_findings({"joint1": both})] == ["The frictio", "Gear ripple"]


def test_friction_of_the_load_is_what_differs_from_the_usual_load() -> None:
    load = LoadFriction(0.1, 0.01, (0.1, 1.0), (20.0, 10.0), (5.0, 25.0))
    v = np.array([0.1, -0.1, 1.0, 1.0, 0.0, 2.0])
    carried = np.array([20.0, 25.0, 10.0, 5.0, 25.0, 45.0])
    assert load_torque(load, carried, v) == pytest.approx([0.0, -0.5, 0.0, -0.5, 0.0, 1.5])
    doubt = load_doubt(load, carried, v)
    assert doubt[[0, 2]] == pytest.approx([0.0, 0.0])
    assert doubt[3] == pytest.approx(1.96 * 0.01 * 5.0)
    assert doubt[5] == pytest.approx(1.96 * 0.01 * 15.0 + 0.1 * 20.0), "a load that the fit never saw"


def test_a_wave_both_ways_and_against() -> None:
    wave = RippleWave(50.0, (1.0, 0.0), (0.5, 0.0), 0.01)
    at = ripple_torque((wave,), np.zeros(3), np.array([0.3, -0.3, 0.0]))
    assert at == pytest.approx([1.5, 0.5, 1.0])
