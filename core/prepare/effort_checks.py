"""The effort of a log against the model's torque: gains, signs, delay, scale, changing weights; what is said of it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from collaudit.core.arm_states.arm_states import without_states
from collaudit.core.arm_states.payload_step import payload_findings
from collaudit.core.config.schema import Config
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.channel_delay import Delay, effort_shift, moved
from collaudit.core.prepare.effort_gain import EffortGain, described_gains, effort_gains, friction_signs, scale_findings
from collaudit.core.prepare.effort_kind import computed_findings, smooth_joints
from collaudit.core.prepare.prepared import ConditionedLog
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.block_sums import Slope
from collaudit.core.torque_table.log_samples import TorqueTable

#: A delay below this explains no sign, s.
_LATE_S = 0.02
#: What is said where gravity is turned round and friction is not: an inverted effort turns both.
MOUNTING_FIRST = (
    "Friction takes power with the sign as it is, so gravity looks turned over: check the mounting first, [robot] "
    "base_rpy_deg"
)


@dataclass(frozen=True, slots=True)
class EffortChecks:
    """What the effort says of itself against the model's torque; attributes as of :class:`Prepared`."""

    gains: tuple[EffortGain, ...] = ()
    delay: Delay | None = None
    upright: frozenset[str] = frozenset()
    findings: tuple[Finding, ...] = ()
    scale: tuple[Finding, ...] = ()


def effort_checks(
    start: ConditionedLog,
    series: UniformSeries,
    robot: RobotModel,
    contact: FloatArray | None,
    table: TorqueTable,
    described: TorqueTable,
    calibration: Calibration,
    config: Config,
) -> EffortChecks:
    """Gains, signs, delay and scale of a log's effort.

    Args:
        start: the log before its model torque.
        series, robot: as calibrated.
        contact: (n, j) torque of the commanded tool force, or None.
        table: of the series, with its model torque.
        described: the same with the torque of the arm as described.
        calibration: what is known of the arm.
        config: what is stated of the effort.
    """
    gains = tuple(g for g in effort_gains(table) if g.joint in start.judged)
    sensed = start.effort_kind.source == "joint"  # a sensor behind the gear sees no friction
    smooth = smooth_joints(series) if config.log.effort_kind == "auto" else ()
    friction = friction_signs(table) if smooth or not sensed else {}
    signs = {} if sensed else friction
    upright = frozenset(joint for joint, sign in signs.items() if sign.positive)
    gains = _gains_with_free_tool(gains, table, robot, upright, config)
    renamed, stated = config.log.joint_names, config.log.units.effort_sign
    signed = {name for key in stated for name in (key, renamed.get(key, key))}  # by the model's names and the log's
    findings = computed_findings(smooth, friction, start.judged)
    late = late_signs(series, robot, table, contact, gains)
    if late is not None:  # of a late effort no scale is known, and of signs that friction tells none that is inverted
        delay, undone = late
        stated_ms = config.log.effort_delay_ms if "effort_delay_ms" in config.log.given else None
        told = {joint: signs[joint] for joint in upright}
        findings += [delay_finding(delay, undone, stated_ms), *sign_findings(gains, start.judged, signed, told, undone)]
        return EffortChecks(gains, delay, upright, tuple(findings))
    findings += sign_findings(gains, start.judged, signed, signs)
    before = gains
    if described is not table:  # against the arm as described, what was identified of it left open
        lacking = () if calibration.identified is None else calibration.identified.estimate
        before = described_gains(described, start.robot, lacking, config.robot.tool.frame)
    # what was identified has taken up the scale of the log that it was fitted on
    loaded = partial(described_gains, described, start.robot, ("rotor", "tool"), config.robot.tool.frame)
    scale = scale_findings([g for g in before if g.joint in start.judged], series.effort_unit, loaded)
    return EffortChecks(gains, None, upright, tuple(findings), tuple(scale))


def _gains_with_free_tool(
    gains: tuple[EffortGain, ...],
    table: TorqueTable,
    robot: RobotModel,
    upright: frozenset[str],
    config: Config,
) -> tuple[EffortGain, ...]:
    """The gains; with rotors and a tool left open those that are inverted although friction takes power.

    A tool that is not described can outweigh a wrist as it is, and turn the torque of gravity round.
    """
    doubted = {gain.joint for gain in gains if gain.inverted and gain.joint in upright}
    if not doubted:
        return gains
    described = {g.joint: g for g in described_gains(table, robot, ("rotor", "tool"), config.robot.tool.frame)}
    return tuple(
        described[g.joint] if g.joint in doubted else g for g in gains if g.joint not in doubted or g.joint in described
    )


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
    assert series.effort is not None
    prompt = replace(series, effort=moved(series.effort, series, delay.seconds))
    undone = {g.joint for g in effort_gains(table.seen(prompt)) if not g.inverted} & inverted
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
            seen = f"runs against the model's gravity and inertia torque: {gain.said}"
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


def payload_steps(
    start: ConditionedLog,
    series: UniformSeries,
    robot: RobotModel,
    table: TorqueTable,
    described: TorqueTable,
    calibration: Calibration,
    gains: Sequence[EffortGain],
) -> tuple[Finding, ...]:
    """Weights that change, by the joints whose effort goes with the model's torque: beside others stands twice that.

    Inertials that were identified hold a part of such weights: where the effort is a torque without their calibration,
    the arm as described tells them. Arguments as of :func:`effort_checks`, and its gains.
    """
    if series.effort_unit != "Nm":
        return ()
    inverted = {gain.joint for gain in gains if gain.inverted}
    telling = [joint for joint in start.judged if joint not in inverted]
    if calibration.identified is not None and start.series.effort_unit == "Nm":
        table, robot = described.seen(without_states(start.series, series.not_driven)), start.robot
    return payload_findings(table, robot, telling)


def raw_effort_findings(series: UniformSeries) -> list[Finding]:
    """That nothing can be judged in N·m while the scale of the effort is neither stated nor identified."""
    if series.effort is None or series.effort_unit != "raw":
        return []
    text = (
        "The effort is stated not to be in N·m. A fit identifies its gain where gravity and inertia of the robot's "
        "description tell it; a joint without one is not judged."
    )
    return [Finding("effort-kind", "warning", text)]
