"""Gain and sign of the effort against the model's torque."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import PERIOD, make_log

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import ConditioningConfig
from collaudit.core.data.joint_log import MOVING_RAD_S
from collaudit.core.findings import Finding
from collaudit.core.prepare.effort_checks import sign_findings
from collaudit.core.prepare.effort_gain import EffortGain, effort_gains, scale_findings
from collaudit.core.torque_table.log_samples import TorqueTable


def effort_gain_findings(gains: tuple[EffortGain, ...], joints: tuple[str, ...], unit: str) -> list[Finding]:
    """What is said of scale and sign."""
    return [*scale_findings(gains, unit), *sign_findings(gains, joints)]


def run(gain: float, load: float, seed: int = 0):  # type: ignore[no-untyped-def]
    """A joint under gravity with friction, drift and noise; effort = gain x torque."""
    rng = np.random.default_rng(seed)
    t = PERIOD * np.arange(20000)
    q = 0.8 * np.sin(0.9 * t) + 0.3 * np.sin(2.3 * t)
    v = 0.72 * np.cos(0.9 * t) + 0.69 * np.cos(2.3 * t)
    gravity = load * np.cos(q + 0.5)
    drift = 0.3 * np.sin(0.1 * t)
    effort = gain * (gravity + 5 * np.sign(v) + 2 * v) + drift + rng.normal(0, 0.5, t.size)
    log = make_log(t, q[:, None], v[:, None], effort[:, None])
    series = condition(log, ConditioningConfig())
    gains = effort_gains(TorqueTable.of(series, gravity[:, None]))
    return gains, effort_gain_findings(gains, ("joint1",), "Nm")


@pytest.mark.parametrize("gain", [1.0, 0.92, 1.08])
def test_a_torque_passes(gain: float) -> None:
    gains, findings = run(gain, 20.0)
    assert gains[0].gain == pytest.approx(gain, rel=0.03)
    assert findings == []


@pytest.mark.parametrize("gain", [0.5, 0.8, 1.3])
def test_a_scale_beyond_the_accuracy_of_a_measured_torque_is_excluded(gain: float) -> None:
    """Efforts of 0.8 times the torque passed without a word."""
    _, (finding,) = run(gain, 20.0)
    assert (finding.code, finding.excludes, finding.doubts_alarms, finding.forbids_pass) == (
        "effort-gain",
        True,
        True,
        False,
    )
    assert f"{gain:g} times as large there" in finding.text


def test_an_interval_that_reaches_into_that_accuracy_says_nothing() -> None:
    wide = (EffortGain("a", 0.8, (0.68, 0.92), 0.9), EffortGain("b", 1.2, (1.05, 1.35), 0.9))
    assert effort_gain_findings(wide, ("a", "b"), "Nm") == []


def test_an_inverted_effort_is_noticed_with_its_remedy() -> None:
    gains, findings = run(-1.0, 20.0)
    assert gains[0].inverted
    assert [f.code for f in findings] == ["effort-sign-inverted"]
    assert findings[0].severity == "error"
    assert 'effort_sign = { "joint1" = -1 }' in findings[0].text


@pytest.mark.parametrize(
    ("gain", "judged"), [(0.2, True), (3.0, False), (10.0, False), (1000.0, False), (1e-3, False), (1e-6, False)]
)
def test_a_joint_far_out_of_scale_is_not_judged(gain: float, judged: bool) -> None:
    """A joint alone: what it has beyond the model's torque outweighs the arm, or it shows none of that torque."""
    (finding,) = (found for found in run(gain, 20.0)[1] if found.code == "effort-gain")
    assert (finding.joint, finding.effect != "not-judged-joint") == ("joint1", judged)


def test_a_small_wrist_with_a_load_that_is_not_described_is_judged() -> None:
    """The wrists of real arms show 5 to 30 times the torque of their thin descriptions."""
    gains = (EffortGain("lift", 1.1, (1.09, 1.11), 0.9, 40.0), EffortGain("wrist", 11.0, (10.0, 12.0), 0.9, 0.3))
    assert [f.severity for f in effort_gain_findings(gains, (), "Nm")] == ["warning"]


def test_memory_that_nobody_filled_has_no_gain() -> None:
    t = PERIOD * np.arange(20000)
    q, v = np.sin(t)[:, None], np.cos(t)[:, None]
    series = condition(make_log(t, q, v, 1e-308 * np.sin(3.0 * q)), ConditioningConfig())
    assert effort_gains(TorqueTable.of(series, 20.0 * np.cos(q))) == ()
    assert [f.severity for f in series.findings if f.code == "log-effort-missing"] == ["error"]


def found(**gains: float) -> tuple[EffortGain, ...]:
    """Gains as tight as a minute of motion gives them."""
    return tuple(EffortGain(joint, g, (g - 0.03 * abs(g), g + 0.03 * abs(g)), 0.9) for joint, g in gains.items())


@pytest.mark.parametrize("scale", [0.1, 0.4, 2.5, 10.0])
def test_several_joints_in_another_scale_forbid_a_pass(scale: float) -> None:
    """Amperes with the right signs, larger or smaller: said once for the arm, and nothing is judged."""
    findings = effort_gain_findings(found(a=scale, b=1.1 * scale, c=1.0), ("a", "b", "c"), "Nm")
    assert [f.code for f in findings] == ["effort-no-torque"]
    assert (findings[0].joint, findings[0].effect) == (None, "not-judged-log")
    assert "2 of the 3 joints" in findings[0].text
    assert f"a {scale:.3g} [" in findings[0].text


@pytest.mark.parametrize(
    ("loaded", "no_torque"), [({"a": 1.0}, False), ({"a": 3.0}, True), ({"a": 1.0, "b": 3.0}, True), ({}, True)]
)
def test_a_load_that_outweighs_a_small_arm_is_no_other_scale(loaded: dict[str, float], no_torque: bool) -> None:
    """Gains of 3 to 20 with 5 kg that nobody stated: where a load is left open, those that tell are in scale."""
    findings = scale_findings(found(a=1.4, b=3.0, c=20.0), "Nm", lambda: found(**loaded))
    assert ("effort-no-torque" in [f.code for f in findings]) == no_torque


@pytest.mark.parametrize(
    "gains",
    [
        found(a=0.1, b=1.0, c=1.0),  # one joint's own fault
        found(a=0.1, b=0.1, c=1.0, d=1.0),  # not most of them: inertials, not the unit
        found(a=0.1, b=-0.1, c=1.0),  # an inverted sign has a finding of its own
        (EffortGain("a", 6.0, (2.1, 9.9), 0.9), EffortGain("b", 6.0, (2.1, 9.9), 0.9)),  # too wide
        (EffortGain("a", 6.0, (5.9, 6.1), 0.1), EffortGain("b", 6.0, (5.9, 6.1), 0.1)),  # explains nothing
    ],
)
def test_what_is_no_scale_of_the_log(gains: tuple[EffortGain, ...]) -> None:
    findings = effort_gain_findings(gains, (), "Nm")
    assert "effort-no-torque" not in [f.code for f in findings]
    assert "effort-no-torque" not in [f.code for f in effort_gain_findings(found(a=0.1, b=0.1), (), "raw")]


def test_an_unloaded_joint_is_undecided_not_guessed() -> None:
    for seed in range(10):
        gains, findings = run(1.0, 0.01, seed)
        assert not gains[0].inverted
        assert [f.code for f in findings] == ["fact"]


@pytest.mark.parametrize(("model_nm", "follows", "told"), [(0.05, 1.0, False), (0.05, 0.0, False), (3.0, 0.0, True)])
def test_a_torque_small_beside_friction_shows_no_other_unit(model_nm: float, follows: float, told: bool) -> None:
    """The noise of a wrench sensor was most of the last joint's model torque, and the joint was not judged."""
    rng = np.random.default_rng(3)
    t = PERIOD * np.arange(20000)
    q, v = np.sin(0.4 * t), 0.4 * np.cos(0.4 * t)
    model = model_nm * np.sin(q + 0.3 * np.sin(0.7 * t))
    effort = follows * model + np.sign(v) * (1.0 + 0.5 * np.abs(v)) + rng.normal(0, 0.1, t.size)
    series = condition(make_log(t, q[:, None], v[:, None], effort[:, None]), ConditioningConfig())
    seen = model + rng.normal(0, 10 * model_nm, t.size)
    found = scale_findings(effort_gains(TorqueTable.of(series, seen[:, None])), "Nm")
    assert ["effort-gain" in f.code for f in found] == ([True] if told else [])


def test_the_interval_covers_the_gain() -> None:
    hits = sum(g.ci95[0] <= 1.0 <= g.ci95[1] for seed in range(20) for g in run(1.0, 10.0, seed)[0])
    assert hits >= 15


@pytest.mark.parametrize("swing_rad", [0.004, 0.4])
def test_a_resting_arm_that_gives_under_touches_says_nothing_of_units(swing_rad: float) -> None:
    """What it accelerates by is the hand; only of a joint that travels does the effort follow the model."""
    t = PERIOD * np.arange(12000)
    q = swing_rad * np.sin(6.0 * t)
    v, model = 6.0 * swing_rad * np.cos(6.0 * t), -36.0 * swing_rad * np.sin(6.0 * t)
    effort = 3.0 * model + np.random.default_rng(4).normal(0, 0.05 * swing_rad, t.size)
    series = condition(make_log(t, q[:, None], v[:, None], effort[:, None]), ConditioningConfig())
    codes = [
        f.code for f in effort_gain_findings(effort_gains(TorqueTable.of(series, model[:, None])), ("joint1",), "Nm")
    ]
    assert codes == (["effort-gain"] if swing_rad > 0.1 else ["fact"])


def touching(push: float, sign: float = 1.0) -> tuple[EffortGain, float]:
    """A lightly loaded joint that runs onto something wherever it comes far enough; the gain, and by least squares."""
    rng = np.random.default_rng(2)
    t = PERIOD * np.arange(20000)
    q = 0.8 * np.sin(0.9 * t) + 0.3 * np.sin(2.3 * t)
    v = 0.72 * np.cos(0.9 * t) + 0.69 * np.cos(2.3 * t)
    gravity = 3.0 * np.cos(q + 0.5)
    effort = sign * (gravity + np.sign(v)) + push * (q > 0.75) + rng.normal(0, 0.2, t.size)
    series = condition(make_log(t, q[:, None], v[:, None], effort[:, None]), ConditioningConfig())
    (found,) = effort_gains(TorqueTable.of(series, gravity[:, None]))
    columns = np.column_stack([gravity, np.sign(v), v, np.ones_like(v)])[np.abs(v) > MOVING_RAD_S]
    return found, float(np.linalg.lstsq(columns, effort[np.abs(v) > MOVING_RAD_S], rcond=None)[0][0])


@pytest.mark.parametrize("push", [8.0, 15.0])
def test_a_contact_cannot_raise_the_sign_error(push: float) -> None:
    found, by_all = touching(push)
    assert by_all < 0, "the contact is what this is about"
    assert not found.inverted
    assert found.gain > 0


@pytest.mark.parametrize("push", [0.0, -2.0])
def test_an_inverted_sign_stays_inverted_beside_a_contact(push: float) -> None:
    assert touching(push, -1.0)[0].inverted


def test_a_stated_sign_holds_and_the_evidence_is_a_warning() -> None:
    gains, _ = run(-1.0, 20.0)
    (said,) = sign_findings(gains, ("joint1",), {"joint1"})
    assert (said.code, said.severity, said.effect) == ("effort-sign-inverted", "warning", "none")
    assert "-1 per N·m" in said.text or "-0.9" in said.text
    assert "as [log.units] effort_sign states it" in said.text


@pytest.mark.parametrize(("own", "told"), [(0.05, False), (0.5, True)])
def test_errors_of_a_description_are_no_gain_where_a_free_tool_explains_the_rest(own: float, told: bool) -> None:
    """What a free column leaves of the described torque is no more than the description may be wrong by."""
    t = PERIOD * np.arange(20000)
    q = 0.8 * np.sin(0.9 * t) + 0.3 * np.sin(2.3 * t)
    v = 0.72 * np.cos(0.9 * t) + 0.69 * np.cos(2.3 * t)
    tool, rest = np.sin(q), np.cos(2.0 * q) * own
    effort = 2.0 * tool + 3.0 * rest + np.random.default_rng(5).normal(0, 0.01, t.size)
    series = condition(make_log(t, q[:, None], v[:, None], effort[:, None]), ConditioningConfig())
    table = TorqueTable.of(series, (tool + rest)[:, None])
    lacking = TorqueTable.of(series, tool[:, None]).model
    assert bool(effort_gains(table, lacking[:, :, None])) == told
    assert effort_gains(table), "without the column there is one"
