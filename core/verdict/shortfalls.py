"""Where less would have been noticed than the policy asks for: on the arm, and on its joints."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from collaudit.core.config.schema_judging import PUSH_S, PolicyConfig
from collaudit.core.data.audit_result import Coverage, RuleFacts
from collaudit.core.data.identification_result import EstimateChoice
from collaudit.core.data.sensitivity_result import (
    TOOL,
    JointSensitivity,
    Sensitivity,
    asked_places,
    force_text,
    place_text,
    time_text,
    too_insensitive,
)
from collaudit.core.data.signals import State, reason_text
from collaudit.core.detection.detector_run import DetectionInputs
from collaudit.core.findings import Finding, text_in_joint_units, torque_unit_of
from collaudit.core.numeric.arrays import lowest_in_row
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.verdict.coverage import seconds_text, too_much_lost
from collaudit.core.verdict.sensitivity import BRIEF_S

#: What makes an arm more sensitive, and what to state where it need not be.
_REMEDY = (
    'What lowers it: the payload in [robot.tool], [fit] estimate = ["friction", "inertials"], more motion in the fit, '
    "a lower gamma_nm where one is stated. If that force may go unnoticed, state it: [policy] observable_n."
)
#: A better fit is worth saying where it leaves at most this share.
_WORTH = 0.9


def shortfalls(
    policy: PolicyConfig,
    coverage: Coverage,
    sensitivity: Sensitivity,
    inputs: DetectionInputs,
    sliding: Collection[str] = (),
    choice: EstimateChoice | None = None,
) -> tuple[Finding, ...]:
    """Findings on what the arm lacks, then each watched joint: a noticed force or torque, motion that tells anything.

    Args:
        policy: what is asked.
        coverage: seconds by joint and reason.
        sensitivity: of the watched joints and of the arm.
        inputs: the rule; of joints that a finding forbids judging that says all there is to say.
        sliding: names of the prismatic joints.
        choice: what the fit identified, and what would have left less.
    """
    if not sensitivity.push_alarms:
        short = (
            f"A push of {PUSH_S:g} s cannot alarm, however hard it is: the rule asks for {inputs.rule.n} samples in a "
            f"row, {1e3 * inputs.rule.persistence_s:.4g} ms. Shorten [detect] persistence_ms or n, or log faster."
        )
        return (_finding(short),)
    out = []
    lost, too_much = _lost_s(coverage), too_much_lost(coverage, policy.min_coverage)  # which says it for every joint
    for joint, s in sensitivity.joints.items():
        if joint in inputs.not_judged:
            continue
        not_judged_s = coverage.joints[joint].not_judged_s | lost
        text = None if too_much else _undetermined(policy, joint, s, not_judged_s)
        text = text or _unnoticed(policy, joint, s, not_judged_s)
        if text is not None:
            out.append(_finding(text_in_joint_units(text, joint, sliding), joint))
    if inputs.not_judged:
        return tuple(out)
    arm = _of_arm(policy, sensitivity, inputs.rule, sliding, choice) or (
        None if out or too_much else _lost(sensitivity, coverage)
    )
    return (*out,) if arm is None else (_finding(arm), *out)


def unstated_force(prepared: Prepared, sensitivity: Sensitivity, n: int) -> tuple[Finding, ...]:
    """A finding where the tool met what must alarm there, and all of it was taken as intended.

    The residual tells nothing of a force that is taken off it. Below what is asked for the sensor itself shows that no
    such push was there.

    Args:
        prepared: the log.
        sensitivity: what is asked for at the tool.
        n: samples in a row that an alarm takes.
    """
    force_n = prepared.commanded.unstated_n
    asked = [need.force_n for force, need in asked_places(sensitivity) if force.kind == TOOL]
    if force_n is None or not asked:
        return ()
    lasting = np.nan_to_num(lowest_in_row(force_n, n))
    if not lasting.size or lasting.max() < min(asked):
        return ()
    text = (
        f"The tool met {lasting.max():.3g} N at {prepared.series.time_s[int(np.argmax(lasting))]:.4g} s, by the wrist "
        f"sensor, and nothing says that it was meant to: a push of {min(asked):.3g} N there must be noticed. State in "
        '[phases] when contact is intended, or force_limit_n; find = "wrench" judges what is not usual.'
    )
    return (_finding(text),)


def _finding(text: str, joint: str | None = None) -> Finding:
    return Finding("coverage-low", "warning", text, joint=joint)


def _of_arm(
    policy: PolicyConfig,
    sensitivity: Sensitivity,
    rule: RuleFacts,
    sliding: Collection[str],
    choice: EstimateChoice | None,
) -> str | None:
    """What force goes unnoticed that must not."""
    asked, time = asked_places(sensitivity), sensitivity.time
    if not asked or time is None:
        return _nothing_asked(sensitivity)
    short = too_insensitive(sensitivity)
    if short:
        forces = [
            f"{force_text(force.at(time.share))} at {place_text(force)}, {need.force_n:.3g} N asked"
            for force, need in short
        ]
        first, joint = next(
            ((one, need.limited_by) for one, need in short if need.limited_by is not None), (None, None)
        )
        limit = (
            ""
            if joint is None
            else f"; limited by {joint} (γ {rule.gamma_nm[joint]:.3g} {torque_unit_of(joint, sliding)})"
        )
        lower = "" if first is None else _lower(first.at(time.share), joint, choice)
        return f"Too insensitive: {'; '.join(forces)}; {time_text(time)}{limit}{lower}. {_REMEDY}"
    long = [(force, need) for force, need in asked if need.longest_unnoticed_s > policy.max_hidden_s]
    if long:
        force, need = long[0]
        return (
            f"A push of {need.force_n:.3g} N at {place_text(force)} would have gone unnoticed for "
            f"{seconds_text(need.longest_unnoticed_s)} without a break (policy: at most "
            f"{seconds_text(policy.max_hidden_s)})."
        )
    return None


def _lower(force_n: float | None, joint: str | None, choice: EstimateChoice | None) -> str:
    """What force a better fit would leave: thresholds go with what it leaves of the joint that limits."""
    share = None if choice is None or joint is None else choice.gain_of(joint)
    if choice is None or share is None or force_n is None or share > _WORTH:
        return ""
    return f'; [fit] estimate = "auto" ({choice.better}) would bring it to about {force_text(share * force_n)}'


def _lost(sensitivity: Sensitivity, coverage: Coverage) -> str | None:
    """That in too much of the time no force at all would have alarmed, though no joint lacks that much."""
    time, lost = sensitivity.time, _lost_s(coverage)
    short = [(force, need) for force, need in asked_places(sensitivity) if time is not None and need.share < time.share]
    if not short or time is None:
        return None
    for cover in coverage.joints.values():
        lost |= {code: max(lost.get(code, 0.0), seconds) for code, seconds in cover.not_judged_s.items()}
    force, need = short[0]
    return (
        f"A push of {need.force_n:.3g} N at {place_text(force)} would have been noticed in {100 * need.share:.3g} % of "
        f"the time{' the arm moved' if time.moving else ''} (policy: at least {100 * time.share:g} %){_reasons(lost)}."
    )


def _nothing_asked(sensitivity: Sensitivity) -> str | None:
    """Why no force can be asked for; None where a torque is asked for on every watched joint in its place."""
    if all(s.asked is not None for s in sensitivity.joints.values()):
        return None
    why = "no watched joint feels a force there" if sensitivity.forces else "no description says where the links are"
    return (
        f"What force at the tool or the forearm would have alarmed cannot be told: {why}. State the torque that must "
        "alarm on each watched joint: [policy] observable_nm."
    )


def _lost_s(coverage: Coverage) -> dict[str, float]:
    """Time that is lost for every joint, whichever of them lacks a value, by reason."""
    lost = {State.GAP.code: coverage.gaps_s, State.NOT_A_NUMBER.code: coverage.missing_s}
    return {reason: seconds for reason, seconds in lost.items() if seconds > 0}


def _undetermined(
    policy: PolicyConfig, joint: str, s: JointSensitivity, not_judged_s: Mapping[str, float]
) -> str | None:
    lost_s = s.motion_s - s.told_s
    if s.told_s >= policy.min_coverage * s.motion_s or lost_s < BRIEF_S:
        return None
    return (
        f"Joint '{joint}': only {100 * s.told_s / s.motion_s:.3g} % of {seconds_text(s.motion_s)} of motion, gaps "
        f"included, could be judged (policy: at least {100 * policy.min_coverage:g} %){_reasons(not_judged_s)}."
    )


def _unnoticed(policy: PolicyConfig, joint: str, s: JointSensitivity, not_judged_s: Mapping[str, float]) -> str | None:
    """A torque that the configuration asks for and that would not have alarmed for long enough."""
    asked = s.asked
    if asked is None:
        return None
    missed_s = s.motion_s * (1.0 - asked.share)
    if asked.share < policy.observable_share and missed_s >= BRIEF_S:
        return (
            f"Joint '{joint}': a torque of {asked.torque_nm:.3g} N·m would have alarmed in {100 * asked.share:.3g} % "
            f"of its {seconds_text(s.motion_s)} of motion (policy: at least {100 * policy.observable_share:g} %)"
            f"{_up_to(s)}{_reasons(not_judged_s)}."
        )
    if asked.longest_unnoticed_s > policy.max_hidden_s:
        return (
            f"Joint '{joint}' could hide {asked.torque_nm:.3g} N·m for {seconds_text(asked.longest_unnoticed_s)} "
            f"without a break (policy: at most {seconds_text(policy.max_hidden_s)}){_up_to(s)}."
        )
    return None


def _up_to(s: JointSensitivity) -> str:
    return "" if s.largest_nm is None else f"; at times it takes {s.largest_nm:.3g} N·m"


def _reasons(not_judged_s: Mapping[str, float]) -> str:
    worst = sorted(not_judged_s.items(), key=lambda item: -item[1])[:2]
    return f" ({', '.join(f'{reason_text(code)}, {seconds_text(value)}' for code, value in worst)})" if worst else ""
