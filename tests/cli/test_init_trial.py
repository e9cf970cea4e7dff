"""``init`` audits the log with its own draft: what is judged exits 0, what is missing is said and exits 3."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from collaudit.cli.drafts import trial as trials
from collaudit.core.identification import log_cleaning


def _moved(arm, path: Path, rows: int) -> Path:
    """A log of accelerated motion with its efforts some rows late (early where negative)."""
    from collaudit.core.config import load_config
    from collaudit.core.robot.robot_building import build_robot

    model = build_robot(load_config(arm.config).config.robot, Path(), ["joint1", "joint2"])
    time = np.arange(60 * 250) / 250
    q = np.column_stack(
        [np.sin(1.3 * time) + 0.3 * np.sin(4.1 * time), 0.8 * np.sin(1.7 * time) + 0.3 * np.cos(5 * time)]
    )
    dq = np.gradient(q, 1 / 250, axis=0)
    tau = model.inverse_dynamics(q, dq, np.gradient(dq, 1 / 250, axis=0)) + np.tanh(dq / 0.01) + 1.5 * dq
    tau += np.random.default_rng(5).normal(0, 0.05, tau.shape)
    values, header = np.column_stack([time, q, dq, tau]), "t,q1,q2,dq1,dq2,tau1,tau2"
    values[:, 5:] = np.roll(values[:, 5:], rows, axis=0)
    np.savetxt(path, values[20:-20], delimiter=",", header=header, comments="", fmt="%.9g")
    return path


def test_the_draft_is_tried(arm, collaudit, tmp_path: Path) -> None:
    outcome = collaudit("init", arm.clean, "-c", arm.config, "-o", tmp_path / "c.toml")
    assert outcome.code == 0, outcome.err
    assert "2 of 2 joints judged" in outcome.err and "COULD BE JUDGED  " in outcome.err and "PASS" not in outcome.err
    assert "collaudit fit LOG -c" in outcome.err
    judged = ("detect", arm.clean, "-c", tmp_path / "c.toml")
    assert collaudit(*judged, "--friction", arm.friction).code == 0, "the file runs as it stands"
    alone = collaudit(*judged)
    assert alone.code == 3 and "NOT JUDGED" in alone.out


def test_a_dash_is_stdout_and_no_file(arm, collaudit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    outcome = collaudit("init", arm.clean, "-c", arm.config, "-o", "-")
    assert outcome.code == 0 and "[detect]" in outcome.out
    assert not Path("-").exists()


def test_thresholds_are_the_fits_and_never_a_guess(arm, collaudit, tmp_path: Path) -> None:
    text = re.sub(r"^gamma_nm.*\n", "", arm.config.read_text(), flags=re.MULTILINE)
    (tmp_path / "robot.toml").write_text(text)
    outcome = collaudit("init", arm.clean, "-c", tmp_path / "robot.toml", "-o", tmp_path / "c.toml")
    assert outcome.code == 0, outcome.err
    assert tomllib.loads(_text(tmp_path))["detect"]["gamma_nm"] == "auto"
    assert "2 of 2 joints judged" in outcome.err and "COULD BE JUDGED  " in outcome.err and "PASS" not in outcome.err
    assert collaudit("detect", arm.clean, "-c", tmp_path / "c.toml").code == 3, "not judged without a friction file"
    friction = tmp_path / "friction.json"
    assert collaudit("fit", arm.clean, "-c", tmp_path / "c.toml", "-o", friction).code == 0
    judged = collaudit("detect", arm.pushed, "-c", tmp_path / "c.toml", "--friction", friction)
    assert judged.code == 1, judged.out


def test_a_contact_is_no_reason_against_the_file(arm, collaudit, tmp_path: Path) -> None:
    given = ("-c", arm.config, "--set", f"friction.file='{arm.friction}'")
    outcome = collaudit("init", arm.pushed, *given, "-o", tmp_path / "c.toml")
    assert outcome.code == 0, outcome.err
    assert "2 of 2 joints judged\nFAIL  " in outcome.err and "1 contact" in outcome.err
    assert f"next: collaudit detect {arm.pushed} -c" in outcome.err


def test_a_missing_robot_is_said_with_its_line(arm, collaudit, tmp_path: Path) -> None:
    outcome = collaudit("init", arm.clean, "-o", tmp_path / "c.toml")
    assert outcome.code == 3
    assert '[robot] urdf = "arm.urdf"' in outcome.err and "next:" not in outcome.err
    assert "joint1, joint2" in outcome.err


def test_a_refused_fit_keeps_its_own_reason(arm, collaudit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Joints that move for a minute and look like contact all the time: neither too short nor too still."""
    monkeypatch.setattr(log_cleaning, "MOSTLY", -1.0)
    text = re.sub(r"^gamma_nm.*\n", "", arm.config.read_text(), flags=re.MULTILINE)
    (tmp_path / "robot.toml").write_text(text)
    outcome = collaudit("init", arm.clean, "-c", tmp_path / "robot.toml", "-o", tmp_path / "c.toml")
    assert outcome.code == 3
    assert "too still" not in outcome.err and "base_rpy_deg" in outcome.err, outcome.err


def test_a_log_too_still_for_friction_asks_for_another_run(arm, collaudit, tmp_path: Path) -> None:
    header, *rows = arm.clean.read_text().splitlines()
    still = [",".join([f"{k / 250:.3f}", *rows[0].split(",")[1:3], "0", "0", *row.split(",")[5:]])
             for k, row in enumerate(rows[:50] * 20)]  # fmt: skip
    log = tmp_path / "still.csv"
    log.write_text("\n".join([header, *still]) + "\n")
    outcome = collaudit("init", log, "-c", arm.config, "-o", tmp_path / "c.toml")
    assert outcome.code == 3
    assert "collaudit fit LOG" in outcome.err


def test_a_late_effort_is_measured_and_written(arm, collaudit, tmp_path: Path) -> None:
    log = _moved(arm, tmp_path / "late.csv", 10)
    outcome = collaudit("init", log, "-c", arm.config, "-o", tmp_path / "c.toml")
    text = (tmp_path / "c.toml").read_text()
    line = re.search(r"^effort_delay_ms = (\S+)  # measured: (\S+) to (\S+) ms", text, re.MULTILINE)
    assert line is not None, text
    assert float(line[2]) <= 40.0 <= float(line[3])
    assert tomllib.loads(text)["log"]["effort_delay_ms"] == pytest.approx(40, abs=4)
    assert "effort-delay" not in outcome.err, "the last trial has it taken off"
    again = collaudit("init", log, "-c", tmp_path / "c.toml", "-o", tmp_path / "d.toml")
    assert again.code == outcome.code and "as given" in (tmp_path / "d.toml").read_text()


def test_no_delay_is_written_where_none_is_shown(arm, collaudit, tmp_path: Path) -> None:
    collaudit("init", arm.clean, "-c", arm.config, "-o", tmp_path / "c.toml")
    text = (tmp_path / "c.toml").read_text()
    assert "effort_delay_ms" not in tomllib.loads(text)["log"]


def test_an_early_effort_is_shown_and_does_not_count(arm, collaudit, tmp_path: Path) -> None:
    log = _moved(arm, tmp_path / "early.csv", -10)
    collaudit("init", log, "-c", arm.config, "-o", tmp_path / "c.toml")
    text = (tmp_path / "c.toml").read_text()
    assert "effort_delay_ms" not in tomllib.loads(text)["log"]
    assert re.search(r"^# effort_delay_ms = -\S+  # measured: .* ahead of the motion", text, re.MULTILINE), text


def test_a_long_log_is_tried_on_a_stretch_and_said(arm, collaudit, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(trials, "MOST_VALUES", 2 * 250 * 20)
    outcome = collaudit("init", arm.clean, "-c", arm.config, "-o", tmp_path / "c.toml")
    assert re.search(r"trial on 20 s of the \d+(\.\d+)? s of this log", outcome.err), outcome.err


def test_each_answer_to_a_question_has_its_evidence(arm, collaudit, tmp_path: Path) -> None:
    header, *lines = arm.clean.read_text().splitlines()
    values = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    other = np.random.default_rng(3).normal(0, 3, (len(values), 2))
    log, robot = tmp_path / "two.csv", tmp_path / "robot.toml"
    names = header.replace("tau", "torque_sensor_a_") + ",torque_sensor_b_1,torque_sensor_b_2"
    np.savetxt(log, np.column_stack([values, other]), delimiter=",", header=names, comments="", fmt="%.9g")
    robot.write_text(arm.config.read_text().partition("[log.csv]")[0])
    outcome = collaudit("init", log, "-c", robot, "-o", tmp_path / "c.toml")
    assert outcome.code == 3
    shown = dict(
        re.findall(r'^# effort = "torque_sensor_(.)_\{i\}"  # the model explains (\d+) %', _text(tmp_path), re.M)
    )
    assert int(shown["a"]) > 70 > 10 > int(shown["b"])
    assert "effort" not in tomllib.loads(_text(tmp_path))["log"]["csv"], "evidence decides nothing"


@pytest.mark.parametrize("other", ["computed", "filtered"])
def test_measured_efforts_are_told_from_computed_ones(arm, collaudit, tmp_path: Path, other: str) -> None:
    """A model's torque has neither noise nor friction; a filtered measurement has friction, so that is asked."""
    from scipy.ndimage import gaussian_filter1d

    from collaudit.core.config import load_config
    from collaudit.core.robot.robot_building import build_robot

    late = np.genfromtxt(_moved(arm, tmp_path / "log.csv", 0), delimiter=",", skip_header=1)
    q, dq, tau = late[:, 1:3], late[:, 3:5], late[:, 5:7]
    model = build_robot(load_config(arm.config).config.robot, Path(), ["joint1", "joint2"])
    beside = model.inverse_dynamics(q, dq, np.gradient(dq, 1 / 250, axis=0))
    if other == "filtered":
        beside = gaussian_filter1d(gaussian_filter1d(tau, 25, axis=0), 25, axis=0)
    log, robot = tmp_path / "two.csv", tmp_path / "robot.toml"
    names = "t,q1,q2,dq1,dq2,torque_sensor_a_1,torque_sensor_a_2,torque_sensor_b_1,torque_sensor_b_2"
    np.savetxt(log, np.column_stack([late[:, :5], beside, tau]), delimiter=",", header=names, comments="", fmt="%.12g")
    robot.write_text(arm.config.read_text().partition("[log.csv]")[0])
    outcome = collaudit("init", log, "-c", robot, "-o", tmp_path / "c.toml")
    csv = tomllib.loads(_text(tmp_path))["log"]["csv"]
    if other == "computed":
        assert outcome.code == 0, outcome.err
        assert csv["effort"] == "torque_sensor_b_{i}"
        assert "torque_sensor_a_{i} has neither a sensor's noise nor friction" in _text(tmp_path)
        assert "QUESTION" not in _text(tmp_path)
    else:
        assert outcome.code == 3
        assert "effort" not in csv


def test_the_order_of_the_joints_has_its_evidence(arm, collaudit, tmp_path: Path) -> None:
    """The columns count a message's joints, which the robot sorts otherwise than the alphabet."""
    robot = tmp_path / "robot.toml"
    text = arm.config.read_text().partition("[log.csv]")[0]
    robot.write_text(
        text.replace("{ a = 0.4", '{ name = "lift", a = 0.4').replace("{ a = 0.3", '{ name = "bend", a = 0.3')
    )
    header, rest = arm.clean.read_text().split("\n", 1)
    for stem, field in (("dq", "velocity"), ("tau", "effort"), ("q", "position")):
        header = re.sub(rf"\b{stem}(\d)", rf"/joint_states/{field}.\1", header)
    log = tmp_path / "message.csv"
    log.write_text(f"{header}\n{rest}")
    assert collaudit("init", log, "-c", robot, "-o", tmp_path / "c.toml").code == 3
    shown = re.findall(r'^# joint_names = \{ joint1 = "(\w+)".*the model explains (\d+) %', _text(tmp_path), re.M)
    assert [name for name, _ in shown] == ["lift", "bend"]
    assert int(shown[0][1]) > int(shown[1][1])


def _text(folder: Path) -> str:
    return (folder / "c.toml").read_text()


def test_constants_of_currents_are_estimated_and_judged(arm, collaudit, tmp_path: Path) -> None:
    """From the description, with their intervals; the second motor turns against its joint."""
    log = _moved(arm, tmp_path / "currents.csv", 0)
    values = np.loadtxt(log, delimiter=",", skiprows=1)
    values[:, 5:] /= [12.5, -8.0]
    np.savetxt(log, values, delimiter=",", header="t,q1,q2,dq1,dq2,tau1,tau2", comments="", fmt="%.9g")
    given = ("-c", arm.config, "--set", 'log.units.effort="A"')
    outcome = collaudit("init", log, *given, "-o", tmp_path / "c.toml")
    assert outcome.code == 0 and "2 of 2 joints judged" in outcome.err, outcome.err
    text = (tmp_path / "c.toml").read_text(encoding="utf-8")
    units = tomllib.loads(text)["log"]["units"]
    assert units["effort"] == "A" and units["effort_sign"] == {"joint2": -1}
    assert units["torque_constant_nm_per_a"] == pytest.approx({"joint1": 12.5, "joint2": 8.0}, rel=0.02)
    assert re.search(r"torque_constant_nm_per_a = .*# GUESS: by gravity and inertia", text)
    spans = re.findall(r"(joint\d) [\d.]+ \[([\d.]+)\s+(?:#\s+)?to\s+(?:#\s+)?([\d.]+)\]", text)
    true = {"joint1": 12.5, "joint2": 8.0}
    assert [float(low) <= true[joint] <= float(high) for joint, low, high in spans[:2]] == [True, True]
    seen = collaudit("inspect", log, *given)
    assert seen.code == 2 and "currents.csv" in seen.out and "tau1" in seen.out, "what is in it, before what is missing"
    assert "no torque constant of 'joint1', 'joint2'" in seen.err


def test_a_constant_that_the_motion_does_not_tell_is_said(arm, collaudit, tmp_path: Path) -> None:
    """The second joint hardly moves and carries next to nothing that gravity could pull."""
    log = _moved(arm, tmp_path / "currents.csv", 0)
    values = np.loadtxt(log, delimiter=",", skiprows=1)
    noise = np.random.default_rng(2).normal(size=len(values))
    values[:, 6] = np.sign(values[:, 4]) + 0.3 * noise  # friction, and nothing of the arm
    values[:, 5] /= 12.5
    np.savetxt(log, values, delimiter=",", header="t,q1,q2,dq1,dq2,tau1,tau2", comments="", fmt="%.9g")
    outcome = collaudit("init", log, "-c", arm.config, "--set", 'log.units.effort="A"', "-o", tmp_path / "c.toml")
    text = (tmp_path / "c.toml").read_text(encoding="utf-8").replace("\n#", "")
    assert 'effort = "raw"  # GUESS' in text and "torque_constant_nm_per_a = {" not in text.partition("#")[0]
    assert "does not tell those of joint2. What would: motion that lifts" in text
    assert re.search(r"joint1 12\.\d+ \[", text)
    assert "1 of 2 joints have a residual" in outcome.err and "guided by hand" not in outcome.err, outcome.err


def test_any_key_may_be_set(arm, collaudit, tmp_path: Path) -> None:
    """Those of tables too that a draft does not have."""
    keys = {"fit.estimate": '["friction"]', "report.lab": '"cell 7"'}
    flags = [part for key, value in keys.items() for part in ("--set", f"{key}={value}")]
    outcome = collaudit("init", arm.clean, "-c", arm.config, *flags, "-o", tmp_path / "c.toml")
    assert outcome.code == 0, outcome.err
    made = tomllib.loads((tmp_path / "c.toml").read_text(encoding="utf-8"))
    assert made["fit"] == {"estimate": ["friction"]} and made["report"] == {"lab": "cell 7"}


def test_the_trial_applies_the_policy_of_detect(arm, collaudit, tmp_path: Path) -> None:
    """With a stated friction file nothing is allowed that detect would refuse: here, that of the log itself."""
    friction = tmp_path / "own.json"
    assert collaudit("fit", arm.clean, "-c", arm.config, "-o", friction).code == 0
    given = ("-c", arm.config, "--set", f"friction.file='{friction}'")
    tried = collaudit("init", arm.clean, *given, "-o", tmp_path / "c.toml")
    judged = collaudit("detect", arm.clean, "-c", tmp_path / "c.toml")
    assert tried.code == judged.code == 3
