"""Friction from motion without plateaus: many short runs, each with a zero of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from three_joints import COULOMB, NAMES, VISCOUS, arm, log_of, settings

from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.friction.joint_fits import fit_joints
from collaudit.core.friction.motion_points import motion_points
from collaudit.core.prepare.preparation import prepare
from collaudit.core.prepare.prepared import Prepared

PLAIN = settings(fit={"motion": "any"})
LINE = settings(fit={"motion": "any"}, friction={"model": "coulomb-viscous"})
ONES = np.ones(3)


def runs(seed: int, count: int = 9, seconds: float = 3.0, zero_nm: float = 2.0) -> list[Prepared]:
    """Short runs of sines, in which no speed is constant."""
    rng = np.random.default_rng([seed, 9])
    out = []
    for k in range(count):
        log = log_of(arm(PLAIN), ONES, seed=100 * seed + k, seconds=seconds)
        assert log.effort is not None
        zeros = rng.normal(0.0, zero_nm, 3)
        source = replace(log.source, name=f"run {k}", digest=f"{seed}{k}".zfill(64))
        out.append(prepare(replace(log, effort=log.effort + zeros, source=source), arm(PLAIN), PLAIN))
    return out


def held(fit: FrictionFit, j: int) -> list[bool]:
    """Whether the intervals of A and D hold the truth."""
    found = []
    for key, truth in (("A_nm", COULOMB[j]), ("D_nm_s_per_rad", VISCOUS[j])):
        low, high = fit.ci95[key] or (None, None)
        assert low is not None and high is not None
        found.append(bool(low <= truth <= high))
    return found


def test_nine_runs_of_three_seconds_give_every_joint_a_law_whose_intervals_hold() -> None:
    inside: list[bool] = []
    for seed in range(8):
        fits = fit_joints(runs(seed), LINE)
        assert {fit.motion for fit in fits.values()} == {"any"}
        inside += [one for j, name in enumerate(NAMES) for one in held(fits[name], j)]
    assert sum(inside) >= 43, "of 48, 95 % each"


def test_the_zero_of_a_log_is_no_friction() -> None:
    plain, moved = (motion_points(runs(1, zero_nm=size), "joint2") for size in (0.0, 20.0))
    for a, b in zip(plain, moved, strict=True):
        assert abs((a.friction_nm - b.friction_nm) * a.direction - (plain[0].friction_nm - moved[0].friction_nm)) < 1e-3


def test_less_motion_is_a_wider_interval_and_none_a_reason() -> None:
    much, little = (fit_joints(runs(3, count), LINE)["joint1"] for count in (12, 3))
    wide = [np.ptp(fit.ci95["A_nm"]) for fit in (much, little)]  # type: ignore[arg-type]
    assert wide[1] > 1.5 * wide[0]
    still = fit_joints(runs(3, 1, 1.2), PLAIN)["joint1"]
    assert still.model is None and still.reason is not None and "moves too little" in still.reason
