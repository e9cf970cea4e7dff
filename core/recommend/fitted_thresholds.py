"""Thresholds for ``gamma_nm = "auto"``: from the held-out residual of the logs that friction was fitted on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf

import numpy as np

from collaudit.core.config.detector_names import DETECTOR_NAMES
from collaudit.core.config.schema import Config, DetectConfig
from collaudit.core.data.friction_result import FrictionCorrection, FrictionFit
from collaudit.core.data.recommendation_result import FittedThresholds, JointThreshold, ThresholdLevel, detector_key
from collaudit.core.data.signals import State
from collaudit.core.detection.rule import persistence_samples
from collaudit.core.detection.rule_settings import stated_persistence
from collaudit.core.detection.threshold import arm_speed, motion_features
from collaudit.core.errors import ConfigError
from collaudit.core.friction.arm_fit import ArmFit
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.joint_fits import friction_models
from collaudit.core.numeric.arrays import FloatArray, Span
from collaudit.core.numeric.null_tail import ARM_PER_HOUR, BLOCK_S, FEWEST_BLOCKS, null_tail
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.stats import median_of, quantile_of, robust_sd
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.recommend.evidence_range import Driven, range_of
from collaudit.core.recommend.held_out_residual import HeldOutResidual, residual_by
from collaudit.core.recommend.null_level import (
    NullEvidence,
    lasting_threshold,
    rest_level,
    scale_of,
    sustained_ratios,
    threshold_levels,
)

#: Persistences that thresholds are kept for, ms; 0 stands for a single sample.
_PERSISTENCES_MS = (0.0, 5.0, 12.5, 25.0, 50.0, 100.0, 200.0)
#: Evidence of which a larger share, and more seconds, lie above its own law is no evidence of contact-free
#: motion: less is a single event, which the law leaves out.
_EXCEEDED, _EVENT_S = 0.1, 1.0


def fitted_thresholds(
    residuals: Sequence[HeldOutResidual], fits: Mapping[str, FrictionFit], config: Config
) -> FittedThresholds:
    """Thresholds of every judged joint.

    Args:
        residuals: of the fitted logs; none where nothing can be compared.
        fits: their friction.
        config: detector, persistence.
    """
    arm = [arm_speed(one.series.velocity_rad_s) for one in residuals]
    joints = by_name(lambda joint: _joint(joint, fits[joint], residuals, arm, config, len(fits)), fits)
    return FittedThresholds(config.detect.detector, config.detect.causal, joints)


def corrections_that_help(
    residuals: Sequence[HeldOutResidual], corrections: Mapping[str, FrictionCorrection]
) -> dict[str, FrictionCorrection]:
    """The corrections of friction that make the held-out residual of their joint in motion smaller."""

    def rms(joint: str, corrected: bool) -> float:
        left = []
        for one in residuals:
            if one.corrected_nm is not None and joint in one.series.joint_names:
                j = one.series.column(joint)
                tried = one.judged[:, j] & np.isfinite(one.corrected_nm[:, j])
                left.append((one.corrected_nm if corrected else one.torque_nm)[tried, j])
        every = np.concatenate(left) if left else np.empty(0)
        return float(np.sqrt(np.mean(every**2))) if every.size else 0.0

    return {joint: one for joint, one in corrections.items() if rms(joint, True) <= rms(joint, False)}


def _joint(
    joint: str,
    fit: FrictionFit,
    residuals: Sequence[HeldOutResidual],
    arm: Sequence[FloatArray],
    config: Config,
    joints: int,
) -> JointThreshold:
    """Thresholds of one of so many joints; ``arm`` holds the speed of the arm, (n,) of each log."""
    seen = [(r, speed) for r, speed in zip(residuals, arm, strict=True) if joint in r.series.joint_names]
    columns = [(r, r.series.column(joint)) for r, _ in seen]
    law = FrictionModel.of(fit)
    seconds = sum(float(np.count_nonzero(r.judged[:, j])) * r.series.period_s for r, j in columns)
    if law is None or seconds < FEWEST_BLOCKS * BLOCK_S:
        why = "its friction could not be fitted" if law is None else _too_little(seconds)
        if fit.effort_unit == "raw" and not seconds:
            why = (
                "its effort is in a unit of its own and the motion does not show its gain: state "
                "[log.units] torque_constant_nm_per_a, or fit motion of this joint under a known load too"
            )
        return JointThreshold((), None, None, None, seconds / 3600.0, 0.0, None, why)
    data = [NullEvidence.of(r.series, r.series.column(joint), r.torque_nm, r.judged, speed) for r, speed in seen]
    x = np.concatenate([one.residual_nm[one.moving] for one in data])
    speed = np.concatenate([one.features[one.moving, 2] for one in data])
    held = np.concatenate([r.held_out[r.judged[:, j], j] for r, j in columns])
    loose = [r.evidence[:, j] & ~r.judged[:, j] for r, j in columns]
    scale = scale_of(data)
    asked = config.detect.persistence_ms
    kept_ms = sorted({*_PERSISTENCES_MS, *([asked] if asked is not None else [])})
    counts = dict.fromkeys(tuple(persistence_samples(ms / 1e3, one.period_s) for one in data) for ms in kept_ms)
    free = config.fit.contact == "none"
    levels = [] if scale is None else threshold_levels(data, scale, counts, joints, free)
    over = max((level.exceeded for level in levels), default=0.0)
    if over > _EXCEEDED and over * seconds > _EVENT_S:
        why = (
            f"its residual passes in {100 * over:.0f} % of the motion what the rest of the motion explains: contact, a "
            "stop or a fault in the fitted log that the fit did not recognise"
        )
        return JointThreshold((), None, None, None, seconds / 3600.0, 0.0, None, why)
    return JointThreshold(
        levels=_falling(levels),
        scale=scale,
        noise_nm=robust_sd(x - median_of(x)),
        rms_nm=float(np.sqrt(np.mean(x**2))),
        hours=seconds / 3600.0,
        held_out=float(np.mean(held)),
        fastest_rad_s=quantile_of(speed, 0.99),
        reason=None if levels else _too_little(seconds),
        evidence=range_of([_driven(r, j) for r, j in columns]),
        # again as much as friction holds, or what the model is wrong by in motion
        rest_nm=rest_level(
            [r.torque_nm[:, j] for r, j in columns], loose, max([law.hold, *(level.gamma_nm for level in levels)])
        ),
        lasting=None if scale is None else lasting_threshold(data, scale, joints, free),
        covered_nm=float(np.nanmedian(np.concatenate([r.doubt_nm[:, j] for r, j in columns]))),
    )


def _driven(one: HeldOutResidual, j: int) -> Driven:
    """What a joint did while the rule could fire."""
    series, used = one.series, one.evidence[:, j]
    heat = np.empty(0) if series.temperature_c is None else series.temperature_c[used, j]
    return Driven(series.velocity_rad_s[:, j], one.model_nm(j), used, ~one.judged[:, j], series.period_s, heat)


def _too_little(seconds: float) -> str:
    least = FEWEST_BLOCKS * BLOCK_S
    if seconds < least:
        return f"only {seconds:.3g} s of its motion could be judged (at least {least:g} s are needed)"
    return "its motion comes in pieces that are too short to tell what its residual does by itself"


def _falling(levels: list[ThresholdLevel]) -> tuple[ThresholdLevel, ...]:
    """Levels by persistence; a longer one never asks for more than a shorter one, which fires earlier on the same."""
    out: list[ThresholdLevel] = []
    lowest = inf
    for level in sorted(levels, key=lambda found: found.n):
        if level.gamma_nm <= lowest:
            out.append(level)
            lowest = level.gamma_nm
    return tuple(out)


#: Time that is looked at, s.
_LOOKED_S = 60.0


def other_detectors(whole: ArmFit, thresholds: FittedThresholds, config: Config) -> dict[str, dict[str, float]]:
    """By detector, and by joint, the factor on the thresholds that were found.

    Args:
        whole: the fit.
        thresholds: of the configured detector.
        config: says that detector.
    """
    known = {joint: one for joint, one in thresholds.joints.items() if one.levels and one.scale is not None}
    if not known:
        return {}
    log = _most_motion(whole.logs)
    series = log.judged_series
    arm = arm_speed(series.velocity_rad_s)
    motion = {
        joint: motion_features(series.velocity_rad_s, series.column(joint), series.period_s, arm)
        for joint in known
        if joint in series.joint_names
    }
    out: dict[str, dict[str, float]] = {}
    for causal in (False, True):
        n, _ = stated_persistence(DetectConfig(causal=causal, gamma_nm="auto"), series.period_s)
        own = _levels(log, whole, thresholds, motion, config.detect, n)
        for name in DETECTOR_NAMES:
            if (name, causal) == (thresholds.detector, thresholds.causal):
                continue
            asked = config.detect.changed({"detector": name, "causal": causal})
            try:
                found = _levels(log, whole, thresholds, motion, asked, n)
            except ConfigError:  # a detector that has no causal form
                continue
            factors = {joint: level / own[joint] for joint, level in found.items() if own.get(joint)}
            if factors:
                out[detector_key(name, causal)] = factors
    return out


def _most_motion(logs: tuple[Prepared, ...]) -> Prepared:
    """The minute of the logs in which the arm moves most."""
    best: tuple[float, Prepared, Span] | None = None
    for log in logs:
        speed = np.linalg.norm(np.nan_to_num(log.judged_series.velocity_rad_s), axis=1)
        total = np.concatenate([[0.0], np.cumsum(speed)])
        count = min(round(_LOOKED_S / log.series.period_s), speed.size)
        way = total[count:] - total[:-count]
        start = int(np.argmax(way))
        if best is None or way[start] * log.series.period_s > best[0]:
            best = (float(way[start]) * log.series.period_s, log, Span(start, start + count))
    assert best is not None
    return best[1].part(best[2])


def _levels(
    log: Prepared,
    whole: ArmFit,
    thresholds: FittedThresholds,
    motion: Mapping[str, FloatArray],
    detect: DetectConfig,
    n: int,
) -> dict[str, float]:
    """By joint the level, in units of the scale, that the residual of a detector reaches as seldom as is accepted.

    Args:
        log: some of the motion.
        whole, thresholds: as of :func:`other_detectors`.
        motion: by joint (n, 5) what its scale follows.
        detect: the detector.
        n: persistence in samples.
    """
    series = log.judged_series
    laws, _ = friction_models(whole.fits, series)
    residual = residual_by(log, laws, detect)
    worst_state = State.JUDGED if residual.isolation.isolates else State.FRICTION_INTERVAL
    judged = np.isfinite(residual.torque_nm) & (residual.state <= worst_state)
    out = {}
    for joint, features in motion.items():
        j, scale = series.column(joint), thresholds.joints[joint].scale
        assert scale is not None
        data = NullEvidence(residual.torque_nm[:, j], judged[:, j], features, series.period_s)
        tail = null_tail(sustained_ratios(data, scale, n))
        if tail is not None:
            out[joint] = tail.level(ARM_PER_HOUR / len(thresholds.joints))
    return out
