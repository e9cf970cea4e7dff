"""Units and signs switched, and weights picked up, in the middle of a log: told with their time, and only then."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from collaudit.core import api
from collaudit.core.config import load_config
from collaudit.core.config.schema import Config
from collaudit.core.findings import Finding
from collaudit.core.prepare.prepared import Prepared, with_known_load
from collaudit.fixtures.compare import read_truth
from collaudit.fixtures.simulation import SimulatedFiles

Maker = Callable[..., SimulatedFiles]
CODES = ("effort-switched", "payload-changed")


def found(files: SimulatedFiles) -> list[Finding]:
    prepared = api.prepare(files.log, load_config(files.config))
    return [finding for finding in prepared.findings if finding.code in CODES]


def test_a_switched_unit_is_told_of_the_whole_arm(made: Maker, robot: str) -> None:
    files = made("faulty-unit-switch", robot, duration_s=20.0)
    (finding,) = found(files)
    assert finding.joint is None
    assert finding.effect == "not-judged-joint"
    assert finding.start_s == pytest.approx(read_truth(files.truth)["fault"]["from_s"], abs=0.1)


def test_a_switched_sign_is_told_of_its_joint(made: Maker, robot: str) -> None:
    files = made("faulty-sign-switch", robot, duration_s=20.0)
    fault = read_truth(files.truth)["fault"]
    (finding,) = found(files)
    assert finding.joint == fault["joint"]
    assert finding.start_s == pytest.approx(fault["from_s"], abs=0.1)


def test_a_payload_is_told_with_its_mass(made: Maker, robot: str) -> None:
    files = made("faulty-payload", robot, duration_s=20.0)
    fault = read_truth(files.truth)["fault"]
    (finding,) = found(files)
    assert finding.code == "payload-changed"
    assert finding.forbids_pass
    assert finding.start_s == pytest.approx(fault["from_s"], abs=1.1)
    told = float(finding.text.split("gains ")[1].split(" kg")[0])
    assert told == pytest.approx(fault["mass_kg"], rel=0.1)


@pytest.mark.parametrize(("scenario", "more"), [("stop-go", {"duration_s": 30.0}), ("polish-sine", {"seed": 2})])
def test_ordinary_runs_change_nothing(made: Maker, robot: str, scenario: str, more: dict[str, object]) -> None:
    assert found(made(scenario, robot, **more)) == []


def test_an_effort_inverted_from_the_start_is_no_payload(made: Maker, robot: str) -> None:
    files = made("free-clean", robot, duration_s=30.0)
    settings = load_config(files.config)
    prepared = api.prepare(files.log, settings)
    series, told = prepared.series, prepared.series.joint_names[1]
    assert series.effort is not None
    turned = series.effort * np.where(np.array(series.joint_names) == told, -1.0, 1.0)
    again = with_effort(prepared, turned, settings.config)
    assert "effort-sign-inverted" in {finding.code for finding in again.findings}
    assert [finding for finding in again.findings if finding.code in CODES] == []


def test_a_dead_effort_is_no_payload_and_hides_none(made: Maker, robot: str) -> None:
    for scenario, codes in (("free-clean", []), ("faulty-payload", ["payload-changed"])):
        files = made(scenario, robot, duration_s=20.0)
        settings = load_config(files.config)
        prepared = api.prepare(files.log, settings)
        assert prepared.series.effort is not None
        dead = prepared.series.effort.copy()
        dead[:, 2] = 0.0
        again = with_effort(prepared, dead, settings.config)
        assert [finding.code for finding in again.findings if finding.code in CODES] == codes
        assert not [finding for finding in again.findings if finding.code.startswith("arm-")]


def test_an_effort_unknown_at_the_end_of_a_short_log_leaves_no_room_for_a_payload(made: Maker, robot: str) -> None:
    files = made("free-clean", robot, duration_s=10.0)
    settings = load_config(files.config)
    prepared = api.prepare(files.log, settings)
    assert prepared.series.effort is not None
    lost = prepared.series.effort.copy()
    lost[prepared.series.time_s > 6.5] = np.nan
    again = with_effort(prepared, lost, settings.config)
    assert [finding.code for finding in again.findings if finding.code in CODES] == []


def with_effort(prepared: Prepared, effort: np.ndarray, config: Config) -> Prepared:
    """The log with another effort, (n, j) in model order."""
    start = replace(prepared.start, series=replace(prepared.start.series, effort=effort))
    return with_known_load(replace(prepared, start=start), np.zeros_like(effort), config)


def test_a_wrong_model_is_no_payload(made: Maker, robot: str) -> None:
    assert found(made("free-clean", robot, duration_s=20.0, mismatch_percent=10.0)) == []
