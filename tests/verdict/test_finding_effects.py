"""No log passes with a finding that forbids judging, and the reasons say so; checked over the whole table."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from synthetic import PERIOD, lugre, make_log, strokes

from collaudit.core.audit import audit_log
from collaudit.core.config.schema import Config, LogConfig, PolicyConfig
from collaudit.core.data.audit_result import Audit, Coverage, FrictionFile, Provenance
from collaudit.core.data.detection_result import Contact
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.sensitivity_result import Sensitivity
from collaudit.core.data.signals import State
from collaudit.core.findings import Finding, joints_not_judged, without_errors_of
from collaudit.core.findings.finding_kinds import KINDS, RENAMED, Severity
from collaudit.core.fitting import fit_logs
from collaudit.core.prepare.preparation import prepare
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.verdict.coverage import exclusions
from collaudit.core.verdict.verdict import Evidence, decide

NAMES = ("joint1", "joint2")
NOBODY = Provenance("test", {})
ROBOT = {
    "dh_convention": "standard",
    "dh": [
        {
            "a": 0.4,
            "alpha": np.pi / 2,
            "mass_kg": 4.0,
            "com_m": [-0.2, 0, 0],
            "inertia_kg_m2": [0.01, 0.06, 0.06, 0, 0, 0],
        },
        {"a": 0.3, "mass_kg": 2.0, "com_m": [-0.15, 0, 0], "inertia_kg_m2": [0.01, 0.02, 0.02, 0, 0, 0]},
    ],
    "base_rpy_deg": [90, 0, 0],
}
FORBIDDING = [
    (code, severity)
    for code, kind in KINDS.items()
    for severity, effect in kind.effects.items()
    if effect.startswith("not-judged")
]
HARMLESS = [
    (code, severity)
    for code, kind in KINDS.items()
    for severity, effect in kind.effects.items()
    if not effect.startswith("not-judged")
]
EXCLUDING = [
    (code, severity)
    for code, kind in KINDS.items()
    for severity, effect in kind.effects.items()
    if effect.startswith("excludes")
]


def config(**sections: object) -> Config:
    return Config.of({"robot": ROBOT, **sections})


def log_of(q: np.ndarray, seed: int) -> JointLog:
    """A log (n, 2) of an arm of two joints with friction and a little noise."""
    v = np.gradient(q, PERIOD, axis=0)
    a = np.gradient(v, PERIOD, axis=0)
    robot = build_robot(config().robot, Path(), NAMES)
    noise = np.random.default_rng(seed).normal(0, 0.05, q.shape)
    effort = robot.inverse_dynamics(q, v, a) + lugre(v, 2.0, 0.8, 10.0, 1.5) + noise
    return make_log(PERIOD * np.arange(len(q)), q, v, effort, NAMES)


@pytest.fixture(scope="module")
def friction() -> FrictionFile:
    stroke, _ = strokes((0.06, 0.1, 0.2, 0.4, 0.8))
    rest = np.full_like(stroke, -0.5)
    q = np.concatenate([np.column_stack([stroke, rest]), np.column_stack([rest, stroke])])
    return fit_logs([prepared(log_of(q, 1))], config(), NOBODY)


@pytest.fixture(scope="module")
def clean() -> JointLog:
    t = PERIOD * np.arange(6000)
    return log_of(0.5 * np.column_stack([np.sin(1.2 * t), np.cos(1.1 * t)]), 2)


def prepared(log: JointLog, cfg: Config | None = None) -> Prepared:
    cfg = cfg or config()
    return prepare(log, build_robot(cfg.robot, Path(), NAMES), cfg)


def audit(log: JointLog, friction: FrictionFile, *injected: Finding, **sections: object) -> Audit:
    cfg = config(**sections)
    before = prepared(log, cfg)
    return audit_log(replace(before, findings=(*before.findings, *injected)), cfg, friction, NOBODY, siblings=None)


def states(found: Audit) -> list[set[int]]:
    return [set(column) for column in found.signals.state.T.tolist()]


def without_effort(log: JointLog, column: int, value: float) -> JointLog:
    assert log.effort is not None
    effort = log.effort.copy()
    effort[:, column] = value
    return replace(log, effort=effort)


@pytest.mark.parametrize("joint", ["joint1", None])
@pytest.mark.parametrize(("code", "severity"), FORBIDDING)
def test_no_log_with_a_forbidding_finding_passes(
    clean: JointLog, friction: FrictionFile, code: str, severity: str, joint: str | None
) -> None:
    finding = Finding(code, severity, f"What is wrong: {code}.", joint=joint)  # type: ignore[arg-type]
    found = audit(clean, friction, finding)
    assert found.result.verdict == "not_judged"
    assert finding.text in found.result.reasons
    first, second = states(found)
    everything = finding.effect == "not-judged-log" or (finding.effect == "not-judged-joint" and joint is None)
    assert (first == {State.UNUSABLE}) == (finding.effect != "not-judged-part")
    assert (second == {State.UNUSABLE}) == everything
    assert (State.JUDGED in second) == (not everything)
    assert ("unusable" in found.result.coverage.joints["joint2"].not_judged_s) == everything


def test_a_log_passes_with_every_other_finding_at_once(clean: JointLog, friction: FrictionFile) -> None:
    harmless = [Finding(code, severity, code, joint="joint1") for code, severity in HARMLESS]  # type: ignore[arg-type]
    alone, together = audit(clean, friction).result, audit(clean, friction, *harmless).result
    assert alone.verdict == "pass", alone.reasons
    assert (together.verdict, together.reasons) == (alone.verdict, alone.reasons)
    assert len(together.findings) == len(alone.findings) + len(harmless)


def test_an_error_always_forbids_judging() -> None:
    allowed = {kind.effects.get("error", "not-judged-part") for kind in KINDS.values()}
    assert allowed == {"not-judged-part", "not-judged-joint", "not-judged-log"}
    assert not any(kind.effects.get("info", "none") != "none" for kind in KINDS.values())


def test_a_finding_has_a_code_and_a_severity_of_the_table() -> None:
    with pytest.raises(ValueError, match="unknown finding code"):
        Finding("log-unheard-of", "info", "")
    with pytest.raises(ValueError, match="no severity 'error'"):
        Finding("time-gap", "error", "")


def test_every_kind_says_what_to_do() -> None:
    for code, kind in KINDS.items():
        assert kind.meaning.endswith("."), code
        assert kind.remedy.endswith("."), code
        assert kind.effects, code


@pytest.mark.parametrize("value", [0.0, 3.0])
def test_a_moving_joint_whose_effort_never_changes_is_not_judged(
    clean: JointLog, friction: FrictionFile, value: float
) -> None:
    found = audit(without_effort(clean, 1, value), friction)
    assert found.result.verdict == "not_judged"
    assert any("joint2" in reason and "all the time" in reason for reason in found.result.reasons)
    assert states(found)[1] == {State.UNUSABLE}
    assert State.JUDGED in states(found)[0], "the other joint is judged"
    assert found.result.coverage.joints["joint2"].judged_s == 0.0


def test_a_joint_without_effort_and_one_of_inverted_effort_are_not_judged(
    clean: JointLog, friction: FrictionFile
) -> None:
    assert clean.effort is not None
    missing = audit(without_effort(clean, 0, np.nan), friction).result
    assert missing.verdict == "not_judged"
    assert "Joint 'joint1' has no effort values." in missing.reasons
    inverted = audit(replace(clean, effort=clean.effort * [-1.0, 1.0]), friction).result
    assert inverted.verdict == "not_judged"
    assert any("runs against the model" in reason for reason in inverted.reasons)


def test_a_late_effort_that_looks_inverted_is_not_judged_on_any_joint(friction: FrictionFile) -> None:
    t = PERIOD * np.arange(12000)
    log = log_of(0.5 * np.column_stack([np.sin(4.5 * t), np.cos(4.1 * t)]), 3)
    assert log.effort is not None
    late = replace(log, effort=np.roll(log.effort, 150, axis=0))
    before = prepared(late)
    assert before.sign_delay is not None
    assert before.sign_delay.seconds == pytest.approx(0.3, abs=0.02)
    found = audit(late, friction)
    assert found.result.verdict == "not_judged"
    assert any("effort_delay_ms = 3" in reason for reason in found.result.reasons)
    assert states(found) == [{State.UNUSABLE}, {State.UNUSABLE}]


def test_a_gap_stays_a_gap_on_a_joint_that_is_not_judged(clean: JointLog, friction: FrictionFile) -> None:
    kept = (clean.time_s < 4.0) | (clean.time_s > 5.0)
    assert clean.velocity_rad_s is not None and clean.effort is not None
    log = make_log(clean.time_s[kept], clean.position_rad[kept], clean.velocity_rad_s[kept], clean.effort[kept], NAMES)
    assert states(audit(without_effort(log, 1, 0.0), friction))[1] == {State.UNUSABLE, State.GAP}


@pytest.mark.parametrize("sections", [{"detect": {"watch": ["joint1"]}}, {"robot": {**ROBOT, "joints": ["joint1"]}}])
def test_an_error_of_a_joint_that_nobody_asked_for_is_a_warning(
    clean: JointLog, friction: FrictionFile, sections: dict[str, object]
) -> None:
    found = audit(without_effort(clean, 1, 0.0), friction, **sections).result
    assert found.verdict == "pass", found.reasons
    (said,) = [f for f in found.findings if f.joint == "joint2" and "all the time" in f.text]
    assert said.severity == "warning"
    assert audit(without_effort(clean, 0, 0.0), friction, **sections).result.verdict == "not_judged"


def test_only_errors_of_single_joints_are_lowered() -> None:
    pose = Finding("log-unit-suspect", "error", "", joint="joint2")
    absent = Finding("effort-switched", "error", "", joint="joint2")
    part = Finding("event-cut", "warning", "", joint="joint2")
    dead = Finding("log-effort-missing", "error", "", joint="joint2")
    lowered = without_errors_of((pose, absent, part, dead), {"joint2"})
    assert lowered == (pose, absent, part, replace(dead, severity="warning"))
    assert without_errors_of((dead,), {"joint1"}) == (dead,)


def test_a_finding_on_a_joint_outside_the_judged_ones_leaves_them_alone() -> None:
    absent = Finding("log-joints-missing", "error", "", joint="joint9")
    assert joints_not_judged((absent,), NAMES) == frozenset()


@pytest.mark.parametrize(("severity", "doubted"), [("warning", True), ("info", False)])
def test_only_a_finding_that_doubts_alarms_does(severity: str, doubted: bool) -> None:
    hit = Contact(1.0, 1.1, 1.2, ("joint1",), "link1", "", None, "undecided", ())
    level = Finding("friction-level", severity, "", joint="joint1")  # type: ignore[arg-type]
    verdict, reasons = decide(
        PolicyConfig(), Evidence((hit,), (), Coverage(10.0, 0.0, {}), Sensitivity({}), (), (level,))
    )
    assert verdict == "fail"
    assert any("may be errors of the model" in reason for reason in reasons) == doubted


def test_a_collision_in_what_could_be_read_counts(clean: JointLog, friction: FrictionFile) -> None:
    assert clean.effort is not None
    push = np.zeros_like(clean.effort)
    push[2000:2200, 0] = 12.0
    damaged = Finding("log-partial", "error", "The log is damaged.")
    found = audit(replace(clean, effort=clean.effort + push), friction, damaged).result
    assert found.verdict == "fail"
    assert damaged.text in found.reasons


def test_the_same_words_about_several_joints_are_one_reason() -> None:
    said = [Finding("effort-sign-inverted", "error", f"Joint '{j}' is inverted.", joint=j) for j in NAMES]
    other = Finding("log-partial", "error", "The log is damaged.")
    _, reasons = decide(PolicyConfig(), Evidence((), (), Coverage(10.0, 0.0, {}), Sensitivity({}), (), (*said, other)))
    assert reasons[:2] == ("Joint 'joint1' is inverted. The same holds for joint2.", "The log is damaged.")


def test_a_joint_that_a_finding_forbids_is_not_said_to_lack_coverage(clean: JointLog, friction: FrictionFile) -> None:
    found = audit(without_effort(clean, 1, 0.0), friction).result
    assert not [f for f in found.findings if f.code == "coverage-low"]
    assert len(found.reasons) == 1


def test_a_pass_does_not_hide_what_cannot_be_seen() -> None:
    """A tool's collision without phases, a constant force in friction of the same log."""
    assert {code for code, _ in EXCLUDING} >= {"phases-unknown", "friction-same-log"}
    said = [Finding(code, severity, f"Not seen: {code}.") for code, severity in EXCLUDING]
    quiet = Finding("phases-unknown", "info", "One free phase.")
    empty = Coverage(10.0, 0.0, {})
    assert exclusions(empty, Sensitivity({}), [*said, quiet, *said]) == tuple(finding.text for finding in said)
    assert exclusions(empty, Sensitivity({}), [quiet]) == ()


def test_a_pass_says_that_nothing_states_whether_efforts_are_measured(clean: JointLog, friction: FrictionFile) -> None:
    """Efforts that a controller computes, with some noise, cannot be told from those of a well described arm."""
    for log, times in ((LogConfig(), 1), (LogConfig.of({"effort_kind": "motor-torque"}), 0)):
        own = config().changed({"log": log})
        found = audit_log(prepared(clean, own), own, friction, NOBODY, siblings=None).result.exclusions
        assert sum("[log] effort_kind" in text for text in found) == times


def test_alarms_of_glitches_are_in_doubt(clean: JointLog, friction: FrictionFile) -> None:
    assert clean.effort is not None
    effort = clean.effort.copy()
    effort[1_000::2_000, 0] += 400.0
    found = audit(replace(clean, effort=effort), friction).result
    assert found.collisions
    assert any("Alarms of joint1 may be errors" in reason for reason in found.reasons)
    assert {f.joint for f in found.findings if f.code == "effort-spikes"} == {"joint1"}


def test_a_file_of_an_earlier_version_is_read_by_the_code_that_stands_for_its_own() -> None:
    for old, new in RENAMED.items():
        for severity in get_args(Severity):
            found = Finding(old, severity, "x")
            assert found.code == new and found.effect in KINDS[new].effects.values()
