"""What is to be said of signs, delay and scales of the effort, by its gains against the model."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.data.identification_result import Identified
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.channel_delay import Delay, effort_shift, moved
from collaudit.core.prepare.effort_gain import ACCURATE_GAIN, PLAUSIBLE_GAIN, EffortGain, effort_gains, overlaps
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.block_sums import Slope
from collaudit.core.torque_table.thinned_log import TorqueTable

#: A delay below this explains no sign, s.
_LATE_S = 0.02
#: What is said where gravity is turned round and friction is not: an inverted effort turns both.
MOUNTING_FIRST = (
    "Friction takes power with the sign as it is, so gravity looks turned over: check the mounting first, [robot] "
    "base_rpy_deg"
)
#: The lines that tell an effort's scale.
_STATE = (
    'State what it is in [log.units]: effort = "A" or "mA" with torque_constant_nm_per_a, "percent" or "permille" with '
    'rated_torque_nm; or, of any unit, "raw", and a fit of motion without contact finds its scale.'
)
_SEVERAL = 2  # joints out of scale speak of the log's unit, one of its inertials


def late_signs(
    series: UniformSeries,
    robot: RobotModel,
    table: TorqueTable,
    contact: FloatArray | None,
    gains: Sequence[EffortGain],
) -> tuple[Delay, set[str]] | None:
    """A delay of the effort by which signs only seem inverted, and of which joints; None where none explains any.

    Args:
        series: the log.
        robot: with inertials.
        table: of it, with its model torque.
        contact: (n, j) torque of the commanded tool force, or None.
        gains: effort against both together.
    """
    inverted = {g.joint for g in gains if g.inverted}
    delay = effort_shift(series, robot, [g.joint for g in gains], contact) if inverted else None
    if not isinstance(delay, Delay) or delay.ci95[0] < _LATE_S:
        return None
    undone = {g.joint for g in gains_at(table, series, delay) if not g.inverted} & inverted
    return (delay, undone) if undone else None


def delay_finding(delay: Delay, joints: Collection[str], taken_off_ms: float | None) -> Finding:
    """That these joints' signs are those of a late effort.

    Args:
        delay: of :func:`late_signs`, with its joints.
        joints: their names.
        taken_off_ms: delay that the configuration states, and that is taken off already; None where it states none.
    """
    low, high = (1e3 * x for x in delay.ci95)
    text = (
        f"The effort is {1e3 * delay.seconds:.0f} ms behind the motion (95 %: {low:.0f} to {high:.0f} ms). As stamped "
        f"it seems to run against the model's torque on {', '.join(sorted(joints))}; with the delay taken off it does "
        f"not: no sign is inverted there. To correct it: [log] effort_delay_ms = "
        f"{(taken_off_ms or 0.0) + 1e3 * delay.seconds:.0f}. Nothing was changed."
    )
    # what is stated is no veto against itself
    return Finding("effort-delay", "error" if taken_off_ms is None else "warning", text)


def gains_at(table: TorqueTable, series: UniformSeries, delay: Delay) -> tuple[EffortGain, ...]:
    """Gains by the table of a series, whose effort has a delay taken off."""
    assert series.effort is not None
    return effort_gains(table.seen(replace(series, effort=moved(series.effort, series, delay.seconds))))


def sign_findings(
    gains: Sequence[EffortGain],
    judged: Sequence[str],
    stated: Collection[str] = (),
    friction: Mapping[str, Slope] | None = None,
    late: Collection[str] = (),
) -> list[Finding]:
    """What gravity and friction say of signs: inverted, or not to be told. Nothing is ever changed by it.

    Args:
        gains: by gravity and inertia.
        judged: joints to speak of.
        stated: joints whose sign the configuration states: that holds, and what speaks against it is a warning.
        friction: of :func:`friction_signs`; where it takes power with the sign as it is, the mounting is the likelier
            cause.
        late: joints whose sign a delay explains.
    """
    by_gravity, by_friction = {gain.joint: gain for gain in gains}, friction or {}
    findings = []
    for joint in dict.fromkeys((*by_gravity, *by_friction)):
        gain, slope = by_gravity.get(joint), by_friction.get(joint)
        then = ". If it"
        if joint in late:
            continue
        if gain is not None and gain.inverted:
            seen = f"runs against the model's gravity and inertia torque: {_numbers(gain)}"
            if slope is not None and slope.positive:
                then = f". {MOUNTING_FIRST}. If that is right and the effort"
        elif slope is not None and slope.negative and joint in judged:
            seen = (
                f"goes with the motion instead of against friction, which takes power: {slope.value:.3g} on average "
                f"over its motion, without gravity (99.9 %: {slope.value - slope.half:.3g} to "
                f"{slope.value + slope.half:.3g})"
            )
        else:
            continue
        text = f"The effort of joint '{joint}' {seen}"
        if gain is not None and gain.known and not gain.inverted:
            text += (
                ", while its gravity torque has the right sign: sign and mounting ([robot] base_rpy_deg) are both "
                "wrong, or delay, inertia or a person guiding the arm."
            )
            findings.append(Finding("friction-not-physical", "warning", text, joint=joint))
        elif joint in stated:
            text += (
                ". Its sign was taken as [log.units] effort_sign states it; look at model, mounting and joint names."
            )
            findings.append(Finding("effort-sign-inverted", "warning", text, joint=joint))
        else:
            text += f'{then} is inverted, state [log.units] effort_sign = {{ "{joint}" = -1 }}. Nothing was changed.'
            findings.append(Finding("effort-sign-inverted", "error", text, joint=joint))
    unknown = [joint for joint in judged if joint not in by_gravity or not by_gravity[joint].known]
    if unknown:
        text = (
            f"The motion does not show the sign of the effort of {', '.join(unknown)}: "
            "the model's torque varies too little against friction and noise."
        )
        findings.append(fact(text))
    return findings


def scale_findings(
    gains: Sequence[EffortGain], unit: str, loaded: Callable[[], Sequence[EffortGain]] = tuple
) -> list[Finding]:
    """Joints whose effort is not in the scale of the described model, and a log that is not. Nothing is changed by it.

    Args:
        gains: against the arm as described, by joint.
        unit: of the effort.
        loaded: the same with a load left open, which outweighs the wrists of a small arm: with the others in scale
            nothing speaks against the unit.
    """
    if unit != "Nm":
        return []
    if (scale := _other_scale(gains)) is not None:
        known = [gain for gain in loaded() if gain.known]
        if not known or any(not overlaps(gain.ci95, ACCURATE_GAIN) for gain in known):
            return [scale]
    findings = []
    largest_nm = max((gain.model_nm for gain in gains), default=0.0)
    for gain in gains:
        if gain.lacks_model() or gain.exceeds_arm(largest_nm):
            what = (
                "shows none of that torque" if gain.lacks_model() else "would take a load that outweighs the whole arm"
            )
            text = (
                f"The effort of joint '{gain.joint}' is {_numbers(gain)}: it {what}, so it is no torque in N·m, or the "
                f"masses on file are wrong. Nothing is judged by it. {_STATE}"
            )
            findings.append(Finding("effort-gain", "error", text, joint=gain.joint))
        elif gain.off:
            text = (
                f"The effort of joint '{gain.joint}' is {_numbers(gain)}: contact torques appear {gain.gain:.2g} times "
                "as large there, or the masses on file are wrong (a payload that they lack?)."
            )
            findings.append(Finding("effort-gain", "warning", text, joint=gain.joint))
    return findings


def identified_scale_findings(identified: Identified | None, joints: Collection[str], unit: str) -> list[Finding]:
    """Joints whose identified gain is none of a torque in N·m although the log's unit, or its constant, says so.

    Args:
        identified: of the friction file.
        joints: to speak of.
        unit: of the effort as logged, its constants applied.
    """
    if identified is None or "gain" not in identified.estimate or unit != "Nm":
        return []
    findings = []
    for joint, found in identified.joints.items():
        low, high = found.gain_ci95 or (None, None)
        interval = -np.inf if low is None else low, np.inf if high is None else high
        if joint not in joints or found.gain is None or overlaps(interval, ACCURATE_GAIN):
            continue
        text = (
            f"The effort of joint '{joint}' was found to be {found.gain:.3g} per N·m (95 %: {interval[0]:.3g} to "
            f"{interval[1]:.3g}), against its stated unit or constant. Its torque was taken with what was found."
        )
        findings.append(Finding("effort-gain", "warning", text, joint=joint))
    return findings


def raw_effort_findings(series: UniformSeries) -> list[Finding]:
    """That nothing can be judged in N·m while the scale of the effort is neither stated nor identified."""
    if series.effort is None or series.effort_unit != "raw":
        return []
    text = (
        "The effort is stated not to be in N·m. A fit identifies its gain where gravity and inertia of the robot's "
        "description tell it; a joint without one is not judged."
    )
    return [Finding("effort-kind", "warning", text)]


def _other_scale(gains: Sequence[EffortGain]) -> Finding | None:
    """That the log is in another unit than N·m: several joints out of scale, and most of those that tell at all."""
    known = [gain for gain in gains if gain.known or gain.lacks_model()]
    far = [gain for gain in known if gain.lacks_model() or _elsewhere(gain)]
    if len(far) < _SEVERAL or 2 * len(far) <= len(known):
        return None
    each = ", ".join(f"{g.joint} {g.gain:.3g} [{g.ci95[0]:.3g} to {g.ci95[1]:.3g}]" for g in far)
    text = (
        f"The efforts of {len(far)} of the {len(known)} joints that the model's torque loads are not in its scale, per "
        f"N·m of it (95 %): {each}. They are no torques in N·m, or the model is that of another arm, mounting or "
        f"unit of mass: nothing is judged by them. {_STATE}"
    )
    return Finding("effort-no-torque", "error", text)


def _elsewhere(gain: EffortGain) -> bool:
    """Whether it has the right sign, and surely another scale than a torque by any description."""
    low, high = gain.ci95
    return gain.gain > 0 and not overlaps(gain.ci95, PLAUSIBLE_GAIN) and high - low < gain.gain


def _numbers(gain: EffortGain) -> str:
    return f"{gain.gain:.3g} per N·m of model torque (95 %: {gain.ci95[0]:.3g} to {gain.ci95[1]:.3g})"
