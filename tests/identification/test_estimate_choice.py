"""What a fit identifies is chosen by motion that it has not seen: what a right description needs, and a poor one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from collaudit.core.api import load_robot, open_log
from collaudit.core.config import load_config
from collaudit.core.config.schema import Config
from collaudit.core.friction.arm_fit import fit_arm
from collaudit.core.identification.estimate_choice import choose, choose_estimate
from collaudit.core.identification.problem.identification_problem import residual, solve
from collaudit.core.identification.problem.identification_samples import collect
from collaudit.core.identification.problem.problem_terms import Terms
from collaudit.core.identification.problem.solution_errors import held_out
from collaudit.core.identification.solved_problem import MOST_HELD_OUT, Candidate, with_gains
from collaudit.core.prepare.preparation import calibrated, prepare
from collaudit.core.prepare.prepared import Prepared
from collaudit.fixtures.simulation import SimulatedFiles

Made = Callable[..., SimulatedFiles]
#: Every joint goes to and fro several times.
RUN_S = 30.0
#: As most descriptions are: no tool, no rotors, no wrench sensor that would tell the tool.
LACKING: dict[str, Any] = {
    "robot.tool.mass_kg": 0.0,
    "robot.armature_kg_m2": None,
    "log.csv.wrench": None,
    "log.wrench_frame": None,
}


def prepared_of(files: SimulatedFiles, lacking: dict[str, Any]) -> tuple[Prepared, Config]:
    settings = load_config(files.config, lacking)
    log = open_log(files.log, settings)
    return prepare(log, load_robot(settings, log.joint_names), settings.config), settings.config


@pytest.mark.parametrize("robot", ["paper6", "seven"])
def test_a_right_description_is_left_alone_and_a_poor_one_is_not(made: Made, robot: str) -> None:
    files = made("free-clean", robot, seed=4, duration_s=RUN_S)
    prepared, config = prepared_of(files, {})
    taken, choice = choose([prepared], config)
    assert taken.estimate == () and choice is not None
    prepared, config = prepared_of(files, LACKING)
    taken, choice = choose([prepared], config)
    assert taken.estimate == ("rotor", "tool") and choice is not None
    alone = choice.tried[0].held_out_rms_nm
    (better,) = [one.held_out_rms_nm for one in choice.tried if one.what == choice.taken]
    assert sum(better.values()) < 0.7 * sum(alone.values())


def test_a_stated_estimate_is_taken_and_what_leaves_less_is_told(made: Made) -> None:
    """... and nothing where the stated one is as good."""
    files = made("free-clean", "paper6", seed=4, duration_s=RUN_S)
    prepared, config = prepared_of(files, {**LACKING, "fit.estimate": ["friction"]})
    taken, choice = choose([prepared], config)
    assert taken.estimate == () and choice is not None and choice.better == "friction, rotor, tool"
    shares = [choice.gain_of(joint) for joint in prepared.judged]
    assert min(share for share in shares if share is not None) < 0.7
    prepared, config = prepared_of(files, {"fit.estimate": ["friction"]})
    assert choose([prepared], config)[1] is None


def test_what_was_left_out_of_a_fit_changes_nothing_of_it(made: Made) -> None:
    """Neither drives, inertials nor friction, which all see the same samples."""
    prepared, config = prepared_of(made("free-clean", "paper6", seed=4, duration_s=RUN_S), LACKING)
    taken = Candidate(("rotor", "tool"), 0.2)
    whole = fit_arm([prepared], taken, config)
    out = (prepared.series.time_s % 20.0) < 6.0
    assert prepared.series.effort is not None
    effort = prepared.series.effort.copy()
    effort[out] = 3.0 * effort[out] + 50.0
    other = replace(prepared, series=replace(prepared.series, effort=effort))
    samples = collect([other], config.fit.max_samples, config.fit.blocks).at_most(MOST_HELD_OUT)
    known = (whole, replace(whole, samples=samples))
    one, two = (fit_arm([log], taken, config, [out], of) for log, of in zip((prepared, other), known, strict=True))
    assert one.identified == two.identified
    assert {j: f.parameters for j, f in one.fits.items()} == {j: f.parameters for j, f in two.fits.items()}
    assert one.identified is not None and whole.identified is not None
    assert one.identified.joints != whole.identified.joints, "the samples left out count in the whole fit"
    (made,) = one.logs
    anew = calibrated(prepared, made.calibration, config)
    assert made.rigid_nm is not None and anew.rigid_nm is not None and whole.logs[0].rigid_nm is not None
    np.testing.assert_allclose(made.rigid_nm, anew.rigid_nm, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(made.series.effort, anew.series.effort, rtol=1e-12, atol=1e-12)
    assert np.abs(made.rigid_nm - whole.logs[0].rigid_nm).max() > 1e-3, "its torque is not that of the whole fit"


def test_held_out_errors_are_those_of_fits_without_each_part(made: Made) -> None:
    """From the normal equations of one fit, beside a fit for each part."""
    prepared, config = prepared_of(made("free-clean", "paper6", seed=4, duration_s=RUN_S), LACKING)
    motion = collect([prepared], 1000, 4)
    unknowns, _ = with_gains([prepared], config, Candidate(("inertials",), 0.2), motion)
    terms = Terms.of(motion, unknowns).without_drift()
    plain = np.full_like(motion.effort, np.nan)
    for number in range(4):
        out = motion.block == number
        others = replace(terms, motion=replace(motion, moving=motion.moving & ~out[:, None]))
        plain[out] = residual(others, solve(others, unknowns, 12))[out]
    found = held_out(terms, unknowns, [motion.block])
    for j in range(6):
        seen = motion.moving[:, j]
        assert np.sqrt(np.mean(found[seen, j] ** 2)) == pytest.approx(np.sqrt(np.mean(plain[seen, j] ** 2)), rel=0.03)
        assert np.isnan(found[~seen, j]).all()


def test_a_tool_that_cannot_be_is_shown_and_not_taken() -> None:
    tried = [Candidate(part, 0.2) for part in ((), ("rotor",), ("rotor", "tool"), ("inertials",))]
    rng = np.random.default_rng(0)
    left = [size * rng.normal(size=(500, 2)) for size in (4.0, 3.0, 1.0, 1.5)]
    cluster, names = np.arange(500) // 10, ("a", "b")
    taken, _ = choose_estimate(tried, left, cluster, names, lambda _: "")
    assert taken is tried[2]
    taken, choice = choose_estimate(
        tried, left, cluster, names, lambda one: "lighter than nothing" * ("tool" in one.estimate)
    )
    assert taken is tried[3]
    assert [one.refused for one in choice.tried] == [None, None, "lighter than nothing", None]
    assert choice.tried[3].worse == 0.0
