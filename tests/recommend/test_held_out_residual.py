"""What a fit without a part of the data may judge that part by."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from fixed_level import with_fixed_level

from collaudit.core.api import load_robot, open_log
from collaudit.core.config import load_config
from collaudit.core.config.schema import Config
from collaudit.core.data.friction_result import FrictionPoint
from collaudit.core.data.signals import State
from collaudit.core.friction.arm_fit import ArmFit, fit_arm
from collaudit.core.friction.friction_fitting import fit_friction
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.joint_fits import friction_models
from collaudit.core.friction.law_candidates import FrictionUnits
from collaudit.core.identification.solved_problem import Candidate
from collaudit.core.prepare.preparation import prepare
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.recommend.fitted_thresholds import fitted_thresholds
from collaudit.core.recommend.held_out_residual import (
    HeldOutResidual,
    _carries,
    fold_of_sample,
    held_out_residuals,
    residual_by,
)
from collaudit.fixtures.simulation import SimulatedFiles

LAW = "static-lugre"
TAKEN = Candidate((), 0.2)
UNITS = FrictionUnits("N·m", "rad/s", "nm", "rad")


def points(slowest: dict[int, float], seed: int = 0) -> list[FrictionPoint]:
    """Points of 0.25 + 0.1 exp(-12 v) + 0.18 v in both directions, each from its slowest speed to 1.2 rad/s."""
    rng = np.random.default_rng(seed)
    found = []
    for direction, slow in slowest.items():
        for v in np.geomspace(slow, 1.2, 20):
            friction = 0.25 + 0.1 * np.exp(-12.0 * v) + 0.18 * v + rng.normal(0.0, 0.004)
            found.append(FrictionPoint(float(v), float(friction), 0.004, 0.004, "model", direction, False))
    return sorted(found, key=lambda p: p.speed_rad_s)


def test_a_part_without_slow_motion_one_way_keeps_the_law_of_the_whole() -> None:
    """What fades with speed is not told by it forward: any number of N·m would do, and some 1e60 were taken."""
    whole = fit_friction(points({1: 0.01, -1: 0.01}), UNITS, LAW)
    assert whole.identifiable
    alike = fit_friction(points({1: 0.012, -1: 0.01}, seed=1), UNITS, LAW)
    assert _carries(alike, whole)
    lost = [fit_friction(points({1: 0.5, -1: 0.2}, seed=seed), UNITS, LAW) for seed in range(5)]
    assert not any(_carries(one, whole) for one in lost)
    narrow = fit_friction(points({1: 0.01, -1: 0.01})[:30], UNITS, LAW)
    assert not _carries(narrow, whole), "less than four fifths of the speeds"


Held = tuple[HeldOutResidual, ArmFit, Prepared, Config]


@pytest.fixture(scope="module", autouse=True)
def _friction_as_calibrated() -> Iterator[None]:
    """Blocks and the whole log would each follow a level of their own."""
    with pytest.MonkeyPatch.context() as patch:
        with_fixed_level(patch)
        yield


@pytest.fixture(scope="module")
def held(made: Callable[..., SimulatedFiles]) -> Held:
    """The held-out residual of clean motion, with the fit and the log it is of."""
    files = made("free-clean", "paper6", seed=4, duration_s=100.0)
    fixed = {"log.csv.wrench": None, "log.wrench_frame": None, "fit.blocks": 3}
    settings = load_config(files.config, fixed)
    log = open_log(files.log, settings)
    prepared, config = prepare(log, load_robot(settings, log.joint_names), settings.config), settings.config
    arm = fit_arm([prepared], TAKEN, config)
    (found,) = held_out_residuals([prepared], arm, TAKEN, {}, config)
    return found, arm, prepared, config


def test_a_block_is_judged_as_within_the_whole_log(held: Held) -> None:
    """Two seconds around it are enough, but for joints that move too little in them to tell friction."""
    found, arm, prepared, config = held
    fold = fold_of_sample(prepared.series, 3) == 1
    rest = fit_arm([prepared], TAKEN, config, [fold], arm)
    whole = residual_by(rest.logs[0], friction_models(rest.fits, prepared.judged_series)[0], config.detect)
    judged = (whole.state <= State.JUDGED) & fold[:, None]
    both = judged & found.judged
    assert np.count_nonzero(both) > 0.95 * np.count_nonzero(judged) > 0
    assert float(np.max(np.abs((found.torque_nm - whole.torque_nm)[both]))) < 1e-3


def test_pushes_at_most_standstills_hardly_raise_the_threshold_there(held: Held) -> None:
    """40 N·m at every standstill are no more than what friction holds there, or what the model is wrong by."""
    found, arm, _, config = held
    at_rest = found.evidence & ~found.judged
    pushed = replace(found, torque_nm=np.where(at_rest, 40.0, found.torque_nm))
    clean, spoilt = (fitted_thresholds([one], arm.fits, config).joints for one in (found, pushed))
    for joint, fit in arm.fits.items():
        law = FrictionModel.of(fit)
        assert law is not None
        assert spoilt[joint].levels == clean[joint].levels
        assert clean[joint].rest_nm <= spoilt[joint].rest_nm <= max(law.hold, clean[joint].levels[0].gamma_nm) < 20.0
