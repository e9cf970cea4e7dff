"""How high the thresholds of other detectors have to be beside those of the one that a fit was made with.

Every detector looks at the same torques through another kernel, so its residual is as much noisier or quieter in any
motion. A minute of the fitted logs tells by how much; the law of the peaks is that of ``null_level.py`` for each.
"""

from __future__ import annotations

import numpy as np

from collaudit.core.config.detector_names import DETECTOR_NAMES
from collaudit.core.config.schema import Config, DetectConfig
from collaudit.core.data.signals import State
from collaudit.core.data.threshold_result import FittedThresholds, detector_key
from collaudit.core.detection.rule import DEFAULT_PERSISTENCE_MS, persistence_samples
from collaudit.core.detection.threshold import motion_features
from collaudit.core.errors import ConfigError
from collaudit.core.findings import joints_not_judged
from collaudit.core.friction.arm_fit import ArmFit
from collaudit.core.friction.joint_fits import friction_models
from collaudit.core.numeric.arrays import Span
from collaudit.core.numeric.stats import ARM_PER_HOUR, null_tail
from collaudit.core.prepare.log_part import part_of
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.recommend.null_level import NullEvidence, sustained_ratios
from collaudit.core.residual.detector import detector_named
from collaudit.core.residual.residual import ResidualInputs

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
    own = _levels(log, whole, thresholds, config.detect)
    out: dict[str, dict[str, float]] = {}
    for name in DETECTOR_NAMES:
        for causal in (False, True):
            if (name, causal) == (thresholds.detector, thresholds.causal):
                continue
            asked = config.detect.changed({"detector": name, "causal": causal})
            try:
                found = _levels(log, whole, thresholds, asked)
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
    return part_of(best[1], best[2])


def _levels(log: Prepared, whole: ArmFit, thresholds: FittedThresholds, detect: DetectConfig) -> dict[str, float]:
    """By joint the level, in units of the scale, that the residual of a detector reaches as seldom as is accepted."""
    series = log.judged_series
    laws, _ = friction_models(whole.fits, series)
    inputs = ResidualInputs(laws, joints_not_judged(log.findings, log.judged))
    residual = detector_named(detect.detector).residual(log, inputs, detect)
    n = persistence_samples(DEFAULT_PERSISTENCE_MS / 1e3, series.period_s)
    out = {}
    for joint, one in thresholds.joints.items():
        if joint not in series.joint_names or one.scale is None:
            continue
        j = series.column(joint)
        judged = np.isfinite(residual.torque_nm[:, j])
        judged &= residual.state[:, j] <= (State.JUDGED if residual.isolation.isolates else State.FRICTION_INTERVAL)
        features = motion_features(series.velocity_rad_s, j, series.period_s)
        data = NullEvidence(residual.torque_nm[:, j], judged, features, series.period_s)
        tail = null_tail(sustained_ratios(data, one.scale, n))
        if tail is not None:
            out[joint] = tail.level(ARM_PER_HOUR / len(thresholds.joints))
    return out
