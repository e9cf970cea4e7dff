"""The audit of channels: what the effort is, delays, the wrist sensor; each against what was done to the log."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from arms import dh_robot, dh_row
from fixed_level import with_fixed_level
from given_values import given_values
from origins import NOBODY, log_source

from collaudit.core.audit import audit_log
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.data.joint_log import JointLog, WrenchSeries
from collaudit.core.fitting import fit_logs
from collaudit.core.identification.channel_audit import (
    audit_channels,
    audit_delays,
    effort_delay,
    late_effort_findings,
    step_findings,
)
from collaudit.core.identification.force_sensor import calibrate_sensor
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.channel_delay import Delay, effort_shift
from collaudit.core.prepare.preparation import calibrated, prepare
from collaudit.core.robot.robot_building import build_robot

NAMES = ("joint1", "joint2", "joint3")
PERIOD = 0.004


def settings(**log: object) -> Config:
    inertia = (0.02, 0.05, 0.05)
    rows = [
        dh_row(6.0, (0, 0.02, 0), inertia, d=0.3, alpha=-np.pi / 2),
        dh_row(5.0, (-0.15, 0, 0.02), inertia, a=0.35),
        dh_row(3.0, (-0.12, 0.01, 0), inertia, a=0.3, alpha=np.pi / 2),
    ]
    # a tilted base: turning any joint then turns the sensor against gravity
    base = (60, 0, 0) if "wrench" in log else (0, 0, 0)
    return Config.of({"robot": dh_robot(rows, base_rpy_deg=base), "log": log})


def moving_log(late_s: float = 0.0, wrench: bool = False, pace: float = 1.0) -> JointLog:
    """Smooth motion; effort and wrench stamped ``late_s`` after the motion they belong to."""
    t = np.arange(0, 60, PERIOD)

    def motion(at: np.ndarray) -> tuple[np.ndarray, ...]:
        w, size, p = pace * np.array([0.7, 0.9, 1.3]), np.array([0.9, 0.7, 0.9]), np.array([0.3, 1.0, 2.0])
        angle = w * at[:, None] + p
        q, v, a = size * np.sin(angle), size * w * np.cos(angle), -size * w**2 * np.sin(angle)
        return q, v, a

    robot = build_robot((settings(wrench="/w") if wrench else settings()).robot, Path(), NAMES)
    rng = np.random.default_rng(0)
    q, v, _ = motion(t)
    then = motion(t - late_s)
    effort = robot.inverse_dynamics(*then) + 3.0 * np.sign(then[1]) + 2.0 * then[1]
    effort = effort + 0.2 * rng.standard_normal(effort.shape)
    sensor = None
    if wrench:
        force = -1.2 * robot.gravity_in(then[0], "tool0")
        sensor = WrenchSeries(
            t, np.hstack([force, np.zeros_like(force)]) + 0.02 * rng.standard_normal((t.size, 6)), "/w"
        )
    source = log_source()
    return JointLog(t, NAMES, q, v, effort, "Nm", sensor, source)


def prepared(log: JointLog, config: Config):  # type: ignore[no-untyped-def]
    return prepare(log, build_robot(config.robot, Path(), NAMES), config)


def test_coarse_steps_are_noticed_and_fine_ones_are_not() -> None:
    log = moving_log()
    assert log.effort is not None
    coarse = step_findings(prepared(replace(log, effort=np.round(log.effort / 4) * 4), settings()))
    assert {f.joint for f in coarse if f.code == "effort-filtered"} >= {"joint2", "joint3"}
    assert any("steps of 4" in f.text for f in coarse)
    fine = step_findings(prepared(replace(log, effort=np.round(log.effort, 3)), settings()))
    assert not any(f.code == "effort-filtered" for f in fine)


@pytest.mark.parametrize("late", [0.0, 0.016, 0.3])
def test_a_late_effort_is_measured_and_corrected(late: float) -> None:
    log = moving_log(late)
    found = effort_delay(prepared(log, settings()))
    assert found is not None
    assert found.seconds == pytest.approx(late, abs=0.0015)
    assert found.ci95[0] - 0.0005 <= late <= found.ci95[1] + 0.0005
    said = audit_delays(prepared(log, settings()), settings(), found, None)
    assert [f.severity for f in said] == (["warning"] if late else [])
    if late:
        assert "effort_delay_ms" in said[0].text
        mended = settings(effort_delay_ms=1e3 * late)
        after = effort_delay(prepared(log, mended))
        assert after is not None
        assert after.seconds == pytest.approx(0.0, abs=0.0015)


@pytest.mark.parametrize("late", [0.0, 0.02])
def test_friction_that_turns_about_over_its_first_milliradians_is_no_delay(late: float) -> None:
    """A gear gives way for some milliradians after a reversal before its friction is that of sliding."""
    log = moving_log(late)
    assert log.effort is not None
    then = moving_log(0.0)
    bristle = np.zeros_like(then.position_rad)
    for k, step in enumerate(np.diff(then.position_rad, axis=0), 1):
        bristle[k] = np.clip(bristle[k - 1] + step / 0.004, -1.0, 1.0)
    lagging = np.array([4.0, 4.0, 10.0]) * (bristle - np.sign(then.velocity_rad_s))
    effort = log.effort + np.roll(lagging, round(late / PERIOD), axis=0)
    found = effort_delay(prepared(replace(log, effort=effort), settings()))
    assert isinstance(found, Delay)
    assert found.seconds == pytest.approx(late, abs=0.003)
    assert found.ci95[0] <= late <= found.ci95[1]


@pytest.mark.parametrize(("late", "said"), [(0.0, 0), (0.05, 1)])
def test_of_a_log_that_alarms_a_late_effort_is_said(late: float, said: int) -> None:
    found = late_effort_findings(prepared(moving_log(late), settings()), settings())
    assert [(f.code, f.effect) for f in found] == said * [("effort-delay", "none")]
    told = [float(re.findall(r"effort_delay_ms = (\d+\.\d+)", f.text)[0]) for f in found]
    assert told == pytest.approx(said * [1e3 * late], abs=1.0), "within half of its interval"
    mended = settings(effort_delay_ms=1e3 * late)
    assert late_effort_findings(prepared(moving_log(late), mended), mended) == []


@pytest.mark.parametrize(
    ("span_s", "severities"), [((0.256, 0.314), ["warning"]), ((0.012, 0.085), ["warning"]), ((0.0005, 0.16), [])]
)
def test_a_delay_that_is_not_sharp_is_told_where_it_is_clearly_one(
    span_s: tuple[float, float], severities: list[str]
) -> None:
    found = replace(effort_delay(prepared(moving_log(0.3), settings())), seconds=sum(span_s) / 2, ci95=span_s)
    said = audit_delays(prepared(moving_log(0.3), settings()), settings(), found, None)
    assert [f.severity for f in said] == severities
    assert all("effort_delay_ms" not in f.text for f in said), "no number to enter"


def test_a_late_effort_is_not_taken_for_an_inverted_one() -> None:
    late = prepared(moving_log(0.5, pace=4.0), settings())
    assert any(g.inverted for g in late.gains)
    assert not any(f.code == "effort-sign-inverted" for f in late.findings)
    said = next(f for f in late.findings if f.code == "effort-delay")
    assert "effort_delay_ms = 500" in said.text
    assert said.severity == "error" and said.forbids_pass
    stated = prepared(moving_log(0.5, pace=4.0), settings(effort_delay_ms=0.0))
    again = next(f for f in stated.findings if f.code == "effort-delay")
    assert again.severity == "warning" and not again.forbids_pass, "what is stated wins, and the evidence is said"
    turned = moving_log(pace=4.0)
    assert turned.effort is not None
    found = prepared(replace(turned, effort=-turned.effort), settings()).findings
    assert any(f.code == "effort-sign-inverted" for f in found)
    assert not any(f.code == "effort-delay" for f in found)


@pytest.mark.parametrize("late_ms", [15.0, 20.0, 30.0])
def test_a_late_wrench_is_measured(late_ms: float) -> None:
    """One of the three hung on how a processor rounds products of columns that are nearly alike."""
    config = settings(wrench="/w", wrench_frame="tool0")
    facts, said = audit_channels(prepared(moving_log(1e-3 * late_ms, wrench=True), config), config)
    wrench = next(f for f in said if f.code == "log-wrench")
    assert facts.wrench_delay_ms == pytest.approx(late_ms, abs=1.0)
    assert wrench.severity == "warning"


def static_log(poses: np.ndarray, seed: int, drift: float = 0.0, turn: np.ndarray | None = None) -> JointLog:
    """Rest at each pose: mass 1.4 kg at (0.01, -0.02, 0.06), offsets, noise."""
    robot = build_robot(settings(wrench="/w").robot, Path(), NAMES)
    rng = np.random.default_rng(seed)
    each = 300
    q = np.vstack([np.vstack([np.linspace(a, b, 200), np.repeat(b[None], each, 0)]) for a, b in pairwise(poses)])
    t = PERIOD * np.arange(len(q))
    v = np.gradient(q, PERIOD, axis=0)
    gravity = robot.gravity_in(q, "tool0")
    if turn is not None:
        gravity = gravity @ turn.T
    force = -1.4 * gravity
    moment = np.cross([0.01, -0.02, 0.06], force)
    offset = np.array([1.7, -2.4, 4.1, 0.06, -0.11, 0.03])
    reading = np.hstack([force, moment]) + offset + np.array([0.3] * 3 + [0.01] * 3) * rng.standard_normal((len(q), 6))
    reading[:, 2] += drift * t / t[-1]
    source = log_source()
    return JointLog(t, NAMES, q, v, np.zeros_like(q), "Nm", WrenchSeries(t, reading, "/w"), source)


def many_poses(seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1.4, 1.4, (13, 3))


def test_sensor_offset_and_tool_lie_in_their_intervals() -> None:
    config = settings(wrench="/w", wrench_frame="tool0")
    true = [1.4, 0.01, -0.02, 0.06, 1.7, -2.4, 4.1, 0.06, -0.11, 0.03]
    hits = 0
    for seed in range(12):
        found = calibrate_sensor(prepared(static_log(many_poses(), seed), config), config)
        assert found is not None
        assert found.poses == 12
        assert not found.missing
        assert found.com_ci95 is not None
        ci95 = (found.mass_ci95, *found.com_ci95, *found.offset_ci95)
        hits += sum(low < x < high for x, (low, high) in zip(true, ci95, strict=True))
        assert found.turn_deg is not None
        assert np.all(np.abs(found.turn_deg) < 2.5 * (found.turn_half_deg or 0) + 0.1)
    assert 0.88 <= hits / 120 <= 0.995


def test_a_turned_sensor_and_a_drift_are_noticed() -> None:
    from scipy.spatial.transform import Rotation

    config = settings(wrench="/w", wrench_frame="tool0")
    turn = Rotation.from_rotvec(np.radians([0, 0, 10.0])).as_matrix()
    found = calibrate_sensor(prepared(static_log(many_poses(), 0, drift=3.0, turn=turn), config), config)
    assert found is not None
    assert found.turn_deg is not None
    assert found.turn_deg == pytest.approx([0, 0, 10.0], abs=2.0)
    assert found.drift[2] == pytest.approx(3.0, abs=1.2)


def test_poses_that_are_missing_are_named() -> None:
    config = settings(wrench="/w", wrench_frame="tool0")
    flat = many_poses()
    flat[:, 2] = 0.4
    flat[:, 0] = 0.0  # only joint 2 turns: gravity stays in one plane of the sensor
    found = calibrate_sensor(prepared(static_log(flat, 0), config), config)
    assert found is not None
    assert any("another axis" in text for text in found.missing)
    few = calibrate_sensor(prepared(static_log(flat[:3], 0), config), config)
    assert few is None


def test_a_calibrated_sensor_is_used_where_that_is_asked_for() -> None:
    config = settings(wrench="/w", wrench_frame="tool0", wrench_bias="calibrated")
    log = prepared(static_log(many_poses(), 0), config)
    facts, said = audit_channels(log, config)
    assert facts.sensor is not None
    assert any('wrench_bias = "calibrated"' in f.text for f in said)
    assert log.contact_nm is not None
    seen = calibrated(log, Calibration.of_sensor({"calibration": facts}, config), config)
    assert seen.contact_nm is not None
    # at rest, the last 300 of 500 samples a pose: this log's sensor does not feel the tool being accelerated
    rest = np.isin(np.arange(len(log.contact_nm)) % 500, np.arange(270, 470))
    assert np.std(seen.contact_nm[rest]) < 0.1 * np.std(log.contact_nm[rest])  # the tool's weight was left in before
    assert any(f.code == "log-wrench" and "1.4 kg" in f.text for f in seen.findings)
    none = calibrated(log, Calibration.of_sensor({}, config), config)
    assert none.contact_nm is log.contact_nm
    assert any("holds no calibration" in f.text for f in none.findings)
    usual = settings(wrench="/w", wrench_frame="tool0")
    assert calibrated(log, Calibration.of_sensor({"calibration": facts}, usual), usual) is log


def heated_log(first_c: float, rise_c: float) -> JointLog:
    """Friction falls by 2 % a kelvin from what it is at 30 °C."""
    log = moving_log()
    assert log.effort is not None
    assert log.velocity_rad_s is not None
    warm = first_c + rise_c * (1.0 - np.exp(-log.time_s / 20.0))
    friction = 3.0 * np.sign(log.velocity_rad_s) + 2.0 * log.velocity_rad_s
    effort = log.effort - 0.02 * (warm - 30.0)[:, None] * friction
    return replace(log, effort=effort, temperature_c=np.repeat(warm[:, None], 3, axis=1))


@pytest.fixture(scope="module")
def warmed() -> tuple[Config, FrictionFile]:
    keys = {**given_values(settings()), "fit": {"motion": "any"}, "detect": {"gamma_nm": 4.0, "watch": list(NAMES)}}
    config = Config.of(keys)
    return config, fit_logs([prepared(heated_log(25.0, 10.0), config)], config, NOBODY)


def test_friction_is_compared_with_a_temperature_channel(warmed: tuple[Config, FrictionFile]) -> None:
    found = warmed[1]
    trend = next(t for t in found.trends["joint2"].trends if t.against == "temperature")
    assert trend.shown
    assert trend.per_unit == pytest.approx(-0.02, rel=0.3)
    assert trend.fit is not None
    assert (trend.fit.lowest, trend.fit.highest) == pytest.approx((25.0, 34.5), abs=0.2)


def test_a_log_is_judged_at_its_own_temperature(
    warmed: tuple[Config, FrictionFile], monkeypatch: pytest.MonkeyPatch
) -> None:
    with_fixed_level(monkeypatch)  # a level that is followed takes up what the temperature explains
    config, friction = warmed
    cold = heated_log(25.0, 1.0)

    def judged(log: JointLog) -> AuditResult:
        return audit_log(prepared(log, config), config, friction, NOBODY, siblings=None).result

    def said(result: AuditResult) -> set[str]:
        codes = {f.code for f in result.findings if "temperature" in f.text or "°C" in f.text}
        return codes - {"residual-level"}  # which names every cause of a residual that is not the fit's

    blind, seeing = judged(replace(cold, temperature_c=None)), judged(cold)
    assert said(blind) == said(seeing) == {"fact"}
    for joint in NAMES:
        before, after = (r.residual[joint].rms_nm for r in (blind, seeing))
        assert before is not None
        assert after is not None
        assert after < 0.7 * before
    assert said(judged(heated_log(10.0, 1.0))) == {"fact", "evidence-range"}


def test_a_dead_effort_has_no_delay() -> None:
    """All zeros follow any motion equally well at any shift."""
    log = prepared(moving_log(), settings())
    assert log.series.effort is not None
    dead = replace(log.series, effort=np.zeros_like(log.series.effort))
    assert effort_shift(dead, log.robot, dead.joint_names, None) is None
