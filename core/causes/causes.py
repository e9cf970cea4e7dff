"""The causes of a residual that is off: each tried, the one that explains most first, with what to state."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.causes.excess import Excess, excess_of
from collaudit.core.causes.trials import Solved, solved, trials
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import Cause
from collaudit.core.data.recommendation_result import FittedThresholds
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.core.findings import Finding
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.prepare.calibration import KnownLoad
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel

#: A cause speaks where it takes away so much of the excess, and in either half of the log so much.
_SPEAKS, _EITHER_HALF = 0.6, 0.3
#: A simpler cause is preferred to one that explains so little more, and not clearly.
_NO_MORE = 0.05
#: Causes that take away less are not worth a line.
_WORTH_A_LINE = 0.1
#: A gravity that is stronger or weaker than this share of the stated one is no mounting.
_GRAVITY = 0.03
#: Efforts are in each other's place, and an arm is another, if the whole of it is, to this share.
_WHOLE = 0.3
#: A hand on the arm for the whole log. Any other cause must be told from that: to state it would hide the hand.
_PERSON = frozenset({"force", "pull"})
#: A centre of mass further from the tool's frame is no load's, m.
_REACH_M = 1.0
#: Excess in fewer blocks than this share is an event, not a cause that is there all the time.
_LASTS = 0.1


def find_causes(
    prepared: Prepared,
    run: DetectorRun,
    laws: Mapping[str, FrictionModel],
    gamma_nm: Mapping[str, float],
    fitted: FittedThresholds | None,
    config: Config,
    siblings: Iterable[tuple[str, RobotModel]] = (),
) -> tuple[Cause, ...]:
    """Causes of what a log's residual has beyond that of the fitted motion, the best first; none without such excess.

    Args:
        prepared: the log.
        run: its residual.
        laws: friction of its joints.
        gamma_nm: thresholds by joint.
        fitted: the usual residual of joints, where a friction file tells it.
        config: what is stated of tool and mounting.
        siblings: other descriptions of the arm's family, by name.
    """
    table = excess_of(prepared, run, laws, gamma_nm, fitted)
    if table is None:
        return ()
    before = table.beyond(table.residual_size)
    if float((before.max(axis=1) > 0.0).mean()) < _LASTS:
        return ()
    robot = prepared.robot
    weighed = prepared.start.effort_kind.compensated == "no" and bool(robot.gravity_base_m_s2.any())
    identified = prepared.calibration.identified
    load_sd = (None if identified is None else identified.load_sd) or (0.0,) * 4
    every = trials(table, robot, prepared.start.robot, weighed, load_sd, siblings)
    found = [solved(table, one, before) for one in every]
    least_kg = -np.inf if prepared.robot is not prepared.start.robot else -stated_kg(config)
    tried = sorted(
        (one for one in found if one is not None and _tells(one, robot, least_kg)), key=lambda one: -one.share
    )
    if not tried:
        return ()
    best = tried[0]
    alike = [one for one in tried if one.share > best.share - _NO_MORE and one.least_share > best.share - 2 * _NO_MORE]
    alike = [one for one in alike if one.trial.kind == best.trial.kind or not best.beats(one)]
    first = min(alike, key=lambda one: (one.value.size, -one.share), default=best)
    rivals = [one for one in tried if (one.trial.kind in _PERSON) != (first.trial.kind in _PERSON)]
    rival = min(rivals, key=lambda one: float(one.rest.mean()), default=None)
    if rival is not None and rival.beats(first):
        first, rival = rival, first
    unclear = rival is not None and not first.beats(rival)
    ranked = [first, *(one for one in tried if one is not first)]
    causes = [_cause(one, table, robot, config) for one in ranked if one.share >= _WORTH_A_LINE]
    # a joint whose effort cannot be judged says what is wrong; what its neighbours make of that is nobody's hand, and
    # the zeros that they have on any day are not why the log is not judged
    lacking = any(finding.effect == "not-judged-joint" for finding in prepared.findings)
    silent = lacking and first.trial.kind in (*_PERSON, "zero")
    if causes and not silent and first.share >= _SPEAKS and first.least_share >= _EITHER_HALF:
        causes[0] = replace(causes[0], speaks=True)
        if unclear and rival is not None:  # what could hide somebody is not stated
            text = f"{causes[0].text}; or {_cause(rival, table, robot, config).text}: this motion does not tell which"
            causes[0] = replace(causes[0], text=text, line="")
    return tuple(causes)


def told_load(causes: Sequence[Cause]) -> tuple[KnownLoad, Finding] | None:
    """The load that is the cause, and what is to be said of it; None where it is not, or may be a hand."""
    tool = {one.code: one for one in causes if one.speaks and one.line}.get("tool")
    if tool is None:
        return None
    mass, *first = tool.value
    text = (
        f"The log was judged with {tool.text}, which it tells itself: a hand or a cable that hangs on the tool like a "
        "weight for the whole log would not be seen."
    )
    load = KnownLoad(mass, (first[0] / mass, first[1] / mass, first[2] / mass))
    return load, Finding("load-estimated", "warning", text)


def _tells(one: Solved, robot: RobotModel, least_kg: float) -> bool:
    """Whether any of its parameters differs from none, and it can be.

    Args:
        one: the cause.
        robot: as stated.
        least_kg: a load cannot be lighter: of an arm as described the stated tool is all there is to miss, of one whose
            inertials were identified the fitted log's tool is another.
    """
    if one.trial.kind == "tool":
        mass, first = float(one.value[0]), one.value[1:]
        if mass < least_kg - one.half_width[0] or np.linalg.norm(first) > _REACH_M * abs(mass):
            return False
    if one.trial.kind == "mounting":
        size = float(np.linalg.norm(robot.gravity_base_m_s2))
        if abs(float(np.linalg.norm(robot.gravity_base_m_s2 + one.value)) / size - 1.0) > _GRAVITY:
            return False
    if one.trial.kind in ("swapped", "description") and abs(one.value[0] - 1.0) > _WHOLE:
        return False
    return bool((np.abs(one.value) > one.half_width).any())


def stated_kg(config: Config) -> float:
    """Mass of the stated tool; 0 where it is to be estimated."""
    mass = config.robot.tool.mass_kg
    return 0.0 if isinstance(mass, str) else float(mass)


def _cause(one: Solved, table: Excess, robot: RobotModel, config: Config) -> Cause:
    text, line = _WORDS[one.trial.kind](one, table, robot, config)
    low, high = one.value - one.half_width, one.value + one.half_width
    return Cause(
        code=one.trial.kind,
        joints=one.trial.joints,
        text=text,
        share=one.share,
        value=tuple(map(float, one.value)),
        ci95=tuple((float(a), float(b)) for a, b in zip(low, high, strict=True)),
        line=line,
        speaks=False,
    )


def _friction(one: Solved, table: Excess, robot: RobotModel, config: Config) -> tuple[str, str]:
    def level(k: int, joint: str) -> str:
        return f"{joint} {1.0 + one.value[k]:.2f} (± {max(float(one.half_width[k]), 0.005):.2f})"

    names = one.trial.joints or ("every joint",)
    told = ", ".join(level(k, joint) for k, joint in enumerate(names) if _off(one, k))
    return f"friction of another size than in the fitted logs, times: {told}", "collaudit fit on a clean log of today"


def _scale(one: Solved, table: Excess, robot: RobotModel, config: Config) -> tuple[str, str]:
    scales = one.value + 1.0
    names = one.trial.joints or ("every joint",)
    told = [
        f"{joint} {scale:.3g} (± {error:.2g})"
        for joint, scale, error, k in zip(names, scales, one.half_width, range(scales.size), strict=True)
        if _off(one, k)
    ]
    inverted = [joint for joint, scale in zip(names, scales, strict=True) if scale < -0.5]
    if inverted:
        listed = one.trial.joints or table.joints
        signs = ", ".join(f'"{joint}" = -1' for joint in listed if not one.trial.joints or joint in inverted)
        return f"efforts of the other sign: {', '.join(told)}", f"[log.units] effort_sign = {{ {signs} }}"
    return f"efforts of another scale, times: {', '.join(told)}", "state the unit or torque constant of these efforts"


def _zero(one: Solved, table: Excess, robot: RobotModel, config: Config) -> tuple[str, str]:
    told = []
    for k, joint in enumerate(one.trial.joints):
        if not (_off(one, 2 * k) or _off(one, 2 * k + 1)):
            continue
        zero, drift = one.value[2 * k], 2.0 * one.value[2 * k + 1]
        drifts = f", drifting by {drift:.2g} over the log" if _off(one, 2 * k + 1) else ""
        unit = "N" if joint in robot.sliding else "N·m"
        told.append(f"'{joint}' by {zero:.2g} {unit} (± {one.half_width[2 * k]:.1g}){drifts}")
    return (
        f"the zero of the torque lies elsewhere: {'; '.join(told)}",
        "tare the sensors, or fit on a clean log of today",
    )


def _delay(one: Solved, table: Excess, robot: RobotModel, config: Config) -> tuple[str, str]:
    late, error = 1e3 * one.value[0], 1e3 * one.half_width[0]
    total = config.log.effort_delay_ms + late
    return f"efforts {late:.3g} ms late (± {error:.2g} ms)", f"[log] effort_delay_ms = {total:.3g}"


def _swapped(one: Solved, table: Excess, robot: RobotModel, config: Config) -> tuple[str, str]:
    first, second = one.trial.joints
    share = one.value[0]
    text = f"efforts of '{first}' and '{second}' in each other's place (share {share:.2g} ± {one.half_width[0]:.1g})"
    return text, f"exchange the effort columns of '{first}' and '{second}'"


def _mounting(one: Solved, table: Excess, robot: RobotModel, config: Config) -> tuple[str, str]:
    before = robot.gravity_base_m_s2
    now = before + one.value
    tilt = float(np.degrees(np.arccos(np.clip(before @ now / np.linalg.norm(before) / np.linalg.norm(now), -1.0, 1.0))))
    error = float(np.degrees(one.half_width.max() / np.linalg.norm(before)))
    up = -now / np.linalg.norm(now)  # the world's z in base axes: the last row of Rz(yaw) Ry(pitch) Rx(roll)
    pitch, roll = np.degrees(np.arcsin(np.clip(-up[0], -1.0, 1.0))), np.degrees(np.arctan2(up[1], up[2]))
    axes = ", ".join(f"{x:.2f}" for x in now)
    text = f"a mounting that is {tilt:.3g}° off (± {error:.2g}°): gravity lies along ({axes}) m/s² in base axes"
    return text, f"[robot] base_rpy_deg = [{roll:.1f}, {pitch:.1f}, {config.robot.base_rpy_deg[2]:g}]"


def _tool(one: Solved, table: Excess, robot: RobotModel, config: Config) -> tuple[str, str]:
    mass, first = float(one.value[0]), one.value[1:]
    tool, stated = config.robot.tool, stated_kg(config)
    total = stated + mass
    error = float(one.half_width[0])
    known = "stated" if total > 0.0 else "in the fitted logs"
    text = f"{abs(mass):.2f} kg {'more' if mass > 0 else 'less'} at the tool than {known} (± {max(error, 0.01):.2f} kg)"
    if total <= 0.0:
        return text, "state [robot.tool] of the fitted logs and of this one, and fit again"
    com = (stated * np.array(tool.com_m) + first) / total
    place = ", ".join(f"{x:.3f}" for x in com)
    frame = robot.tool_frame
    return text, f'[robot.tool] frame = "{frame}", mass_kg = {total:.2f}, com_m = [{place}]'


def _description(one: Solved, table: Excess, robot: RobotModel, config: Config) -> tuple[str, str]:
    share = f"share {one.value[0]:.2g} ± {one.half_width[0]:.1g}"
    text = f"another arm of the family: the torques are those of {one.trial.what} ({share})"
    return text, f'[robot] urdf = "{one.trial.what}"'


def _force(one: Solved, table: Excess, robot: RobotModel, config: Config) -> tuple[str, str]:
    place = f"the link of {one.trial.joints[0]}" if one.trial.joints else "the tool"
    return f"a steady force of {_newtons(one)} on {place} that does not turn with it: someone who leans on it", ""


def _pull(one: Solved, table: Excess, robot: RobotModel, config: Config) -> tuple[str, str]:
    sensor = "" if config.log.wrench is None else ", or the zero or the load of the force sensor"
    return f"a steady force of {_newtons(one)} that turns with the tool: a hose, a cable, someone{sensor}", ""


def _newtons(one: Solved) -> str:
    error = max(float(np.linalg.norm(one.half_width)), 0.01)
    return f"{np.linalg.norm(one.value):.3g} N (± {error:.1g} N)"


def _off(one: Solved, k: int) -> bool:
    return bool(abs(one.value[k]) > one.half_width[k])


_WORDS: dict[str, Callable[[Solved, Excess, RobotModel, Config], tuple[str, str]]] = {
    "friction": _friction,
    "scale": _scale,
    "zero": _zero,
    "delay": _delay,
    "swapped": _swapped,
    "mounting": _mounting,
    "tool": _tool,
    "description": _description,
    "force": _force,
    "pull": _pull,
}
