"""Thresholds for ``gamma_nm = "auto"``: from the held-out residual of the logs that friction was fitted on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf, sqrt

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.friction_correction import FrictionCorrection
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.identification_result import FrictionVariation
from collaudit.core.data.recommendation_result import RangeOfEvidence
from collaudit.core.data.threshold_result import FittedThresholds, JointThreshold, ThresholdLevel
from collaudit.core.detection.rule import persistence_samples
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import by_name, ordered_map
from collaudit.core.numeric.stage_progress import Progress, stage
from collaudit.core.numeric.stats import median_of, quantile_of, robust_sd
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.recommend.clean_tail import BLOCK_S, FEWEST_BLOCKS, clean_tail
from collaudit.core.recommend.evidence_range import acceleration, range_of_samples, reversals_of
from collaudit.core.recommend.held_out_residual import (
    Folds,
    HeldOutResidual,
    folds_of,
    held_out_residuals,
    joint_by_joint,
)
from collaudit.core.recommend.isolated_peaks import without_isolated_peaks
from collaudit.core.recommend.recommendation import MARGIN, TARGET_H, CleanResidual, sustained_peaks

#: Persistences that thresholds are kept for, ms; 0 stands for a single sample.
_PERSISTENCES_MS = (0.0, 5.0, 10.0, 25.0, 50.0, 100.0, 200.0)
#: Less motion than this is no evidence of a tail.
_LEAST_S = 5.0
#: Peaks of a short log are taken of shorter blocks, so that there are enough of them for a tail.
_SHORT_BLOCK_S = 0.25
#: Parts of the time that are compared, and Student's t at one-sided 95 % for one less.
_PARTS, _T_95 = 5, 2.132


def fitted_thresholds(
    prepared: Sequence[Prepared],
    fits: Mapping[str, FrictionFit],
    variation: Mapping[str, FrictionVariation],
    corrections: Mapping[str, FrictionCorrection],
    config: Config,
    folds: Folds | None = None,
    progress: Progress | None = None,
) -> FittedThresholds:
    """Thresholds of every judged joint.

    Args:
        prepared: the logs as they were fitted.
        fits: their friction.
        variation, corrections: what friction goes with besides speed.
        config: detector, persistence, folds.
        folds: laws without each fold in turn, where they are at hand.
        progress: called with steps done and in all.
    """
    part = stage(progress, 0.0, 0.6)
    residuals = held_out_residuals(prepared, fits, variation, corrections, config, folds, part)

    def of_joint(joint: str) -> JointThreshold:
        return replace(_joint(joint, fits[joint], residuals, config), rated_nm=_rated(prepared, joint))

    joints = by_name(of_joint, fits, stage(progress, 0.6, 1.0))
    return FittedThresholds(config.detect.detector, config.detect.causal, joints)


def corrections_that_help(
    prepared: Sequence[Prepared],
    fits: Mapping[str, FrictionFit],
    variation: Mapping[str, FrictionVariation],
    corrections: Mapping[str, FrictionCorrection],
    config: Config,
    progress: Progress | None = None,
) -> tuple[dict[str, FrictionCorrection], FittedThresholds]:
    """Corrections with which a joint's whole held-out residual is smaller, and the thresholds of every joint.

    A correction is found on settled motion. One that spoils the rest, at reversals or under loads that the fit hardly
    saw, is dropped. The thresholds are those of the residual without corrections: faster motion carries ripple out of
    the detector's band, and leaves errors that the fitted motion did not show; a threshold that counts on what ripple
    explained in slow motion gave alarms there.

    Args:
        prepared, fits, variation, corrections, config: as of :func:`fitted_thresholds`.
        progress: called with steps done and in all.
    """
    folds = folds_of(prepared, fits, config, stage(progress, 0.0, 0.35))
    part = stage(progress, 0.35, 0.7 if corrections else 1.0)
    plain = fitted_thresholds(prepared, fits, variation, {}, config, folds, part)
    if not corrections:
        return {}, plain
    among = {j: fit for j, fit in fits.items() if j in corrections} if joint_by_joint(config) else fits
    corrected = fitted_thresholds(prepared, among, variation, corrections, config, folds, stage(progress, 0.7, 1.0))
    kept = {j: c for j, c in corrections.items() if _helps(corrected.joints[j], plain.joints[j])}
    return kept, plain


def _helps(corrected: JointThreshold, plain: JointThreshold) -> bool:
    """Whether a correction lessens the residual and raises no threshold; without held-out motion it stands as found."""
    if corrected.rms_nm is None or plain.rms_nm is None:
        return True
    before = {level.n: level.gamma_nm for level in plain.levels}
    ratios = [level.gamma_nm / before[level.n] for level in corrected.levels if level.n in before]
    return corrected.rms_nm < plain.rms_nm and (not ratios or float(np.median(ratios)) <= 1.0)


def _joint(joint: str, fit: FrictionFit, residuals: Sequence[HeldOutResidual], config: Config) -> JointThreshold:
    columns = [(r, r.joint_names.index(joint)) for r in residuals if joint in r.joint_names]
    judged = [r.judged[:, j] for r, j in columns]
    seconds = sum(float(np.count_nonzero(mask)) * r.period_s for (r, _), mask in zip(columns, judged, strict=True))
    if fit.model is None or seconds < _LEAST_S:
        why = "its friction could not be fitted" if fit.model is None else _too_little(seconds)
        return JointThreshold((), None, None, seconds / 3600.0, 0.0, None, why)
    x = np.concatenate([r.torque_nm[mask, j] for (r, j), mask in zip(columns, judged, strict=True)])
    speed = np.concatenate([np.abs(r.velocity_rad_s[mask, j]) for (r, j), mask in zip(columns, judged, strict=True)])
    held = np.concatenate([r.held_out[mask, j] for (r, j), mask in zip(columns, judged, strict=True)])
    data, isolated = without_isolated_peaks(
        [CleanResidual(r.torque_nm[:, j], r.evidence[:, j], r.period_s) for r, j in columns],
        judged,
        [r.touched for r, _ in columns],
        [r.log for r, _ in columns],
        [r.time_s for r, _ in columns],
    )
    asked = config.detect.persistence_ms
    persistences = sorted({*_PERSISTENCES_MS, *([asked] if asked is not None else [])})
    levels: dict[int, ThresholdLevel] = {}
    for level in ordered_map(lambda persistence: threshold_level(data, persistence / 1e3), persistences):
        if level is not None:
            levels.setdefault(level.n, level)
    return JointThreshold(
        levels=_falling(list(levels.values())),
        noise_nm=robust_sd(x - median_of(x)),
        rms_nm=float(np.sqrt(np.mean(x**2))),
        hours=sum(float(np.count_nonzero(d.clean)) * d.period_s for d in data) / 3600.0,
        held_out=float(np.mean(held)),
        fastest_rad_s=quantile_of(speed, 0.99),
        reason=None if levels else _too_little(seconds),
        isolated=isolated,
        evidence=_range(columns),
    )


def _range(columns: Sequence[tuple[HeldOutResidual, int]]) -> RangeOfEvidence | None:
    """What the evidence of one joint covers: time in which the rule could fire."""
    used = [(r, j, np.asarray(r.evidence[:, j])) for r, j in columns]
    count = sum(int(np.count_nonzero(mask)) for _, _, mask in used)
    if count == 0:
        return None
    unknown = np.empty(0)
    known = [unknown if r.temperature_c is None else r.temperature_c[mask, j] for r, j, mask in used]
    standing = sum(int(np.count_nonzero(mask & ~r.judged[:, j])) for r, j, mask in used)
    return range_of_samples(
        speed=np.concatenate([np.abs(r.velocity_rad_s[mask, j]) for r, j, mask in used]),
        turn=np.concatenate([acceleration(r.velocity_rad_s[:, j], r.period_s)[mask] for r, j, mask in used]),
        load=np.nan_to_num(np.concatenate([r.model_nm(mask, j) for r, j, mask in used])),
        reversals=(
            sum(reversals_of(r.velocity_rad_s[mask, j]) for r, j, mask in used),
            sum(float(np.count_nonzero(mask)) * r.period_s for r, _, mask in used) / 3600.0,
        ),
        standing=standing / count,
        phases={},
        temperature_c=np.concatenate(known),
    )


def _rated(prepared: Sequence[Prepared], joint: str) -> float | None:
    robot = next((log.robot for log in prepared if joint in log.robot.joint_names), None)
    limit = 0.0 if robot is None else float(robot.effort_limit_nm[robot.joint_names.index(joint)])
    return limit if 0 < limit < inf else None


def _too_little(seconds: float) -> str:
    return f"only {seconds:.3g} s of its motion could be judged (at least {_LEAST_S:g} s are needed)"


def threshold_level(data: Sequence[CleanResidual], persistence_s: float) -> ThresholdLevel | None:
    """Threshold at one persistence: what the tail of the sustained peaks reaches once in ``TARGET_H`` hours.

    Or the largest level that the data sustained for n samples, or what :func:`_next_peak` expects of another log as
    long, whichever is highest; and ``MARGIN`` times that, for the motion that is judged is not the motion of the fit.
    The squares of the peaks are
    taken to have the exponential tail (Weibull, shape 2): the residual is a sum of many errors, each bounded or
    Gaussian, and an exponential tail of the peaks themselves would double the thresholds of logs of half a minute.
    """
    counts = [persistence_samples(persistence_s, d.period_s) for d in data]
    seconds = sum(float(np.count_nonzero(d.clean)) * d.period_s for d in data)
    block_s = BLOCK_S if seconds >= FEWEST_BLOCKS * BLOCK_S else _SHORT_BLOCK_S
    peaks: FloatArray = np.concatenate([sustained_peaks(d, n, block_s) for d, n in zip(data, counts, strict=True)])
    tail = clean_tail(peaks**2, seconds / 3600.0)
    if tail is None:
        return None
    gamma = MARGIN * max(float(peaks.max()), sqrt(tail.level_at(1.0 / TARGET_H)), _next_peak(peaks))
    lasting = max(n * d.period_s for n, d in zip(counts, data, strict=True))
    return ThresholdLevel(max(counts), lasting, gamma, tail.rate_per_hour(gamma**2))


def _next_peak(peaks: FloatArray) -> float:
    """The largest peak that another fifth of the data may have, with 95 % confidence: parts of a log are not alike.

    The prediction bound of one more value by Student's t, from the largest peaks of five parts of the time (Hahn,
    J. Am. Stat. Assoc. 64, 1969). It falls with more data, for then each part has seen more kinds of motion.
    """
    largest = np.array([float(part.max()) for part in np.array_split(peaks, _PARTS)])
    return float(largest.mean() + _T_95 * np.sqrt(1.0 + 1.0 / _PARTS) * largest.std(ddof=1))


def _falling(levels: list[ThresholdLevel]) -> tuple[ThresholdLevel, ...]:
    """Levels by persistence; a longer one never asks for more than a shorter one, which fires earlier on the same."""
    out: list[ThresholdLevel] = []
    lowest = inf
    for level in sorted(levels, key=lambda found: found.n):
        if level.gamma_nm <= lowest:
            out.append(level)
            lowest = level.gamma_nm
    return tuple(out)
