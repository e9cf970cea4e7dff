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
from collaudit.core.identification.motion_sums import collect
from collaudit.core.identification.solved_problem import Candidate, with_gains
from collaudit.core.identification.sums_solution import Problem, held_out
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
    known = (whole, replace(whole, sums=collect([other], config.fit.blocks)))
    one, two = (fit_arm([log], taken, config, [out], of) for log, of in zip((prepared, other), known, strict=True))
    assert one.identified is not None and two.identified is not None and whole.identified is not None
    for name, body in one.identified.bodies.items():
        np.testing.assert_allclose(body.parameters, two.identified.bodies[name].parameters, rtol=1e-3, atol=1e-3)
    for name, fit in one.fits.items():
        np.testing.assert_allclose(
            list(fit.parameters.values()), list(two.fits[name].parameters.values()), rtol=1e-3, atol=1e-3
        )
    assert one.identified.joints != whole.identified.joints, "the samples left out count in the whole fit"
    (made,) = one.logs
    anew = calibrated(prepared, made.calibration, config)
    assert made.rigid_nm is not None and anew.rigid_nm is not None and whole.logs[0].rigid_nm is not None
    np.testing.assert_allclose(made.rigid_nm, anew.rigid_nm, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(made.series.effort, anew.series.effort, rtol=1e-12, atol=1e-12)
    assert np.abs(made.rigid_nm - whole.logs[0].rigid_nm).max() > 1e-3, "its torque is not that of the whole fit"


def test_held_out_errors_are_those_of_fits_without_each_part(made: Made) -> None:
    """Sums less a part, with the noise of all, beside a solution of the other blocks by themselves."""
    prepared, config = prepared_of(made("free-clean", "paper6", seed=4, duration_s=RUN_S), LACKING)
    sums = collect([prepared], 4)
    unknowns, _ = with_gains([prepared], config, Candidate(("inertials",), 0.2), sums)
    squares = np.zeros_like(sums.count)
    for number in range(4):
        out = sums.fold == number
        others = Problem.of(sums.some(~out), unknowns, drift=False)
        rest = others.rest(others.solved())
        squares[out] = np.einsum("jc,bjcd,jd->bj", rest, sums.raw[out], rest)
    found = held_out(sums, unknowns, [sums.fold])
    known = np.isfinite(found)
    assert (known == (sums.count >= 5)).all()
    for j in range(6):
        seen = known[:, j]
        total = sums.count[seen, j].sum()
        mine = np.sqrt(np.sum(sums.count[seen, j] * found[seen, j] ** 2) / total)
        assert mine == pytest.approx(np.sqrt(squares[seen, j].sum() / total), rel=0.03)


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
