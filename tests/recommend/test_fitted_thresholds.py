"""Thresholds from the fit's held-out residual: what they are worth on other logs, and what happens without them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from origins import NOBODY

from collaudit.core.api import prepare
from collaudit.core.audit import audit_log
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.threshold_result import FittedThresholds, JointThreshold, ThresholdLevel
from collaudit.core.detection.fitted_rule import isolated_peak_findings, with_fitted_thresholds
from collaudit.core.friction.held_out_laws import fold_of_sample
from collaudit.core.recommend.fitted_thresholds import threshold_level
from collaudit.core.recommend.isolated_peaks import without_isolated_peaks
from collaudit.core.recommend.recommendation import CleanResidual

FitOf = Callable[[str], FrictionFile]


def audited(log: Path, friction: FrictionFile | None, **overrides: object) -> Audit:
    settings = {"detect.gamma_nm": "auto"} | {key.replace("__", "."): value for key, value in overrides.items()}
    loaded = load_config(log.with_suffix(".toml"), settings)
    return audit_log(prepare((log,), loaded), loaded.config, friction, NOBODY)


def test_thresholds_of_a_fit_hold_on_another_log(made, friction_of: FitOf, robot: str) -> None:  # type: ignore[no-untyped-def]
    friction = friction_of(robot)
    assert friction.thresholds is not None
    for joint, known in friction.thresholds.joints.items():
        assert known.reason is None, joint
        assert known.noise_nm is not None
        assert known.held_out > 0.5
        *_, at_rule = [level for level in known.levels if level.n <= 13]  # that of a shorter run is in force too
        assert 2 * known.noise_nm < at_rule.gamma_nm < 10 * known.noise_nm
    clean = audited(made("free-clean", robot, duration_s=60.0).log[0], friction)
    assert not clean.result.collisions
    gamma = clean.result.rule.gamma_nm
    assert max(gamma.values()) > 1.5 * min(gamma.values()), "one number does not fit every joint"
    assert "gamma-from-fit" in {f.code for f in clean.result.findings}


def test_without_thresholds_nothing_is_judged(hits: Path, friction: FrictionFile) -> None:
    for missing in (None, replace(friction, thresholds=None)):
        found = audited(hits, missing).result
        assert found.verdict == "not_judged"
        assert not found.rule.gamma_nm
        assert {f.joint for f in found.findings if f.code == "gamma-missing"} == set(found.log.joints)
    other = audited(hits, friction, detect__detector="momentum").result
    assert other.verdict == "not_judged"
    assert any("belong to the detector 'direct'" in reason for reason in other.reasons)


def test_one_joint_without_a_threshold_is_no_pass(hits: Path, friction: FrictionFile) -> None:
    assert friction.thresholds is not None
    joints = dict(friction.thresholds.joints)
    joints["joint2"] = JointThreshold((), None, None, 0.0, 0.0, None, "only 3 s of its motion could be judged")
    found = audited(hits, replace(friction, thresholds=replace(friction.thresholds, joints=joints))).result
    (said,) = [f for f in found.findings if f.code == "gamma-missing"]
    assert said.joint == "joint2" and "only 3 s" in said.text
    assert found.coverage.joints["joint2"].watched is False


def test_the_level_follows_the_rules_persistence(hits: Path, friction: FrictionFile) -> None:
    loaded = load_config(hits.with_suffix(".toml"), {"detect.gamma_nm": "auto"})
    series = prepare((hits,), loaded).judged_series
    assert friction.thresholds is not None
    levels = tuple(ThresholdLevel(n, 0.002 * n, g, None) for n, g in ((1, 9.0), (5, 7.0), (13, 5.0), (50, 3.0)))
    joints = {j: replace(x, levels=levels) for j, x in friction.thresholds.joints.items()}
    on_file = replace(friction.thresholds, joints=joints)

    def gamma(period_s: float, n: int) -> float:
        asked = loaded.config.changed({"detect": loaded.config.detect.changed({"n": n, "persistence_ms": None})})
        found, _ = with_fitted_thresholds(asked, on_file, {}, replace(series, period_s=period_s))
        assert isinstance(found.detect.gamma_nm, dict)
        return found.detect.gamma_nm["joint1"]

    assert [gamma(0.002, n) for n in (1, 4, 5, 13, 49, 50, 99)] == [9.0, 9.0, 7.0, 5.0, 5.0, 3.0, 3.0]
    assert gamma(0.033, 1) == 9.0, "one sample at 30 Hz is one sample, however long"
    assert gamma(0.0002, 50) == 7.0, "10 ms at 5 kHz are not 100 ms at 500 Hz"


@pytest.mark.parametrize("seconds", [30.0, 600.0])
def test_the_level_is_seldom_passed(seconds: float) -> None:
    """Coloured Gaussian residuals: the threshold from one stretch, over an hour of the same, and not absurdly high."""
    from scipy.signal import lfilter

    rng = np.random.default_rng(1)

    def residual(duration_s: float) -> np.ndarray:
        x = lfilter([0.05], [1.0, -0.95], rng.standard_normal(round(500 * duration_s)))
        return np.asarray(x / np.std(x))

    over = []
    for _ in range(10):
        data = CleanResidual(residual(seconds), np.ones(round(500 * seconds), dtype=bool), 0.002)
        level = threshold_level([data], 0.026)
        assert level is not None and level.n == 13
        assert 3.0 < level.gamma_nm < 11.0
        x = np.abs(residual(600.0)) > level.gamma_nm
        over.append(np.convolve(x, np.ones(13), "valid").max() >= 13)
    assert sum(over) == 0


def coloured(duration_s: float, seed: int = 3) -> np.ndarray:
    from scipy.signal import lfilter

    x = lfilter([0.05], [1.0, -0.95], np.random.default_rng(seed).standard_normal(round(500 * duration_s)))
    return np.asarray(x / np.std(x))


def test_a_peak_that_stands_alone_is_no_evidence_and_is_said() -> None:
    x = coloured(60.0)
    at = np.arange(x.size) * 0.002
    free = CleanResidual(x, np.ones(x.size, dtype=bool), 0.002)
    assert without_isolated_peaks([free], [free.clean], [False], ["a"], [at])[1] == ()
    pushed = x.copy()
    pushed[15000:15200] += 40.0
    kept, (peak,) = without_isolated_peaks([replace(free, residual_nm=pushed)], [free.clean], [False], ["a"], [at])
    assert (peak.log, round(peak.start_s), round(peak.end_s)) == ("a", 30, 31)
    assert 38 < peak.peak_nm < 44
    assert not kept[0].clean[14800:15400].any()
    before, after, raised = (threshold_level([d], 0.026) for d in (free, kept[0], replace(free, residual_nm=pushed)))
    assert before and after and raised
    assert after.gamma_nm == pytest.approx(before.gamma_nm, rel=0.1)
    assert raised.gamma_nm > 40
    level = JointThreshold((after,), 1.0, 1.0, 0.016, 1.0, 1.0, isolated=(peak,), rated_nm=after.gamma_nm - 0.1)
    on_file = FittedThresholds("direct", False, {"joint1": level})
    (said,) = isolated_peak_findings(on_file)
    assert said.code == "gamma-peaks-left-out" and "of a" in said.text
    light = replace(free, residual_nm=np.where(pushed == x, x, x + 10.0))
    for contact in (False, True):  # elsewhere in the log
        left, (peak,) = without_isolated_peaks([light], [free.clean], [contact], ["a"], [at])
        assert peak.counted is not contact
        assert left[0].clean[15000:15200].all() == (not contact)
    seen = replace(level, isolated=(replace(peak, counted=True),))
    (said,) = isolated_peak_findings(FittedThresholds("direct", False, {"joint1": seen}))
    assert (said.code, said.effect) == ("gamma-peaks-counted", "excludes")


def test_peaks_of_every_reversal_are_evidence() -> None:
    x = coloured(60.0)
    for start in range(500, x.size - 500, 2000):  # every four seconds
        x[start : start + 50] += 12.0
    data = CleanResidual(x, np.ones(x.size, dtype=bool), 0.002)
    at = np.arange(x.size) * 0.002
    assert without_isolated_peaks([data], [data.clean], [True], ["a"], [at])[1] == ()
    seldom = replace(data, residual_nm=np.where(at < 48.0, 0.0, coloured(60.0)))  # it rests most of the time
    assert without_isolated_peaks([seldom], [at >= 48.0], [True], ["a"], [at])[1] == ()


def test_a_part_unlike_the_others_widens_the_threshold_of_a_short_log() -> None:
    alike = coloured(90.0)
    unlike = alike.copy()
    unlike[-9000:] *= 2.0  # the last fifth moves in another way; more may come
    even, uneven = (
        threshold_level([CleanResidual(x, np.ones(x.size, dtype=bool), 0.002)], 0.026) for x in (alike, unlike)
    )
    assert even and uneven
    largest = [max(np.abs(part)) for part in np.array_split(unlike, 5)]
    assert uneven.gamma_nm > 1.25 * max(largest)


def test_a_threshold_above_the_drive_is_an_exclusion(hits: Path, friction: FrictionFile) -> None:
    assert friction.thresholds is not None
    joints = dict(friction.thresholds.joints)
    first = joints["joint1"]
    assert first.rated_nm is None or first.rated_nm > 10 * first.levels[0].gamma_nm
    huge = tuple(replace(level, gamma_nm=500.0) for level in first.levels)
    joints["joint1"] = replace(first, levels=huge, rated_nm=300.0)
    found = audited(hits, replace(friction, thresholds=replace(friction.thresholds, joints=joints))).result
    (said,) = [f for f in found.findings if f.code == "gamma-beyond-drive"]
    assert said.joint == "joint1" and said.text in found.exclusions
    (source,) = [f for f in found.findings if f.code == "gamma-from-fit"]
    assert ("That is little" in source.text) == (min(j.hours for j in joints.values()) < 0.1)


def test_folds_are_dealt_out_in_turn(hits: Path) -> None:
    series = prepare((hits,), load_config(hits.with_suffix(".toml"))).judged_series
    fold = fold_of_sample(series, 4)
    assert set(fold) == {0, 1, 2, 3}
    changes = np.flatnonzero(np.diff(fold))
    assert changes.size >= 11, "each fold comes back at least three times"
    assert np.bincount(fold).min() > 0.15 * fold.size
