"""What disturbs a standing joint is told from what it does by itself, and from motion that was asked for."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from origins import NOBODY
from synthetic import PERIOD, make_log, strokes

from collaudit.core import api
from collaudit.core.audit import audit_log
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.fitting import fit_logs
from collaudit.core.prepare.preparation import prepare
from collaudit.core.robot.robot_building import build_robot
from collaudit.reports.formats.ci_results import junit_text
from collaudit.reports.terminal.screen_text import screen_text

#: A pendulum of 2.4 N·m·sin(q) about a level axis, its encoder's count, and what noise its effort has.
COUNT, NOISE_NM = 2 * np.pi / 2**17, 0.15
CONFIG = {
    "robot": {
        "dh_convention": "standard",
        "dh": [{"a": 0.4, "mass_kg": 2.0, "com_m": [0, 0, 0], "inertia_kg_m2": [0, 0, 0.02, 0, 0, 0]}],
        "base_rpy_deg": [90, 0, 0],
    },
    "detect": {"gamma_nm": 2.0},
}
REST_S, ON_S, OFF_S = 12.0, 6.0, 7.0


def ramp(t: np.ndarray, at: float, rise: float = 0.03) -> np.ndarray:
    return np.clip((t - at) / rise, 0.0, 1.0)


def rest() -> np.ndarray:
    return PERIOD * np.arange(round(REST_S / PERIOD))


@cache
def moved() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Strokes and then rest: position, velocity, effort."""
    q, v = strokes(np.geomspace(0.08, 1.0, 8))
    q = np.concatenate([q, np.full(rest().size, q[-1])])
    v = np.concatenate([v, np.zeros(rest().size)])
    model = build_robot(Config.of(CONFIG).robot, Path(), ("joint1",))
    rigid = model.inverse_dynamics(q[:, None], v[:, None], np.gradient(v, PERIOD)[:, None])[:, 0]
    return q, v, rigid + np.sign(v) * (5.0 + 2.0 * np.abs(v))


@cache
def friction() -> FrictionFile:
    q, v, effort = moved()
    noise = np.random.default_rng(1).normal(0.0, NOISE_NM, q.size)
    return fit_logs([prepared(q, v, effort + noise)], Config.of(CONFIG), NOBODY)


def prepared(q: np.ndarray, v: np.ndarray, effort: np.ndarray):  # type: ignore[no-untyped-def]
    config = Config.of(CONFIG)
    q = np.round(q / COUNT) * COUNT
    log = make_log(PERIOD * np.arange(q.size), q[:, None], v[:, None], effort[:, None])
    return prepare(log, build_robot(config.robot, Path(), log.joint_names), config)


def judged(torque: np.ndarray | float, counts: np.ndarray | float, allowed: int = 0) -> AuditResult:
    """The run with torque and deflection added while it rests."""
    q, v, effort = (np.array(x) for x in moved())
    tail = slice(q.size - rest().size, None)
    effort[tail] += torque
    q[tail] += np.asarray(counts) * COUNT
    v[tail] = np.gradient(q[tail], PERIOD)
    noise = np.random.default_rng(2).normal(0.0, NOISE_NM, q.size)
    config = Config.of({**CONFIG, "policy": {"max_disturbed_at_rest": allowed}})
    return audit_log(prepared(q, v, effort + noise), config, friction(), NOBODY, siblings=None).result


def push(rise: float = 0.03) -> np.ndarray:
    return ramp(rest(), ON_S, rise) - ramp(rest(), OFF_S, rise)


@pytest.mark.parametrize("rise", [0.01, 0.1, 0.6])
def test_a_push_that_friction_hides_is_a_disturbance(rise: float) -> None:
    result = judged(1.5 * push(rise), -6.0 * push(rise))
    assert not result.contacts, "1.5 N·m is less than friction and threshold hide"
    (one,) = result.disturbances
    start = float(moved()[0].size * PERIOD - REST_S)
    assert one.onset_s == pytest.approx(start + ON_S + rise / 2, abs=0.25 + rise / 2)
    (joint,) = one.joints
    assert joint.torque_step_nm == pytest.approx(1.5, abs=0.3)
    assert joint.deflection_rad == pytest.approx(-6 * COUNT, abs=2 * COUNT)


@pytest.mark.parametrize("known", [True, False])
def test_an_arm_that_never_moves_is_looked_at_alike(known: bool) -> None:
    """What its quiet level does not show, the step of its place does; with a friction file and without."""
    q, _, effort = (x[-rest().size :].copy() for x in moved())
    q -= 6.0 * COUNT * push()
    noise = np.random.default_rng(2).normal(0.0, NOISE_NM, q.size)
    log = prepared(q, np.gradient(q, PERIOD), effort + 1.5 * push() + noise)
    config = Config.of(CONFIG)
    result = audit_log(log, config, friction() if known else None, NOBODY, siblings=None).result
    assert [one.onset_s for one in result.disturbances] == pytest.approx([ON_S], abs=0.3)
    assert result.verdict == "not_judged"


def test_no_plain_pass_stands_beside_it() -> None:
    result = judged(1.5 * push(), -6.0 * push())
    (finding,) = [f for f in result.findings if f.code == "disturbed-at-rest"]
    assert finding.forbids_pass
    assert result.verdict == "not_judged"
    assert finding.text in result.reasons
    assert "Standing joints were pushed or released once" in screen_text(result)
    assert "Standing joints were pushed or released once" in junit_text([result])
    accepted = judged(1.5 * push(), -6.0 * push(), allowed=1)
    assert accepted.verdict == "pass"
    assert any("Standing joints were pushed or released once" in text for text in accepted.exclusions)
    assert accepted.disturbances == result.disturbances


def test_as_a_table(monkeypatch: pytest.MonkeyPatch) -> None:
    result = judged(1.5 * push(), -6.0 * push())
    table = api.disturbances(replace(_audit(result)))
    assert list(table.joint) == ["joint1"]
    assert table.torque_step_nm[0] == pytest.approx(1.5, abs=0.3)
    assert api.disturbances(_audit(replace(result, disturbances=()))).empty


def _audit(result: AuditResult):  # type: ignore[no-untyped-def]
    from collaudit.core.data.audit_result import Audit

    return Audit(result, None)  # type: ignore[arg-type]


CLEAN = {
    "nothing": (0.0, 0.0),
    "torque alone: a drive that shifts its zero": (1.5 * push(), 0.0),
    "position alone: an encoder that dithers": (0.0, 6.0 * push()),
    "motion that was asked for: torque along it": (1.5 * push(), 6.0 * push()),
    "a creep that ends: it had not stood": (-1.5 * ramp(rest(), ON_S), 40.0 * np.clip(rest() - 3.0, 0.0, 3.0)),
    "drift": (2.0 * np.sin(rest() / 4.0), -12.0 * np.sin(rest() / 4.0)),
}


@pytest.mark.parametrize("case", CLEAN)
def test_what_is_no_disturbance(case: str) -> None:
    result = judged(*CLEAN[case])
    assert not result.disturbances
    assert "disturbed-at-rest" not in {f.code for f in result.findings}


@pytest.mark.parametrize("sag", [-20.0, 20.0])
def test_brakes_that_take_the_load_are_no_disturbance(sag: float) -> None:
    held = moved()[2][-1]
    on = ramp(rest(), 4.0) - ramp(rest(), 9.0)
    assert abs(held) > 1.0, "gravity loads the joint"
    assert not judged(-held * on, sag * on).disturbances


def test_a_contact_is_no_disturbance_besides() -> None:
    """A blow beyond friction and threshold alarms; its steps are the same event."""
    result = judged(16.0 * push(), -60.0 * push())
    assert len(result.contacts) == 1
    assert not result.disturbances
