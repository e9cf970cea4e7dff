"""Findings, terminal and JSON speak of a prismatic joint in N, m and m/s."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from arms import LEVEL, dh_robot, dh_row
from origins import NOBODY
from synthetic import PERIOD, make_log

from collaudit.core.audit import audit_log
from collaudit.core.config.schema import Config
from collaudit.core.findings import Finding, fact, in_joint_units
from collaudit.core.prepare.preparation import prepare
from collaudit.core.robot.robot_building import build_robot
from collaudit.reports.values.words import rule_text


def test_findings_of_a_sliding_joint_speak_of_forces_and_ways() -> None:
    torso = Finding("residual-level", "warning", "4 N·m at 0.2 rad/s, 3 N·m·s/rad, 0.1 rad", joint="torso")
    arm = Finding("residual-level", "warning", "4 N·m at 0.2 rad/s", joint="arm")
    both = fact("Thresholds (N·m): torso 30, arm 4.")
    sliding, turning, named = in_joint_units((torso, arm, both), ("torso",))
    assert sliding.text == "4 N at 0.2 m/s, 3 N·s/m, 0.1 m"
    assert turning is arm
    assert named.text == "Thresholds (N·m): torso 30, arm 4. (torso slides: N, m and m/s.)"
    assert in_joint_units((sliding, named), ("torso",)) == (sliding, named)


def test_an_audit_states_the_unit_of_each_joint() -> None:
    rows = [dh_row(4.0, (0, 0, 0), (0, 0, 0.05), joint="prismatic"), dh_row(2.0, (0, 0, 0), (0, 0, 0.05), a=0.3)]
    config = Config.of(
        {
            "robot": dh_robot(rows, **LEVEL),
            "detect": {"gamma_nm": 7.0},
            "policy": {"observable_share": 1.0, "observable_nm": 9.0},
        }
    )
    t = PERIOD * np.arange(6000)
    q = np.stack([0.2 * np.sin(t), 0.4 * np.sin(0.7 * t)], axis=1)
    v = np.gradient(q, PERIOD, axis=0)
    robot = build_robot(config.robot, Path(), ("joint1", "joint2"))
    effort = robot.inverse_dynamics(q, v, np.gradient(v, PERIOD, axis=0)) + 20.0 * np.sign(v)
    effort += np.random.default_rng(0).normal(0.0, 0.3, v.shape)
    log = make_log(t, q, v, effort, ("joint1", "joint2"))
    result = audit_log(prepare(log, robot, config), config, None, NOBODY, siblings=None).result
    assert result.log.units == {"joint1": "N", "joint2": "N·m"}
    assert not [f for f in result.findings if f.joint == "joint1" and ("N·m" in f.text or "rad" in f.text)]
    assert "joint1 7 N; joint2 7 N·m" in rule_text(result)
    missed = next(text for text in result.exclusions if text.startswith("Not noticed"))
    assert re.search(r"9 N on joint1 for", missed) and re.search(r"9 N·m on joint2 for", missed)
    short = [text for text in (*result.reasons, *result.unjudged) if text.startswith("Joint 'joint1'")]
    assert short and not [text for text in short if "N·m" in text]
