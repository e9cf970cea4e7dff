"""Thresholds from the fit's held-out residual: what they are worth on other logs, and what happens without them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from origins import NOBODY

from collaudit.core.api import fit, prepare
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.recommendation_result import JointThreshold, ThresholdLevel
from collaudit.core.detection.fitted_rule import with_fitted_thresholds
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.null_tail import BLOCK_S, FEWEST_BLOCKS
from collaudit.core.recommend.fitted_thresholds import _too_little, fitted_thresholds
from collaudit.core.recommend.held_out_residual import fold_of_sample
from collaudit.core.scoring.detection_score import read_truth
from collaudit.fixtures.simulation import SimulatedFiles

FitOf = Callable[[str], FrictionFile]
Made = Callable[..., SimulatedFiles]


def audited(log: Path, friction: FrictionFile | None, **overrides: object) -> Audit:
    settings = {"detect.gamma_nm": "auto"} | {key.replace("__", "."): value for key, value in overrides.items()}
    loaded = load_config(log.with_suffix(".toml"), settings)
    return audit_log(prepare((log,), loaded), loaded.config, friction, NOBODY, siblings=None)


def test_thresholds_of_a_fit_hold_on_another_log(made, friction_of: FitOf, robot: str) -> None:  # type: ignore[no-untyped-def]
    friction = friction_of(robot)
    assert friction.thresholds is not None
    for joint, known in friction.thresholds.joints.items():
        assert known.reason is None, joint
        assert known.noise_nm is not None
        assert known.held_out > 0.5
        *_, at_rule = [level for level in known.levels if level.n <= 13]  # that of a shorter run is in force too
        assert 2 * known.noise_nm < at_rule.gamma_nm / at_rule.margin < 8 * known.noise_nm
    clean = audited(made("free-clean", robot, duration_s=60.0).log[0], friction)
    assert not clean.result.collisions
    gamma = clean.result.rule.gamma_nm
    assert max(gamma.values()) > 1.5 * min(gamma.values()), "one number does not fit every joint"
    assert any("times what motion does by itself" in f.text for f in clean.result.findings)


def test_without_thresholds_nothing_is_judged(hits: Path, friction: FrictionFile) -> None:
    for missing in (None, replace(friction, thresholds=None)):
        found = audited(hits, missing).result
        assert found.verdict == "not_judged"
        assert not found.rule.gamma_nm
        assert {f.joint for f in found.findings if f.code == "rule-unfit"} == set(found.log.joints)


def test_one_joint_without_a_threshold_is_no_pass(hits: Path, friction: FrictionFile) -> None:
    assert friction.thresholds is not None
    joints = dict(friction.thresholds.joints)
    joints["joint2"] = JointThreshold((), None, None, 0.0, 0.0, None, "only 3 s of its motion could be judged")
    found = audited(hits, replace(friction, thresholds=replace(friction.thresholds, joints=joints))).result
    (said,) = [f for f in found.findings if f.code == "rule-unfit" and f.joint is not None]
    assert said.joint == "joint2" and "only 3 s" in said.text
    assert found.coverage.joints["joint2"].watched is False


def test_what_the_fit_could_not_judge_is_not_judged_with_it(hits: Path, friction: FrictionFile) -> None:
    """An arm mounted upside down: identified inertials take gravity in, and the fit alone sees it."""
    joint, *others = friction.joints
    wrong = Finding("effort-sign-inverted", "error", "It runs against the model.", joint=joint)
    spoilt = replace(friction, findings=(*friction.findings, wrong))
    told = audited(hits, spoilt).result
    assert any("In the fitted logs: It runs against the model." in reason for reason in told.unjudged)
    aside = audited(hits, spoilt, detect__watch=others).result
    assert not any("In the fitted logs" in reason for reason in aside.unjudged)
    assert "warning" in [f.severity for f in aside.findings if f.code == "effort-sign-inverted"]


def test_a_joint_that_hardly_moves_is_an_exclusion_and_no_obstacle(hits: Path, friction: FrictionFile) -> None:
    loaded = load_config(hits.with_suffix(".toml"), {"detect.gamma_nm": "auto"})
    series = prepare((hits,), loaded).judged_series
    assert friction.thresholds is not None
    none = JointThreshold((), None, None, 0.0, 0.0, None, "its friction could not be fitted")
    still = series.position_rad.copy()
    still[:, series.column("joint2")] *= 0.04 / np.ptp(still[:, series.column("joint2")])

    def effects(position: FloatArray, *without: str) -> dict[str | None, str]:
        joints = {**friction.thresholds.joints, **dict.fromkeys(without, none)}  # type: ignore[union-attr]
        on_file = replace(friction.thresholds, joints=joints)  # type: ignore[type-var]
        _, _, found = with_fitted_thresholds(loaded.config, on_file, {}, replace(series, position_rad=position))
        return {f.joint: f.effect for f in found if f.code == "rule-unfit"}

    assert effects(still, "joint2") == {"joint2": "excludes"}
    assert effects(series.position_rad, "joint2") == {"joint2": "not-judged-joint"}
    assert set(effects(still, *series.joint_names).values()) == {"not-judged-joint"}, "nothing would be judged"


def test_a_joint_without_a_gain_says_so(hits: Path, friction: FrictionFile) -> None:
    """... and not that too little of its motion could be judged: none can, whatever its motion."""
    config = load_config(hits.with_suffix(".toml"), {"detect.gamma_nm": "auto"}).config
    raw = replace(friction.joints["joint1"], effort_unit="raw")
    found = fitted_thresholds((), {"joint1": raw, "joint2": friction.joints["joint2"]}, config).joints
    assert "torque_constant_nm_per_a" in (found["joint1"].reason or "")
    assert "could be judged" in (found["joint2"].reason or "")


def test_the_level_follows_the_rules_persistence(hits: Path, friction: FrictionFile) -> None:
    loaded = load_config(hits.with_suffix(".toml"), {"detect.gamma_nm": "sharpest"})
    series = prepare((hits,), loaded).judged_series
    assert friction.thresholds is not None
    levels = tuple(
        ThresholdLevel(n, 0.002 * n, g, 0.01, (0.0, 1.0)) for n, g in ((1, 9.0), (5, 7.0), (13, 5.0), (50, 3.0))
    )
    joints = {j: replace(x, levels=levels) for j, x in friction.thresholds.joints.items()}
    on_file = replace(friction.thresholds, joints=joints)

    def gamma(period_s: float, n: int) -> float:
        asked = loaded.config.changed({"detect": loaded.config.detect.changed({"n": n, "persistence_ms": None})})
        found, *_ = with_fitted_thresholds(asked, on_file, {}, replace(series, period_s=period_s))
        assert isinstance(found.detect.gamma_nm, dict)
        return found.detect.gamma_nm["joint1"]

    assert [gamma(0.002, n) for n in (1, 4, 5, 13, 49, 50, 99)] == [9.0, 9.0, 7.0, 5.0, 5.0, 3.0, 3.0]
    assert gamma(0.033, 1) == 9.0, "one sample at 30 Hz is one sample, however long"
    assert gamma(0.0002, 50) == 7.0, "10 ms at 5 kHz are not 100 ms at 500 Hz"


@pytest.mark.parametrize(("highest_nm", "said"), [(12.0, True), (8.0, False), (None, True)])
def test_what_the_fit_reached_below_the_threshold_doubts_no_alarm(
    hits: Path, friction: FrictionFile, highest_nm: float | None, said: bool
) -> None:
    """The fitted motion passes the level that most of it tells; the threshold stands higher, above all of it or not."""
    loaded = load_config(hits.with_suffix(".toml"), {"detect.gamma_nm": "auto"})
    series = prepare((hits,), loaded).judged_series
    assert friction.thresholds is not None
    level = ThresholdLevel(1, 0.002, 5.0, 0.01, (0.0, 1.0), exceeded=0.1, highest_nm=highest_nm)
    joints = {j: replace(x, levels=(level,)) for j, x in friction.thresholds.joints.items()}
    found, _, findings = with_fitted_thresholds(loaded.config, replace(friction.thresholds, joints=joints), {}, series)
    assert isinstance(found.detect.gamma_nm, dict) and 8.0 < found.detect.gamma_nm["joint1"] < 12.0
    assert any(f.joint == "joint1" and f.doubts_alarms for f in findings) is said


def test_a_threshold_above_the_drive_is_an_exclusion(hits: Path, friction: FrictionFile) -> None:
    assert friction.thresholds is not None
    joints = dict(friction.thresholds.joints)
    first = joints["joint1"]
    huge = tuple(replace(level, gamma_nm=500.0, margin=1.0, zero_doubt_nm=0.0) for level in first.levels)
    joints["joint1"] = replace(first, levels=huge)
    on_file = replace(friction, thresholds=replace(friction.thresholds, joints=joints))
    found = audited(hits, on_file, detect__gamma_nm="sharpest").result
    said = [f.text for f in found.findings if f.code == "rule-unfit" and "joint1 500" in f.text]
    assert said and set(said) <= set(found.exclusions)
    (source,) = [f for f in found.findings if "at what the fitted motion reaches" in f.text]
    assert "an hour" in source.text


@pytest.mark.parametrize(("detector", "causal"), [("momentum", True), ("direct", True)])
def test_a_detector_has_thresholds_of_a_fit_with_it(
    made: Made, friction: FrictionFile, hits: Path, detector: str, causal: bool
) -> None:
    """Causal or offline: pushes found, and none elsewhere; a fit with another detector judges nothing."""
    truth = read_truth(hits.with_suffix(".truth.json"))
    loaded = load_config(
        hits.with_suffix(".toml"),
        {
            "detect.gamma_nm": "sharpest",
            "detect.detector": detector,
            "detect.causal": causal,
            "detect.persistence_ms": None,
        },
    )
    prepared = prepare((hits,), loaded)
    without = audit_log(prepared, loaded.config, friction, NOBODY, truth, siblings=None).result
    assert without.verdict == "not_judged"
    assert any("fit again with this one" in f.text for f in without.findings if f.code == "rule-unfit")
    clean = made("free-clean", "paper6", duration_s=60.0)
    own = load_config(clean.config, {"detect.detector": detector, "detect.causal": causal})
    found = audit_log(prepared, loaded.config, fit([clean.log], own), NOBODY, truth, siblings=None).result
    assert found.verdict == "fail"
    assert found.rule.n == (7 if causal else 13)
    assert found.detection is not None
    score = found.detection.scores[0]
    assert score.false_alarms == 0
    assert score.found >= 0.9 * (score.events - score.not_observable)


def test_folds_are_dealt_out_in_turn(hits: Path) -> None:
    series = prepare((hits,), load_config(hits.with_suffix(".toml"))).judged_series
    fold = fold_of_sample(series, 4)
    assert set(fold) == {0, 1, 2, 3}
    changes = np.flatnonzero(np.diff(fold))
    assert changes.size >= 11, "each fold comes back at least three times"
    assert np.bincount(fold).min() > 0.15 * fold.size


def test_too_little_motion_and_motion_in_pieces_are_different_reasons() -> None:
    least = FEWEST_BLOCKS * BLOCK_S
    assert f"at least {least:g} s are needed" in _too_little(0.9 * least)
    assert "at least" not in _too_little(1.2 * least), "what is enough is not called too little"
    assert "pieces that are too short" in _too_little(1.2 * least)
