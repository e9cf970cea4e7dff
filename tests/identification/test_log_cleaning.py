"""Contacts inside a fitting log are found and left out; a clean log is left whole; mostly contact is refused."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from simulated_logs import FEWER_SPEEDS, without_thresholds

from collaudit.core import api
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.errors import ConfigError, NotJudgedError
from collaudit.core.identification.log_cleaning import (
    FAR,
    _reaching,
    cleaned,
    find_contact,
    labelled_contact,
    refuse_if_nothing_is_left,
)
from collaudit.core.numeric.arrays import BoolArray
from collaudit.core.prepare.preparation import modelled
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.scoring.detection_score import TruthFile
from collaudit.fixtures.simulation import SimulatedFiles

FREE = {"duration_s": 60.0}


@pytest.fixture(scope="module")
def free(made: Callable[..., SimulatedFiles]) -> Callable[[str], tuple[Prepared, Any]]:
    """A minute of fast motion without contact, and its settings."""
    kept: dict[str, tuple[Prepared, Any]] = {}

    def log(robot: str) -> tuple[Prepared, Any]:
        if robot not in kept:
            files = made("free-clean", robot, **FREE)
            settings = load_config(files.config)
            kept[robot] = (api.prepare(files.log, settings), settings)
        return kept[robot]

    return log


def pushed(log: Prepared, settings: Any, share: float, seed: int = 1) -> tuple[Prepared, BoolArray]:
    """The log with pushes of 5 to 60 N·m for this share of its time, each on the joints below some link."""
    rng = np.random.default_rng(seed)
    series = log.start.series
    assert series.effort is not None
    effort, n = series.effort.copy(order="F"), series.time_s.size
    unit = np.array([1.0] * effort.shape[1])
    touched = np.zeros(n, dtype=bool)
    while touched.mean() < share:
        start, length = int(rng.integers(0, n - 50)), int(rng.uniform(0.2, 1.5) / series.period_s)
        stop = min(n, start + length)
        if touched[start:stop].any():
            continue
        edge = np.minimum(1.0, np.minimum(np.arange(stop - start) + 1, stop - start - np.arange(stop - start)) / 20.0)
        size = rng.uniform(5.0, 60.0) * rng.choice([-1, 1])
        for joint in range(int(rng.integers(1, effort.shape[1] + 1))):
            arm = 1.0 if joint == 0 else rng.uniform(0.2, 1.0) * rng.choice([-1, 1])
            effort[start:stop, joint] += unit[joint] * size * arm * edge
        touched[start:stop] = True
    start_of = replace(log.start, series=replace(series, effort=effort))
    return modelled(start_of, settings.config, log.calibration), touched


def errors(fitted: FrictionFile, clean: FrictionFile) -> dict[str, float]:
    """Largest difference of each joint's friction from the fit without contact, as a share of it."""
    from collaudit.core.friction.friction_model import FrictionModel

    out = {}
    for joint, fit in clean.joints.items():
        law, other = FrictionModel.of(fit), FrictionModel.of(fitted.joints[joint])
        assert law is not None
        assert other is not None
        grid = np.linspace(0.1, law.speed_range[1], 30)
        out[joint] = float(np.max(np.abs(law.torque(grid) - other.torque(grid))) / np.mean(law.torque(grid)))
    return out


def test_a_clean_log_is_left_whole(free: Any, robot: str) -> None:
    log, settings = free(robot)
    found = cleaned([log], settings.config)
    assert found.logs == (log,)  # the very log: the fit is the same to the last bit
    (facts,) = found.left_out.values()
    assert (facts.by, facts.spans, facts.share, facts.refused) == ("found", (), 0.0, False)
    assert found.findings == ()


@pytest.mark.parametrize(("robot", "share"), [("paper6", 0.3)])
def test_pushes_in_the_fitting_log_are_left_out(
    free: Any, own_fit: Callable[..., FrictionFile], robot: str, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = own_fit("free-clean", robot, **FREE)  # as every test has it; those below for their curves only
    without_thresholds(monkeypatch)
    clean, settings = free(robot)
    log, touched = pushed(clean, settings, share)
    out, facts = find_contact(log)
    moving = (np.abs(log.series.velocity_rad_s) > 0.05).any(axis=1)
    assert np.mean(out[touched & moving]) > 0.85
    assert np.mean(out[~touched]) < 0.25
    assert not facts.refused
    assert facts.spans[0].joints
    dirty = api.fit([log], settings)
    kept = replace(settings, config=settings.config.changed({"fit": _contact(settings, "none")}))
    wrong = errors(api.fit([log], kept), right)
    rescued = errors(dirty, right)
    assert max(rescued.values()) < 0.15
    assert np.median(list(rescued.values())) < 0.5 * np.median(list(wrong.values()))
    assert [f.code for f in dirty.findings if f.code.startswith("fit-")] == ["fit-left-out"]


def _contact(settings: Any, how: str) -> Any:
    return settings.config.fit.changed({"contact": how})


def test_a_log_that_is_mostly_contact_is_refused(free: Any) -> None:
    clean, settings = free("seven")
    log, _ = pushed(clean, settings, 0.6)
    with pytest.raises(NotJudgedError, match="most of the motion"):
        api.fit([log], settings)
    both = cleaned([clean, log], settings.config)
    assert [f.code for f in both.findings] == ["fit-left-out"]
    assert both.logs[1].series.effort is not None
    assert np.isnan(both.logs[1].series.effort).all()


def test_two_swapped_efforts_are_named_and_contact_is_not_their_only_cause(free: Any) -> None:
    clean, settings = free("paper6")
    series = clean.start.series
    swapped = replace(series, effort=np.asfortranarray(series.effort[:, [0, 1, 2, 3, 5, 4]]))
    log = modelled(replace(clean.start, series=swapped), settings.config, clean.calibration)
    found = cleaned([log], settings.config)
    with pytest.raises(NotJudgedError) as refused:
        refuse_if_nothing_is_left(found)
    assert re.fullmatch(r"\d+ % \(joint5 \d+ %, joint6 \d+ %\) of .*", refused.value.found or "")
    assert "joint5" in found.findings[0].text and "order of joints" in found.findings[0].text
    said = refused.value.hint or ""
    causes = ("description", "base_rpy_deg", "order of the joints", "sign and unit", "true_events", "[fit] contact")
    assert sorted(causes, key=said.index) == list(causes)


def test_a_wrong_statement_leaves_nothing_out_and_is_said(free: Any) -> None:
    clean, settings = free("paper6")
    stated = settings.config.changed({"fit": _contact(settings, "none")})
    log, _ = pushed(clean, settings, 0.1)
    found = cleaned([log], stated)
    assert found.logs == (log,)
    assert [f.code for f in found.findings] == ["fit-contact-suspected"]
    assert cleaned([clean], stated).findings == ()


def test_known_contact_is_left_out_and_nothing_else(free: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    without_thresholds(monkeypatch)
    clean, settings = free("paper6")
    out, facts = labelled_contact(clean, [(10.0, 11.0), (20.0, 20.5)])
    at = clean.series.time_s
    assert out[(at >= 10.0) & (at <= 11.0)].all()
    assert not out[(at > 11.3) & (at < 19.7)].any()
    assert [span.joints for span in facts.spans] == [(), ()]
    log, _ = pushed(clean, settings, 0.1)
    truth = TruthFile("contacts.csv", "onset_s,end_s\n10,11\n20,20.5\n")
    fitted = api.fit([log], settings, truth=[truth])
    codes = [f.code for f in fitted.findings if f.code.startswith("fit-")]
    assert codes == ["fit-left-out", "fit-contact-suspected"]
    assert next(iter(fitted.left_out.values())).by == "labels"


def test_labels_have_to_be_named(free: Any) -> None:
    clean, settings = free("paper6")
    asked = replace(settings, config=settings.config.changed({"fit": _contact(settings, "labelled")}))
    with pytest.raises(ConfigError, match="no labels"):
        api.fit([clean], asked)


def test_polishing_is_no_contact_to_leave_out(made: Any, robot: str) -> None:
    files = made("polish-sine", robot, 2)
    settings = load_config(files.config)
    _, facts = find_contact(api.prepare(files.log, settings))
    assert facts.share < 0.06  # the pushes on the arm are found, the tool's force is not
    assert all(any(abs(span.start_s - at) < 0.6 for at in (29.0, 41.0)) for span in facts.spans)


def test_an_identification_run_is_left_whole(made: Any, robot: str) -> None:
    files = made("friction", robot, speeds=FEWER_SPEEDS)  # the run that other tests fit
    _, facts = find_contact(api.prepare(files.log, load_config(files.config)))
    assert facts.spans == ()


def test_real_motion_is_nearly_left_whole(data_dir: Path, tmp_path: Path) -> None:
    config = tmp_path / "c.toml"
    config.write_text(f'[robot]\nurdf = "{data_dir}/urdf/ur10_robot.urdf"\n')
    (log,) = (data_dir / "ur10_db3").glob("*.db3")
    _, facts = find_contact(api.prepare(log, load_config(config)))
    assert facts.share < 0.1


def clamped(log: Prepared, settings: Any, share: float, torque_nm: dict[int, float]) -> tuple[Prepared, BoolArray]:
    """The log with a constant torque on some joints for one part of its time, from a quarter of it on."""
    series = log.start.series
    assert series.effort is not None
    effort, n = series.effort.copy(order="F"), series.time_s.size
    touched = np.zeros(n, dtype=bool)
    touched[n // 4 : n // 4 + round(share * n)] = True
    for joint, torque in torque_nm.items():
        effort[touched, joint] += torque
    start = replace(log.start, series=replace(series, effort=effort))
    return modelled(start, settings.config, log.calibration), touched


@pytest.mark.parametrize(("share", "torque_nm"), [(0.08, {0: -12.0}), (0.25, {4: 6.0}), (0.35, {0: 9.0, 3: -3.0})])
def test_a_clamp_is_left_out_however_long_it_lasts(
    free: Any, robot: str, share: float, torque_nm: dict[int, float]
) -> None:
    clean, settings = free(robot)
    log, touched = clamped(clean, settings, share, torque_nm)
    out, facts = find_contact(log)
    moving = (np.abs(log.series.velocity_rad_s) > 0.05).any(axis=1)
    assert out[touched & moving].mean() > 0.9
    assert out[~touched].mean() < 0.05
    assert not facts.refused


def test_half_of_a_log_under_a_clamp_is_refused(free: Any, robot: str) -> None:
    clean, settings = free(robot)
    log, _ = clamped(clean, settings, 0.46, {1: 15.0})
    assert find_contact(log)[1].refused


def test_a_real_arm_that_is_clamped_is_seen_and_a_free_one_is_left_whole(data_dir: Path, tmp_path: Path) -> None:
    config = tmp_path / "c.toml"
    config.write_text(f'[robot]\nurdf = "{data_dir}/urdf/ur10_robot.urdf"\n')
    settings = load_config(config)
    (log,) = (data_dir / "ur10_db3").glob("*.db3")
    free = api.prepare(log, settings)
    assert find_contact(free)[1].spans == ()
    held, touched = clamped(free, settings, 0.3, {0: 30.0, 2: 25.0})
    out, facts = find_contact(held)
    assert out[touched].mean() > 0.8
    assert out[~touched].mean() < 0.25
    assert facts.share > 0.25


def plain_runs(mask: BoolArray) -> list[tuple[int, int]]:
    """First and last sample but one of each run, sample by sample."""
    out: list[tuple[int, int]] = []
    for k in np.flatnonzero(mask).tolist():
        out = [*out[:-1], (out[-1][0], k + 1)] if out and out[-1][1] == k else [*out, (k, k + 1)]
    return out


def test_a_stretch_reaches_as_far_as_its_residual_is_near() -> None:
    rng, period = np.random.default_rng(3), 0.02
    ratio = np.abs(np.convolve(rng.standard_normal(5000), np.hanning(25), "same")) * 1.2
    found, near = _reaching(ratio, period)
    expected = ratio > 3.0
    for (_, stop), (start, _) in pairwise(plain_runs(expected)):
        expected[stop:start] |= start - stop <= round(0.1 / period)
    assert np.array_equal(near, expected)
    cores = [run for run in plain_runs(ratio > FAR) if run[1] - run[0] >= 2]
    for start, stop in plain_runs(expected):
        expected[start:stop] = any(start <= a and b <= stop for a, b in cores)
    np.testing.assert_array_equal(found, expected)
    assert np.count_nonzero(near) > np.count_nonzero(found) > sum(stop - start for start, stop in cores) > 0
