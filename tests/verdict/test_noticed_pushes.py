"""Pushes of the size that is said to alarm in 95 % of the time do; clean logs of sound arms pass by what is asked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from origins import NOBODY
from simulated_logs import without_thresholds

from collaudit.core.api import load_robot, open_log
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.fitting import fit_logs
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.preparation import prepare
from collaudit.core.verdict import sensitivity
from collaudit.fixtures.compare import audit_simulated
from collaudit.fixtures.simulation import SimulatedFiles

Made = Callable[..., SimulatedFiles]
Fitted = Callable[[str], FrictionFile]
#: What is identified from so much fast motion of every joint is known to 1 %, a fifth of the narrowest tolerance here.
RUN_S = 20.0
#: Two standard errors of a half, of 144 pushes.
HALF_WITHIN = 2 * 0.5 / 144**0.5


def height_of(result: AuditResult, joint: str, share: float) -> float:
    """The push on a joint that is said to alarm at a share of the moments, N·m."""
    assert result.sensitivity is not None
    (height,) = [x.torque_nm for x in result.sensitivity.joints[joint].levels if x.share == share]
    assert height is not None
    return height


@pytest.mark.parametrize(
    ("push_ms", "detect", "share", "least", "most"),
    [
        (200.0, {}, 0.95, 0.95, 1.0),
        (200.0, {"detect.gamma_nm": "sharpest"}, 0.5, 0.5 - HALF_WITHIN, 0.5 + HALF_WITHIN),
        (40.0, {"detect.detector": "momentum", "detect.causal": True}, 0.95, 0.95, 1.0),
    ],
)
def test_a_push_alarms_as_often_as_is_said(
    made: Made,
    friction_of: Fitted,
    push_ms: float,
    detect: dict[str, Any],
    share: float,
    least: float,
    most: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """At any moment, whichever its sign, on joints with much and with little friction; the half within two errors."""
    files, friction = made("free-clean", "paper6", seed=4, duration_s=90.0), friction_of("paper6")
    monkeypatch.setattr(sensitivity, "PUSH_S", push_ms / 1e3)
    settings = load_config(files.config, detect)
    log = open_log(files.log, settings)
    robot = load_robot(settings, log.joint_names)

    def judged(effort: np.ndarray) -> AuditResult:
        prepared = prepare(replace(log, effort=effort), robot, settings.config)
        return audit_log(prepared, settings.config, friction, NOBODY, siblings=None).result

    clean, rng = judged(log.effort), np.random.default_rng(0)
    heights = {joint: height_of(clean, joint, share) for joint in ("joint2", "joint6")}
    starts = {joint: np.arange(1.0, 87.0, 1.2) + rng.uniform(0.0, 0.3, 72) for joint in heights}

    def noticed(sign: float) -> np.ndarray:
        effort = np.array(log.effort)
        for joint, height in heights.items():
            for k, start in enumerate(starts[joint]):  # one sign for a sixth of the time would be a zero of the torque
                pushed = (log.time_s >= start) & (log.time_s < start + push_ms / 1e3)
                effort[pushed, log.joint_names.index(joint)] += sign * (-1) ** k * height
        result = judged(effort)
        alarms = [(c.joint, c.onset_s, c.onset_s + c.duration_s) for c in result.collisions]
        return np.array([alarmed(alarms, joint, s) for joint in heights for s in starts[joint]])

    def alarmed(alarms: list[tuple[str, float, float]], joint: str, start: float) -> bool:
        return any(name == joint and a < start + push_ms / 1e3 + 0.1 and b > start - 0.1 for name, a, b in alarms)

    up, down = noticed(1.0), noticed(-1.0)
    found, tried = np.count_nonzero(up & down), up.size
    assert least * tried <= found <= most * tried, f"{found} of {tried}"


def test_a_scale_that_the_fitted_log_had_too_is_no_secret(made: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    """Efforts of 0.8 times the torque in both logs: identified inertials take it up, and the residual stays small."""
    without_thresholds(monkeypatch)
    runs = [made("free-clean", "paper6", seed=seed, duration_s=RUN_S) for seed in (4, 5)]
    settings = load_config(runs[0].config, {"fit.estimate": ["friction", "inertials"]})
    logs = [open_log(files.log, settings) for files in runs]
    robot, config = load_robot(settings, logs[0].joint_names), settings.config
    scaled = [replace(log, effort=None if log.effort is None else 0.8 * log.effort) for log in logs]
    friction = fit_logs([prepare(scaled[0], robot, config)], config, NOBODY)
    judged = audit_log(
        prepare(scaled[1], robot, config, Calibration.of(friction, config)), config, friction, NOBODY, siblings=None
    )
    off = [text for text in judged.result.exclusions if "times as large there" in text]
    assert len(off) >= 4, judged.result.exclusions  # at the wrist a load would do the same
    shown = [float(text.partition("appear ")[2].partition(" times")[0]) for text in off]
    assert shown == pytest.approx([0.8] * len(off), abs=0.05)


#: As most descriptions are: without tool and rotors, and no wrist sensor that would tell the tool.
LACKING = {
    "detect.gamma_nm": "auto",
    "robot.tool.mass_kg": 0.0,
    "robot.armature_kg_m2": None,
    "log.csv.wrench": None,
    "log.wrench_frame": None,
}


@pytest.mark.parametrize(("scale", "verdict"), [(1.0, "clean"), (1.25, "doubted"), (0.2, "refused")])
def test_what_a_description_lacks_is_no_scale_and_a_scale_shows_beside_it(
    made: Made, scale: float, verdict: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An arm described without tool and rotors passes once they are identified; efforts scaled in both logs do not."""
    if verdict != "clean":  # by findings, whatever the thresholds are
        without_thresholds(monkeypatch)
    runs = [made("free-clean", "paper6", seed=seed, duration_s=RUN_S) for seed in (4, 5)]
    settings = load_config(runs[0].config, LACKING)
    logs = [open_log(files.log, settings) for files in runs]
    arm, config = load_robot(settings, logs[0].joint_names), settings.config
    scaled = [replace(log, effort=None if log.effort is None else scale * log.effort) for log in logs]
    friction = fit_logs([prepare(scaled[0], arm, config)], config, NOBODY)
    judged = audit_log(
        prepare(scaled[1], arm, config, Calibration.of(friction, config)), config, friction, NOBODY, siblings=None
    )
    for found in (friction.findings, judged.result.findings):
        doubts = [f for f in found if f.code in ("effort-gain", "effort-no-torque")]
        assert bool(doubts) == (verdict != "clean"), doubts
    if verdict == "refused":  # what was identified has taken up the scale, so nothing is off against that
        assert any(f.code == "effort-no-torque" and f.forbids_pass for f in judged.result.findings)
    if verdict == "clean":
        assert judged.result.verdict == "pass", judged.result.reasons


def test_an_identified_gain_that_contradicts_its_constant_is_told(made: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    without_thresholds(monkeypatch)
    files = made("free-clean", "paper6", seed=4, duration_s=RUN_S)
    settings = load_config(files.config, {"fit.estimate": ["friction", "gain"]})
    log = open_log(files.log, settings)
    arm, config = load_robot(settings, log.joint_names), settings.config
    for scale in (1.0, 0.5):
        scaled = replace(log, effort=None if log.effort is None else scale * log.effort)
        friction = fit_logs([prepare(scaled, arm, config)], config, NOBODY)
        judged = prepare(scaled, arm, config, Calibration.of(friction, config))
        told = [f for f in judged.findings if f.code == "effort-gain"]
        assert all(f.excludes for f in told)
        assert len(told) == (0 if scale == 1.0 else len(judged.judged))


@pytest.mark.parametrize("robot", ["paper6", "seven"])
@pytest.mark.parametrize("gamma", [4.0, "auto"])
def test_clean_logs_of_sound_arms_pass_by_the_force_asked_for(
    made: Made, friction_of: Fitted, robot: str, gamma: object
) -> None:
    files = made("free-clean", robot, seed=4, duration_s=RUN_S)
    found = audit_simulated(files, friction_of(robot), {"detect.gamma_nm": gamma}).result
    assert found.verdict == "pass", found.reasons
    assert found.sensitivity is not None
    asked = {force.place: force for force in found.sensitivity.forces if force.asked is not None}
    assert list(asked) == ["forearm", "tool"]
    for force in asked.values():
        assert force.asked is not None and force.asked.share > 0.95
        assert (force.at(0.9) or np.inf) < 50.0, "with a factor of two to spare"
