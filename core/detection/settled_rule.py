"""What a log is judged with before anything of it is: numbers in place of "auto", the rule, what its detector needs.

A log of which each part is judged by a fit that has not seen it has one rule all the same: the lowest threshold of its
parts. Where the other parts of the log ask for more, the threshold in force is raised.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.arm_states.hand_guiding import Friction
from collaudit.core.config.schema import Config
from collaudit.core.data.recommendation_result import FittedThresholds, MotionLevels
from collaudit.core.detection.detector_run import DetectionInputs, Settled
from collaudit.core.detection.fitted_rule import with_fitted_thresholds, with_rest_thresholds
from collaudit.core.detection.rule_settings import make_rule
from collaudit.core.findings import fact, joints_not_judged
from collaudit.core.friction.applied_friction import AppliedFriction
from collaudit.core.identification.contact_mask import find_contact
from collaudit.core.numeric.arrays import BoolArray
from collaudit.core.prepare.guided_stretches import with_effort_smoothing, without_guiding
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.followed_offsets import BOUND_SHARE


def settled(
    prepared: Prepared,
    applied: AppliedFriction,
    config: Config,
    thresholds: FittedThresholds | None,
    rows: BoolArray | None = None,
) -> Settled:
    """What one fit gives; arguments and errors as of :func:`judge`, ``rows`` (n,) of a part that it has not seen."""
    friction = {joint: law.torque for joint, law in applied.laws.items()}
    prepared = _with_smoothing(without_guiding(prepared, friction, config), friction, config)
    series = prepared.judged_series
    config = with_rest_thresholds(config, applied.quiet, series.joint_names)
    automatic = config.detect.automatic
    config, motion, choices = with_fitted_thresholds(config, thresholds, applied.quiet, series)
    rule, watch = make_rule(series, prepared.phases, config, motion)
    gamma_nm, beyond_nm = rule.gamma_nm, motion.beyond_nm if automatic else rule.gamma_nm
    quiet = {
        joint: replace(level, gamma_nm=gamma_nm[joint], beyond_nm=beyond_nm.get(joint, np.inf))
        for joint, level in applied.quiet.items()
        if joint in gamma_nm
    }
    inputs = DetectionInputs(
        applied.laws,
        joints_not_judged((*prepared.findings, *choices), prepared.judged),
        rule,
        watch,
        quiet=quiet,
        covered=motion.known,
        zero_bound_nm={joint: BOUND_SHARE * gamma_nm[joint] for joint in rule.motion_nm},
    )
    return Settled(prepared, config, tuple(choices), inputs, rows)


def with_common_rule(whole: Settled, parts: Sequence[Settled]) -> Settled:
    """The log with the rule that its parts have in common; as it is without parts.

    A joint that one part cannot judge is not judged in any.

    Args:
        whole: by the fit of all of it.
        parts: by the fit of each part's rest.
    """
    if not parts:
        return whole
    prepared = whole.prepared
    gamma_nm = [part.inputs.rule.gamma_nm for part in parts]
    motion = MotionLevels(
        _lowest([part.inputs.rule.motion_nm for part in parts]),
        _lowest([part.inputs.rule.at_rest_nm for part in parts]),
    )
    config = whole.config.changed({"detect": whole.config.detect.changed({"gamma_nm": _lowest(gamma_nm)})})
    rule, watch = make_rule(prepared.judged_series, prepared.phases, config, motion)
    said = {(one.code, one.joint): one for part in parts for one in part.choices if one.severity != "info"}
    ranges = (f"{joint} {low:.3g} to {max(one[joint] for one in gamma_nm):.3g}" for joint, low in rule.gamma_nm.items())
    text = f"Thresholds of the {len(parts)} parts of the log, each told from the others, N·m: {', '.join(ranges)}."
    choices = (*said.values(), fact(text))
    found = [finding for part in parts for finding in part.prepared.findings]
    inputs = replace(
        whole.inputs,
        rule=rule,
        watch=watch,
        not_judged=joints_not_judged((*prepared.findings, *found, *choices), prepared.judged),
    )
    return Settled(prepared, config, choices, inputs)


def _lowest(parts: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """By joint the least number, of joints that all parts know."""
    return {joint: min(part[joint] for part in parts) for joint in parts[0] if all(joint in part for part in parts)}


def _with_smoothing(prepared: Prepared, friction: Mapping[str, Friction], config: Config) -> Prepared:
    """How far efforts are smoothed, beside contact: a controller that yields to it looks like a filter there."""
    whole = with_effort_smoothing(prepared, friction)
    if not any(one.shown for one in whole.effort_smoothing.values()):
        return whole
    contact, facts = find_contact(prepared)
    beside = with_effort_smoothing(prepared, friction, contact)
    return whole if facts.refused or not beside.effort_smoothing else beside
