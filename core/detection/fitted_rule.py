"""``gamma_nm = "auto"`` and ``"sharpest"``: where thresholds stand, by the friction file and what must be noticed."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from math import inf, sqrt

import numpy as np

from collaudit.core.config.schema import Config, PolicyConfig
from collaudit.core.data.audit_result import Collision, RuleFacts
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.data.recommendation_result import (
    FittedThresholds,
    JointThreshold,
    MotionLevels,
    PlaceForce,
    ThresholdLevel,
)
from collaudit.core.detection.rule_settings import stated_persistence
from collaudit.core.findings import Finding, fact
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.prepare.quiet_level import QuietLevel
from collaudit.core.robot.arm_places import required_force

#: A joint that stays within this cannot be judged for want of motion; the others can. rad (m of a prismatic joint)
_HARDLY = 0.05
#: Rounding of a persistence that is stated in ms and counted in samples.
_SLACK = 1e-3
_HOUR_S = 3600.0
#: A joint's residual above its own threshold in the fitted logs is said from so much time on, s: more than one block.
_EXCEEDED_S = 0.4
#: Thresholds of two fits of one robot differ by less than this, unless something changed.
_RISEN = 2.0
#: An automatic threshold is at most so many times the motion's level.
_MOST_TIMES = 2.0
#: What is asked must be noticed with so much to spare.
_SPARE = 2.0
#: Digits of a threshold that a person can type.
_DIGITS = 3


def with_fitted_thresholds(
    config: Config, thresholds: FittedThresholds | None, still: Mapping[str, QuietLevel], series: UniformSeries
) -> tuple[Config, MotionLevels, list[Finding]]:
    """The configuration with numbers in place of "auto", and what motion does by itself; unchanged without "auto".

    A joint without a level on file gets none: it is not judged, and an error says so.

    Args:
        config: as given.
        thresholds: of the friction file; None without a file.
        still: joints that are judged for changes of their torque: their thresholds come from this log.
        series: the judged joints.
    """
    if not isinstance(config.detect.gamma_nm, str):
        return config, MotionLevels(), []
    gamma = {joint: typed(level.gamma_nm) for joint, level in still.items()}
    findings: list[Finding] = []
    usable, why = usable_thresholds(thresholds, config)
    stated = {} if usable is None else usable.joints
    n, _ = stated_persistence(config.detect, series.period_s)
    motion = MotionLevels()
    used: dict[str, ThresholdLevel] = {}
    for joint in series.joint_names:
        known = stated.get(joint)
        level = None if known is None else level_at(known, n, n * series.period_s)
        if level is None or known is None:
            continue
        if joint in still:
            motion.beyond_nm[joint] = level.gamma_nm + known.rest_nm
        else:
            used[joint] = level
            motion.level_nm[joint], motion.at_rest_nm[joint] = typed(level.gamma_nm), known.rest_nm
            motion.known[joint] = known
    times: float | None = None
    if config.detect.gamma_nm == "sharpest":
        gamma |= {joint: typed(level.fitted_nm) for joint, level in used.items()}
    elif usable is not None:
        times = times_motion(motion.level_nm, usable.forces, config.policy)
        gamma |= {joint: typed(times * level) for joint, level in motion.level_nm.items()}
    for joint in series.joint_names:
        if joint not in gamma:
            known = stated.get(joint)
            reason = why or (known.reason if known is not None else None) or "the friction file has no threshold for it"
            position = series.position_rad[:, series.column(joint)]
            travel_rad = float(np.ptp(position[np.isfinite(position)])) if np.isfinite(position).any() else 0.0
            if used and travel_rad < _HARDLY:
                text = f"Joint '{joint}' is not judged: it hardly moves ({travel_rad:.2g} rad in all), and {reason}."
                findings.append(Finding("rule-unfit", "warning", text, joint=joint))
            else:
                text = f"Joint '{joint}' is not judged: gamma_nm = \"{config.detect.gamma_nm}\", and {reason}."
                findings.append(Finding("rule-unfit", "error", text, joint=joint))
    if usable is not None and used:
        findings.append(_source(usable, used, gamma, times))
        # where γ stands above all that the fitted motion reached, that raises no alarm
        passed = [j for j, level in used.items() if level.highest_nm is None or level.highest_nm > gamma[j]]
        findings += exceeded_findings(usable, passed)
    changes: dict[str, object] = {"gamma_nm": gamma}
    if config.detect.short_persistence:  # which goes with automatic thresholds
        changes["n"] = n
    return config.changed({"detect": config.detect.changed(changes)}), motion, findings


def times_motion(level_nm: Mapping[str, float], forces: Mapping[str, PlaceForce], policy: PolicyConfig) -> float:
    """How many times the motion's level an automatic threshold is: the geometric middle of the room there is.

    From the motion's level up to what notices with a factor of ``_SPARE`` to spare what the policy asks for; at most
    ``_MOST_TIMES``, and 1 where there is no room.

    Args:
        level_nm: of the motion, by joint.
        forces: by place, that alarm at these levels.
        policy: the force or torque that must be noticed.
    """
    stated = policy.observable_nm
    by_joint = stated if isinstance(stated, dict) else dict.fromkeys(level_nm, stated)
    torques = {joint: torque for joint, torque in by_joint.items() if torque is not None and joint in level_nm}
    room = [torque / level_nm[joint] for joint, torque in torques.items()]
    if policy.observable_n or len(torques) < len(level_nm):
        for place, force in forces.items():
            needed = required_force(policy, place, force.exerted_n)
            if needed is not None and force.level_n is not None:
                room.append(needed.force_n / force.level_n)
    return in_room(min(room, default=inf))


def in_room(room: float) -> float:
    """How many times the motion's level, by how many times what is asked for is what alarms at that level."""
    return float(np.clip(sqrt(room / _SPARE), 1.0, _MOST_TIMES))


def typed(torque_nm: float) -> float:
    """A number that a person can type."""
    return float(f"{torque_nm:.{_DIGITS}g}")


def usable_thresholds(
    thresholds: FittedThresholds | None, config: Config
) -> tuple[FittedThresholds | None, str | None]:
    """Thresholds for the configured detector, or why there are none."""
    if thresholds is None:
        return None, "there is no friction file with thresholds (collaudit fit writes them)"
    name, causal = config.detect.detector, config.detect.causal
    if (thresholds.detector, thresholds.causal) == (name, causal):
        return thresholds, None
    form = "causal" if causal else "offline"
    return None, f"the friction file's thresholds are of another detector than {name}, {form}: fit again with this one"


def level_at(known: JointThreshold, n: int, lasting_s: float) -> ThresholdLevel | None:
    """The threshold of the longest persistence on file that is no longer than the rule's, in samples and in time.

    A threshold for a shorter persistence is higher, so it is safe for a longer one. A rule that is shorter than
    everything on file, as at a higher sample rate, gets the highest threshold.
    """
    fitting = [x for x in known.levels if x.n <= n and x.persistence_s <= (1.0 + _SLACK) * lasting_s]
    if fitting:
        return min(fitting, key=lambda x: x.gamma_nm)
    return max(known.levels, key=lambda x: x.gamma_nm, default=None)


def _source(
    thresholds: FittedThresholds, used: Mapping[str, ThresholdLevel], gamma_nm: Mapping[str, float], times: float | None
) -> Finding:
    """What the thresholds stand on; ``times`` the motion's level, None for what the fitted motion itself reaches."""
    known = [thresholds.joints[joint] for joint in used]
    held = min(joint.held_out for joint in known)
    in_sample = "" if held > 0.5 else " For a joint or more the fit was not held out, so they may be too low."
    listed = ", ".join(f"{joint} {gamma_nm[joint]:.3g} ({used[joint].gamma_nm:.3g})" for joint in used)
    rate = sum(level.false_alarms_per_hour for level in used.values())
    low, high = (sum(level.false_alarms_ci95[k] for level in used.values()) for k in range(2))
    hours = min(one.hours for one in known)
    minutes = f"{60.0 * hours:.3g} min" if _HOUR_S * hours >= 120.0 else f"{_HOUR_S * hours:.3g} s"
    told_from = f"{hours:.3g} h" if hours >= 2.0 else minutes
    stand = (
        "at what the fitted motion reaches, without the margin for other days (with it in brackets)"
        if times is None
        else f"{times:.2g} times what motion does by itself (in brackets)"
    )
    text = (
        f"Thresholds, {stand}, N·m: {listed}. It was told from "
        f"{told_from} of motion that the fit had not seen, and is passed "
        f"{rate:.2g} times an hour there ({low:.2g} to {high:.2g}, 95 %), its margin not counted.{in_sample}"
    )
    return fact(text)


def exceeded_findings(thresholds: FittedThresholds, joints: Collection[str]) -> list[Finding]:
    """That a joint's residual passes its own threshold in the motion of the fit, which nobody stated to be contact."""
    out = []
    for joint, known in thresholds.joints.items():
        share = max((level.exceeded for level in known.levels), default=0.0)
        seconds = _HOUR_S * known.hours * share
        if joint in joints and seconds >= _EXCEEDED_S:
            most = max(level.highest_nm or 0.0 for level in known.levels)
            up_to = f", up to {most:.3g}" if most else ""
            text = (
                f"In {100.0 * share:.2g} % of its motion in the fitted logs ({seconds:.2g} s) the residual of joint "
                f"'{joint}' passes the threshold that the rest of it tells{up_to}: contact that was not recognised, or "
                "motion that its law does not explain. If nothing touched the arm, other logs will alarm alike."
            )
            out.append(Finding("fit-exceeded", "warning", text, joint=joint))
    return out


def rise_findings(now: FittedThresholds | None, earlier: FittedThresholds | None) -> list[Finding]:
    """Joints of which the thresholds are several times those of an earlier fit of the same robot."""
    if now is None or earlier is None:
        return []
    risen = []
    for joint, one in now.joints.items():
        before = earlier.joints.get(joint)
        if before is None or not before.levels or not one.levels:
            continue
        new, old = (level_at(x, one.levels[0].n, one.levels[0].persistence_s) for x in (one, before))
        if new is not None and old is not None and new.gamma_nm > _RISEN * old.gamma_nm:
            risen.append(f"{joint} {old.gamma_nm:.3g} to {new.gamma_nm:.3g}")
    if not risen:
        return []
    text = (
        f"Thresholds are more than {_RISEN:g} times those of the friction file that this fit replaces, N·m: "
        f"{', '.join(risen)}. The arm, its effort or the log has changed."
    )
    return [Finding("fit-exceeded", "warning", text)]


def with_rest_thresholds(config: Config, levels: Mapping[str, QuietLevel], joints: Sequence[str]) -> Config:
    """The configuration with their thresholds, N·m, where it states none; unchanged where it does.

    Args:
        config: as given.
        levels: of the joints judged for changes.
        joints: all judged joints; those without a level keep what is configured for all.
    """
    detect = config.detect
    if not levels or ("gamma_nm" in detect.given and not detect.automatic):
        return config
    if detect.automatic and len(levels) < len(joints):
        return config
    common = detect.gamma_nm if isinstance(detect.gamma_nm, float) else 0.0
    gamma = {joint: levels[joint].gamma_nm if joint in levels else common for joint in joints}
    return config.changed({"detect": detect.changed({"gamma_nm": gamma})})


def change_findings(
    prepared: Prepared,
    levels: Mapping[str, QuietLevel],
    with_law: Collection[str],
    gamma_nm: Mapping[str, float],
) -> list[Finding]:
    """That joints were judged for changes, and what that cannot see.

    Args:
        prepared: the log.
        levels: of the joints judged so.
        with_law: joints of which torque beyond what friction can hold counts as well.
        gamma_nm: thresholds that were applied.
    """
    if not levels:
        return []
    known = levels.keys() <= set(with_law)
    some = next(iter(levels.values()))
    offsets = ", ".join(f"{joint} {float(np.nanmedian(one.level_nm)):.3g}" for joint, one in levels.items())
    held = "" if prepared.effort_source == "joint" else ", nor one that the friction of the gears holds"
    text = (
        f"The arm never moves{'' if known else ' and friction is not known'}: joints were judged for changes of torque "
        f"against their own quiet level (estimated from {some.quiet_s:.3g} s without a touch)"
        f"{', and for torque beyond what friction holds' if known else ''}. A load that stays constant for "
        f"{some.stretch_s:.3g} s cannot be seen{held}. Constant difference from the model, N·m: {offsets}."
    )
    findings = [fact(text) if known else Finding("judged-for-changes", "warning", text)]
    for joint, one in levels.items():
        if gamma_nm.get(joint, np.inf) < one.gamma_nm:
            text = (
                f"The threshold of joint '{joint}', {gamma_nm[joint]:.3g} N·m, is below {one.gamma_nm:.3g} N·m: what "
                "its torque does by itself at rest, with a margin."
            )
            findings.append(Finding("gamma-too-tight", "warning", text, joint=joint))
    return findings


def tight_threshold_findings(
    rule: RuleFacts,
    thresholds: FittedThresholds | None,
    config: Config,
    alarms: Sequence[Collision],
) -> list[Finding]:
    """Joints whose stated threshold the residual of the fitted logs exceeds, without contact.

    Args:
        rule: thresholds and persistence as applied.
        thresholds: of the friction file; None without a file, or of an older one.
        config: the detector whose residual is judged.
        alarms: of the log.
    """
    usable, _ = usable_thresholds(thresholds, config)
    if usable is None:
        return []
    out = []
    for joint, gamma in rule.gamma_nm.items():
        known = usable.joints.get(joint)
        level = None if known is None else level_at(known, rule.n, rule.persistence_s)
        if known is None or level is None or gamma >= level.gamma_nm / level.margin:
            continue
        own = [abs(alarm.peak_nm) for alarm in alarms if alarm.joint == joint]
        text = (
            f"The threshold of joint '{joint}', {gamma:.3g} N·m, is below what the fit's held-out residual reaches "
            f"without contact: for {1e3 * rule.persistence_s:.3g} ms it asks for {level.gamma_nm:.3g} N·m"
        )
        if known.rms_nm is not None:
            text += f" (its RMS is {known.rms_nm:.3g} N·m)"
        text += (
            ". Likely causes are a spring, cable or payload that the model lacks, or friction that is off: find the "
            "cause before a higher threshold is set"
        )
        if own:
            below = sum(peak < level.gamma_nm for peak in own)
            text += f"; {below} of this joint's {len(own)} alarms in this log stay below that"
        out.append(Finding("gamma-too-tight", "warning", text + ".", joint=joint))
    return out
