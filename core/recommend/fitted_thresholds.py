"""The motion's levels, from the held-out residual of the fitted logs, and what force they notice.

Corrections, trends and patterns of position look at the same samples of settled motion, which take 100 MB a joint of an
hour: made once, and let go before the next.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.cycles.null_level import NullEvidence, motion_levels, rest_level
from collaudit.core.data.friction_result import FrictionCorrection, FrictionFit
from collaudit.core.data.identification_result import FrictionVariation
from collaudit.core.data.recommendation_result import (
    FittedThresholds,
    JointThreshold,
    PlaceForce,
    ThresholdLevel,
)
from collaudit.core.detection.position_pattern import settled_pattern_findings
from collaudit.core.detection.rule_settings import known_limits, stated_persistence
from collaudit.core.findings import Finding
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.friction_variation import joint_correction, joint_variation, of_logs
from collaudit.core.friction.motion_points import settled_residual
from collaudit.core.numeric.null_tail import BLOCK_S, FEWEST_BLOCKS
from collaudit.core.numeric.parallel import Progress, by_name
from collaudit.core.numeric.stats import median_of, quantile_of, robust_sd
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.recommend.evidence_range import Driven, range_of
from collaudit.core.recommend.held_out_residual import HeldOutResidual
from collaudit.core.robot.arm_places import Place, alarming_forces, arm_places, exerted_force


@dataclass(frozen=True, slots=True)
class SettledMotion:
    """What the settled motion of the fitted logs shows.

    Attributes:
        corrections: by joint, of all logs together; joints that need none are absent.
        variation: by joint, log after log.
        patterns: of each log the findings on torque that follows the position.
    """

    corrections: dict[str, FrictionCorrection]
    variation: dict[str, FrictionVariation]
    patterns: tuple[list[Finding], ...]


def settled_motion(
    prepared: Sequence[Prepared], fits: Mapping[str, FrictionFit], progress: Progress | None = None
) -> SettledMotion:
    """What is left beside each joint's law while it moves steadily.

    Args:
        prepared: the logs that the friction was fitted on.
        fits: friction of all of them together.
        progress: called with joints done and in all.
    """

    def of_joint(joint: str) -> tuple[FrictionCorrection | None, FrictionVariation | None, dict[int, list[Finding]]]:
        law = FrictionModel.of(fits[joint])
        if law is None or fits[joint].effort_unit == "raw":
            return None, None, {}
        logs = {k: log for k, log in enumerate(prepared) if joint in log.judged}
        parts = {k: left for k, log in logs.items() if (left := settled_residual(log, joint, law)) is not None}
        in_torque = [part for k, part in parts.items() if logs[k].series.effort_unit == "Nm"]
        return (
            joint_correction(in_torque) if in_torque else None,
            of_logs([joint_variation(logs[k].series.source.name, part) for k, part in parts.items()])
            if parts
            else None,
            {k: settled_pattern_findings(joint, part) for k, part in parts.items()},
        )

    joints = by_name(of_joint, fits, progress)
    return SettledMotion(
        {joint: correction for joint, (correction, _, _) in joints.items() if correction is not None},
        {joint: variation for joint, (_, variation, _) in joints.items() if variation is not None},
        tuple([f for _, _, found in joints.values() for f in found.get(k, [])] for k in range(len(prepared))),
    )


#: Poses that a force is told from.
_POSES = 500
#: Evidence of which a larger share, and more seconds, lie above its own law is no evidence of contact-free
#: motion: less is a single event, which the law leaves out.
_EXCEEDED, _EVENT_S = 0.1, 1.0


def fitted_thresholds(
    residuals: Sequence[HeldOutResidual], fits: Mapping[str, FrictionFit], config: Config
) -> FittedThresholds:
    """The level of every judged joint.

    Args:
        residuals: of the fitted logs; none where nothing can be compared.
        fits: their friction.
        config: detector, persistence.
    """
    joints = by_name(lambda joint: _joint(joint, fits[joint], residuals, config, len(fits)), fits)
    forces = _forces(residuals[0].prepared, residuals, joints, config) if residuals else {}
    return FittedThresholds(config.detect.detector, config.detect.causal, joints, forces=forces)


def _joint(
    joint: str, fit: FrictionFit, residuals: Sequence[HeldOutResidual], config: Config, joints: int
) -> JointThreshold:
    """The level of one of so many joints."""
    columns = [(r, r.series.column(joint)) for r in residuals if joint in r.series.joint_names]
    law = FrictionModel.of(fit)
    seconds = sum(float(np.count_nonzero(r.judged[:, j])) * r.series.period_s for r, j in columns)
    if law is None or seconds < FEWEST_BLOCKS * BLOCK_S:
        why = "its friction could not be fitted" if law is None else _too_little(seconds)
        if fit.effort_unit == "raw" and not seconds:
            why = (
                "its effort is in a unit of its own and the motion does not show its gain: state "
                "[log.units] torque_constant_nm_per_a, or fit motion of this joint under a known load too"
            )
        return _none(seconds, why)
    data = [NullEvidence(r.torque_nm[:, j], r.judged[:, j], r.series.period_s) for r, j in columns]
    x = np.concatenate([one.residual_nm[one.moving] for one in data])
    speed = np.concatenate([np.abs(np.nan_to_num(r.series.velocity_rad_s[r.judged[:, j], j])) for r, j in columns])
    held = np.concatenate([r.held_out[r.judged[:, j], j] for r, j in columns])
    loose = [r.evidence[:, j] & ~r.judged[:, j] for r, j in columns]
    levels = motion_levels(data, _counts(data, config), joints, config.fit.contact == "none")
    over = max((level.exceeded for level in levels), default=0.0)
    if over > _EXCEEDED and over * seconds > _EVENT_S:
        why = (
            f"its residual passes in {100 * over:.0f} % of the motion what the rest of the motion explains: contact, a "
            "stop or a fault in the fitted log that the fit did not recognise"
        )
        return _none(seconds, why)
    return JointThreshold(
        levels=_falling(levels),
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
        covered_nm=float(np.nanmedian(np.concatenate([r.doubt_nm[:, j] for r, j in columns]))),
    )


def _none(seconds: float, why: str) -> JointThreshold:
    return JointThreshold((), None, None, seconds / 3600.0, 0.0, None, why)


def _counts(data: Sequence[NullEvidence], config: Config) -> list[tuple[int, ...]]:
    """The persistence of the rule in samples of each log, and a single sample: a shorter one needs that level."""
    asked = [stated_persistence(config.detect, one.period_s)[0] for one in data]
    return [*dict.fromkeys([(1,) * len(data), tuple(asked)])]


def _forces(
    prepared: Prepared, residuals: Sequence[HeldOutResidual], joints: Mapping[str, JointThreshold], config: Config
) -> dict[str, PlaceForce]:
    """By place what steady force alarms at the levels in the poses of the motion, and what the arm exerts."""
    robot = prepared.robot
    places = arm_places(robot, prepared.judged, config.robot.tool.frame)
    every = [
        one.prepared.series.position_rad[one.evidence.any(axis=1)]
        for one in residuals
        if one.prepared.series.joint_names == prepared.series.joint_names
    ]
    poses = np.concatenate(every) if every else np.empty((0, 0))
    poses = poses[np.isfinite(poses).all(axis=1)]
    poses = poses[:: max(1, len(poses) // _POSES)]
    if not places or not len(poses):
        return {}
    asked = [joint in joints and bool(joints[joint].levels) for joint in robot.joint_names]
    level = [
        joints[name].levels[-1].gamma_nm if its else np.inf for name, its in zip(robot.joint_names, asked, strict=True)
    ]
    limits = known_limits(prepared)

    def at(place: Place) -> PlaceForce:
        shape = (len(poses), len(asked))
        found = alarming_forces(robot, place, poses, np.broadcast_to(level, shape), np.broadcast_to(asked, shape))
        force = (
            np.quantile(found.force_n, config.policy.observable_share, method="higher")
            if found.force_n.size
            else np.inf
        )
        strength = exerted_force(robot, place, poses, limits)
        return PlaceForce(float(force) if np.isfinite(force) else None, strength)

    return {place.name: at(place) for place in places}


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
