"""Detection on simulated logs against their truth: pushes, drifting friction, faults, phases, contacts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fixed_level import with_fixed_level
from origins import NOBODY
from strong_pushes import strong_pushes

from collaudit.core.api import load_robot, open_log, prepare
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.config.schema import PhasesConfig
from collaudit.core.data.audit_result import Audit, AuditResult, FrictionFile
from collaudit.core.prepare.phases import PHASES, find_phases, phase_findings
from collaudit.core.prepare.preparation import prepare as prepare_log
from collaudit.core.residual import residual
from collaudit.core.scoring.detection_score import JudgedResidual, score

T = 0.002


def audited(log: Path, friction: FrictionFile, **overrides: object) -> Audit:
    settings = {key.replace("__", "."): value for key, value in overrides.items()}
    loaded = load_config(log.with_suffix(".toml"), settings)
    return audit_log(prepare((log,), loaded), loaded.config, friction, NOBODY, siblings=None)


def off(friction: FrictionFile, factor: float) -> FrictionFile:
    joints = {}
    for name, fit in friction.joints.items():
        scaled = {k: v if k.startswith("C") else factor * v for k, v in fit.parameters.items()}
        joints[name] = replace(fit, parameters=scaled)
    return replace(friction, joints=joints)


def missed_and_false(audit: Audit, log: Path) -> tuple[int, int]:
    """Pushes above 1.3 gamma for longer than n that were seen and missed; alarms that nobody caused."""
    names = audit.signals.joint_names
    events = strong_pushes(log.with_suffix(".truth.json"), 1.3, 0.028)
    ratio = audit.signals.residual_nm / audit.signals.gamma_nm
    judged = JudgedResidual(audit.signals.time_s, ratio, audit.signals.state, names, 13)
    both = score(events, audit.result.collisions, judged)[0]
    return both.events - both.found - both.not_observable, both.false_alarms


@pytest.mark.parametrize("factor", [1.0, 1 / 0.85, 1 / 1.1], ids=["as calibrated", "15 % below", "10 % above"])
@pytest.mark.parametrize("causal", [False, True])
def test_all_pushes_and_no_false_alarm(hits: Path, friction: FrictionFile, factor: float, causal: bool) -> None:
    found = audited(hits, off(friction, factor), detect__causal=causal)
    missed, false = missed_and_false(found, hits)
    # a stated threshold stays as stated while the past does not tell the level of friction yet
    assert false <= (causal and factor != 1.0)
    assert missed == 0
    facts = found.result.detection
    assert facts is not None
    assert (facts.delay.filter_s > 0) is causal
    levels = [level.median for level in facts.friction_level.values()]
    assert levels == pytest.approx([1 / factor] * 6, abs=0.05)


def test_with_the_level_fixed_friction_off_its_calibration_costs_alarms(
    hits: Path, friction: FrictionFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The weakness that following the level cures, kept visible."""
    monkeypatch.setattr(residual, "FRICTION_LEVEL_SD", 0.001)
    with_fixed_level(monkeypatch)
    fixed = audited(hits, off(friction, 1 / 0.85))
    assert missed_and_false(fixed, hits)[1] > 2


def test_detectors_on_one_log(hits: Path, friction: FrictionFile) -> None:
    names = ("direct", "momentum", "filtered", "eso")
    counts = {name: len(audited(hits, friction, detect__detector=name).result.collisions) for name in names}
    assert all(abs(counts[name] - counts["direct"]) <= 3 for name in names)


def test_a_filter_too_slow_for_the_persistence_is_said(hits: Path, friction: FrictionFile) -> None:
    """Three hertz let half of a push of 26 ms pass."""
    slow = audited(hits, friction, conditioning__bandwidth_hz=3.0).result
    (finding,) = [f for f in slow.findings if f.code == "rule-unfit" and "26 ms" in f.text]
    assert finding.severity == "warning"
    assert "bandwidth_hz" in finding.text
    assert finding.text.count("direct") == 1, "the detector that runs is no remedy"
    usual = audited(hits, friction).result
    assert len(slow.collisions) < len(usual.collisions)
    assert not [f for f in usual.findings if f.code == "rule-unfit" and "bandwidth_hz" in f.text]


def test_another_detector_can_lead(hits: Path, friction: FrictionFile) -> None:
    found = audited(hits, friction, detect__detector="momentum").result
    assert found.rule.detector == "momentum"
    assert found.collisions
    assert found.verdict == "fail"
    assert found.detection is not None


def test_contacts_have_a_link_and_a_force_that_holds_the_truth(hits: Path, friction: FrictionFile) -> None:
    import json

    truth = json.loads(hits.with_suffix(".truth.json").read_text(encoding="utf-8"))
    pushes = [p for kind in ("collisions", "near_misses", "below_threshold") for p in truth[kind]]
    found = audited(hits, friction).result
    inside = linked = 0
    for contact in found.contacts:
        push = next(p for p in pushes if p["onset_s"] - 0.05 <= contact.onset_s <= p["onset_s"] + p["duration_s"])
        assert contact.force is not None
        low, high = contact.force.size_ci95_n
        size = float(np.linalg.norm(push["force_n"]))
        inside += low <= size and (high is None or size <= high)
        assert contact.least_force is not None
        assert 0.15 * size < contact.least_force.force_n < 1.05 * size
        linked += push["frame"] in {link.frame for link in contact.force.links}
        assert int(contact.link.removeprefix("link")) <= push["link"]
        assert len(contact.force.blind) + len(contact.joints) >= 1
        assert contact.evidence
    assert linked == len(found.contacts), "the link of the push was excluded wrongly"
    assert inside >= 0.9 * len(found.contacts)


def test_a_push_that_runs_into_a_gap_is_said(folder: Path, friction: FrictionFile, hits: Path) -> None:
    """Samples are lost 16 ms into a hard push: it cannot fire, and it cannot pass in silence."""
    loaded = load_config(hits.with_suffix(".toml"))
    prepared = prepare((hits,), loaded)
    series = prepared.series
    assert series.effort is not None
    whole = audit_log(prepared, loaded.config, friction, NOBODY, siblings=None).result
    hit = max(whole.collisions, key=lambda c: abs(c.peak_nm))
    a = int(np.searchsorted(series.time_s, hit.onset_s))
    effort = series.effort.copy()
    effort[a + 8 : a + 400] = np.nan
    cut = audit_log(
        replace(prepared, series=replace(series, effort=effort)), loaded.config, friction, NOBODY, siblings=None
    ).result
    assert not any(abs(c.onset_s - hit.onset_s) < 0.2 for c in cut.collisions if c.joint == hit.joint)
    findings = [f for f in cut.findings if f.code == "event-cut" and f.joint == hit.joint]
    assert any(f.start_s is not None and abs(f.start_s - hit.onset_s) < 0.05 for f in findings)


@pytest.mark.parametrize("kept", ["before", "after"])
def test_a_hard_contact_in_the_rows_beside_a_gap_is_said(hits: Path, friction: FrictionFile, kept: str) -> None:
    """A logger that stops with the controller keeps 50 ms of a contact: filters know one side of it, and no more."""
    loaded = load_config(hits.with_suffix(".toml"))
    log = open_log(hits, loaded)
    robot = load_robot(loaded, log.joint_names)

    def judged(rows: np.ndarray) -> AuditResult:
        return audit_log(
            prepare_log(log.samples(rows), robot, loaded.config), loaded.config, friction, NOBODY, siblings=None
        ).result

    hit = max(judged(log.time_s >= 0.0).collisions, key=lambda c: abs(c.peak_nm) / c.gamma_nm)
    last = hit.onset_s + hit.duration_s
    lost = (hit.onset_s + 0.05, last + 0.5) if kept == "before" else (hit.onset_s - 0.5, last - 0.05)
    found = judged((log.time_s < lost[0]) | (log.time_s > lost[1]))
    alarms = [c for c in found.collisions if c.joint == hit.joint and abs(c.onset_s - hit.onset_s) < 0.6]
    cut = [f for f in found.findings if f.code == "event-cut"]
    assert alarms or any(f.start_s is not None and abs(f.start_s - hit.onset_s) < 0.6 for f in cut)


def test_coarse_positions_beside_an_end_in_motion_are_no_contact(hits: Path, friction: FrictionFile) -> None:
    """Their derivatives are noise of many times the usual size there; the effort is the model's as before."""
    loaded = load_config(hits.with_suffix(".toml"), {"detect.gamma_nm": 8.0})
    log = open_log(hits, loaded)
    coarse = replace(log, position_rad=np.round(log.position_rad / 2e-3) * 2e-3, velocity_rad_s=None)
    robot = load_robot(loaded, log.joint_names)
    for end_s in (3.0, 4.0, 4.5, 7.0, 7.5):
        part = coarse.samples(log.time_s < log.time_s[0] + end_s)
        found = audit_log(prepare_log(part, robot, loaded.config), loaded.config, friction, NOBODY, siblings=None)
        assert "event-cut" not in {f.code for f in found.result.findings}


def test_phases_are_found_from_the_force() -> None:
    t = T * np.arange(20_000)
    force = 0.3 * np.sin(7 * t) + 20.0 * ((t > 10) & (t < 25)) + 20.0 * ((t > 30) & (t < 30.1))
    force[(t > 15) & (t < 15.2)] = 0.0  # the tool lifts for an instant
    config = PhasesConfig(find="wrench", force_control=[(9.0, 24.0)])
    labels = find_phases(np.abs(force), T)
    contact = t[labels == PHASES.index("contact")]
    assert (contact.min(), contact.max()) == pytest.approx((10.0, 25.0), abs=0.05)
    assert np.ptp(np.diff(contact)) < 1e-9, "one phase"
    assert t[labels == PHASES.index("approach")].min() == pytest.approx(8.0, abs=0.1)
    assert t[labels == PHASES.index("retreat")].max() == pytest.approx(27.0, abs=0.1)
    outside = [f for f in phase_findings(t, labels, config) if f.code == "log-label-missing"]
    assert [(f.start_s, f.end_s) for f in outside] == [pytest.approx((9.0, 10.0), abs=0.05)]
