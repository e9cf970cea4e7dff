"""Rule (6) as it is applied to one log: thresholds, persistence in samples, watched joints."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import Config, DetectConfig
from collaudit.core.config.schema_detect import DEFAULT_PERSISTENCE_MS
from collaudit.core.data.audit_result import RuleFacts
from collaudit.core.data.threshold_result import FollowedMotion
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.detection.rule import persistence_samples
from collaudit.core.detection.watch import Watch, choose_watched
from collaudit.core.errors import ConfigError, did_you_mean
from collaudit.core.findings import Finding
from collaudit.core.prepare.phases import contact_mask

#: What lasts for this long alarms at a lower threshold too, where thresholds are automatic, s: of noise little is left
#: then, and a person who is hit or held pushes back for longer.
LASTING_S = 0.1
#: A spike of one sample or two does not alarm only to save time.
_FEWEST_CAUSAL = 3


def make_rule(
    series: UniformSeries,
    phases: NDArray[np.int8],
    config: Config,
    follows: FollowedMotion | None = None,
) -> tuple[RuleFacts, dict[str, Watch]]:
    """Thresholds, persistence and watched joints for a log's judged joints.

    Args:
        series, phases, config: of the log.
        follows: how thresholds go with the motion; None: they are constant.

    Raises:
        ConfigError: a threshold or a watched name belongs to no judged joint.
    """
    detect, follows = config.detect, follows or FollowedMotion()
    watch = choose_watched(series, contact_mask(phases), detect)
    gamma = {} if detect.gamma_nm == "auto" else _gamma(series.joint_names, detect.gamma_nm)
    for joint in series.joint_names:
        if joint not in gamma and watch[joint].watched:
            watch[joint] = Watch(False, False, "there is no threshold for it")
    n, requested = stated_persistence(detect, series.period_s)
    rule = RuleFacts(
        detector=detect.detector,
        gamma_nm=gamma,
        n=n,
        persistence_s=n * series.period_s,
        persistence_requested_ms=requested,
        watch=tuple(j for j in series.joint_names if watch[j].watched),
        near_miss_amplitude=config.near_miss.amplitude,
        near_miss_persistence=config.near_miss.persistence,
        near_miss_impulse=config.near_miss.impulse,
        follows=follows.scales,
        at_rest_nm=follows.at_rest_nm,
        lasting_nm=follows.lasting_nm,
        lasting_n=persistence_samples(LASTING_S, series.period_s),
    )
    return rule, watch


def stated_persistence(detect: DetectConfig, period_s: float) -> tuple[int, float | None]:
    """Persistence in samples, and in ms as it was asked for; None where it is told in samples."""
    if detect.n is not None:
        return detect.n, None
    n = persistence_samples(detect.asked_persistence_ms / 1e3, period_s)
    if detect.short_persistence:
        return min(max(n, _FEWEST_CAUSAL), persistence_samples(DEFAULT_PERSISTENCE_MS / 1e3, period_s)), None
    return n, detect.asked_persistence_ms


def _gamma(joints: tuple[str, ...], configured: float | dict[str, float]) -> dict[str, float]:
    if not isinstance(configured, dict):
        return dict.fromkeys(joints, float(configured))
    unknown = [name for name in configured if name not in joints]
    if unknown:
        raise ConfigError(
            "a threshold belongs to no judged joint",
            where="[detect] gamma_nm",
            found=", ".join(unknown),
            expected="some of " + ", ".join(joints),
            hint=did_you_mean(unknown[0], joints),
        )
    return {joint: float(configured[joint]) for joint in joints if joint in configured}


def watch_findings(watch: Mapping[str, Watch]) -> list[Finding]:
    """Which joints are not judged, or not in contact, and why."""
    findings: list[Finding] = []
    for joint, choice in watch.items():
        if not (choice.watched and choice.in_contact):
            where = "in contact" if choice.watched else "at all"
            text = f"Joint '{joint}' is not judged {where}: {choice.why}."
            findings.append(Finding("joint-not-watched", "info" if choice.watched else "warning", text, joint=joint))
    return findings
