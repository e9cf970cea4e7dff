"""What the effort is: of the motor or of a sensor behind the gear, with gravity or without, with which sign.

A controller may publish the torque of its drives less that of gravity, by its own model of arm and payload. Regressed
on the model's gravity and on its inertial torque, with friction and an offset beside them, such an effort holds the
second and nothing of the first. A current holds both by the same factor.

An effort without a sensor's noise, and without the friction that every drive has, is computed by a controller.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import MOVING_RAD_S, UniformSeries
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.stats import STANDARD_ERRORS_95, bend_of, noise_of
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.block_sums import Slope
from collaudit.core.torque_table.log_samples import SLIDING, TorqueTable
from collaudit.core.vendors.vendor_words import TORQUE_SENSED

EffortSource = Literal["motor", "joint"]

#: Gravity's share is none when it is surely less than so much of the model's, and of the inertia's share, which is
#: surely more than that.
_NONE, _SOME = 0.3, 0.3


@dataclass(frozen=True, slots=True)
class EffortKind:
    """What is known of an effort.

    Attributes:
        source: on which side of the gears it is measured.
        compensated: whether gravity is not in it: by the configuration, or by the data, which is a question.
    """

    source: EffortSource = "motor"
    compensated: Literal["no", "stated", "seen"] = "no"


def effort_kind(
    settings: LogConfig, table: TorqueTable | None, robot: RobotModel
) -> tuple[EffortKind, tuple[Finding, ...]]:
    """What ``[log] effort_kind`` states; for ``auto`` what the arm's name and the data say, which are findings.

    Args:
        settings: ``[log]``.
        table: the log, all joints in model order, efforts in N·m; None where they are not.
        robot: the model as described.

    Returns:
        The kind. ``motor`` is the careful choice: a resting joint's friction may then hide torque.
    """
    stated = settings.effort_kind
    if stated == "external":
        text = (
            "The effort is stated to be an estimate of external torque: it holds neither gravity nor friction that "
            "could be compared with the model. Read the measured torque or current in its place."
        )
        return EffortKind(), (Finding("effort-no-torque", "error", text),)
    if stated != "auto":
        source: EffortSource = "joint" if stated == "joint-torque" else "motor"
        return EffortKind(source, "stated" if stated == "gravity-compensated" else "no"), ()
    kind, findings = _by_name(robot.joint_names)
    shares = _shares(table, robot)
    if shares is None:
        return kind, findings
    (gravity, off), (inertia, spread) = shares
    if inertia - spread <= _SOME or abs(gravity) + off >= _NONE * min(1.0, inertia - spread):
        return kind, findings
    text = (
        f"The effort holds the arm's inertia in motion ({inertia:.2g} ± {spread:.2g} of the model's, 95 %) and "
        f"none of its gravity ({gravity:.2g} ± {off:.2g}), at rest or in motion: the controller seems to have taken it "
        'out, or [robot] states the base or gravity wrongly. State [log] effort_kind = "gravity-compensated" if the '
        'controller does so; otherwise correct [robot], and state "motor-torque" or "joint-torque".'
    )
    return EffortKind(kind.source, "seen"), (*findings, Finding("effort-no-torque", "error", text))


def _by_name(joints: Sequence[str]) -> tuple[EffortKind, tuple[Finding, ...]]:
    named = [joint for joint in joints if TORQUE_SENSED.search(joint)]
    if not named or 2 * len(named) <= len(joints):
        return EffortKind(), ()
    text = (
        f"The effort was taken to be that of torque sensors behind the gears, as arms with joints called '{named[0]}' "
        "have them: little friction hides external torque at rest. If it is a motor's torque or current, state "
        '[log] effort_kind = "motor-torque".'
    )
    return EffortKind("joint"), (fact(text),)


_Share = tuple[float, float]  # value and half of its 95 % interval


def _shares(table: TorqueTable | None, robot: RobotModel) -> tuple[_Share, _Share] | None:
    """How much of the model's gravity and inertial torque the effort holds, over all joints; None where not known."""
    if table is None or not robot.has_inertials:
        return None
    gravity = robot.gravity_torque(table.motion[0])
    sums = table.sums(gravity=gravity, inertia=robot.inverse_dynamics(*table.motion) - gravity).values()
    of_gravity = [one.slope("effort", "gravity", *SLIDING, "inertia") for one in sums]
    of_inertia = [one.slope("effort", "inertia", *SLIDING, "gravity") for one in sums]
    both = [(a, b) for a, b in zip(of_gravity, of_inertia, strict=True) if a is not None and b is not None]
    return (_mean([a for a, _ in both]), _mean([b for _, b in both])) if both else None


def _mean(slopes: Sequence[Slope]) -> _Share:
    """Of joints, weighted by their errors; that they differ by more than those says how well one number fits them."""
    value, half = (np.array(x) for x in zip(*((slope.value, slope.half) for slope in slopes), strict=True))
    weight = np.maximum(half, 1e-9) ** -2.0
    mean = float(np.sum(weight * value) / np.sum(weight))
    apart = STANDARD_ERRORS_95**2 * float(np.sum(weight * (value - mean) ** 2)) / max(1, value.size - 1)
    return mean, float(np.sqrt(max(1.0, apart) / np.sum(weight)))


#: A magnitude comes down to this share of its largest value where the torque changes its sign.
_SHARE_NEAR_ZERO = 0.05
#: Samples in which a joint moves each way, and joints that do.
_MOVING_SAMPLES, _TURNING_JOINTS = 50, 2


def magnitude_findings(series: UniformSeries) -> tuple[Finding, ...]:
    """That no effort ever changes its sign though the joints turn both ways: it is a magnitude, its sign lost.

    Friction changes the sign of a small torque with the motion. One that gravity keeps on one side stays away from 0.
    """
    if series.effort is None:
        return ()
    turning, signed = [], False
    for j, name in enumerate(series.joint_names):
        speed, size = series.velocity_rad_s[:, j], series.effort[:, j]
        size = size[np.isfinite(size)]
        ways = min(np.count_nonzero(speed > MOVING_RAD_S), np.count_nonzero(speed < -MOVING_RAD_S))
        if ways < _MOVING_SAMPLES or not size.any():
            continue
        turning.append(name)
        one_sided = size.min() >= 0.0 or size.max() <= 0.0
        signed = signed or not one_sided or bool(np.abs(size).min() > _SHARE_NEAR_ZERO * np.abs(size).max())
    if signed or len(turning) < _TURNING_JOINTS:
        return ()
    text = (
        f"The effort of {', '.join(turning)} never changes its sign, though the joints move both ways: it is a "
        "magnitude, and its sign is lost. No [log.units] effort_sign brings it back, and nothing is judged. Record the "
        "effort with its sign."
    )
    return (Finding("effort-no-torque", "error", text),)


def smooth_joints(series: UniformSeries) -> frozenset[str]:
    """Moving joints whose effort has less than a sensor's noise: it was computed, or filtered very much.

    Args:
        series: the log, its effort as logged.
    """
    return (
        frozenset()
        if series.effort is None
        else frozenset(filter(lambda joint: _smooth(series, joint), series.joint_names))
    )


def _smooth(series: UniformSeries, joint: str) -> bool:
    j = series.column(joint)
    assert series.effort is not None, "asked for joints with efforts"
    x = np.ascontiguousarray(series.effort[:, j])
    moving = np.abs(series.velocity_rad_s[:, j]) > MOVING_RAD_S
    if not moving.any() or not np.isfinite(x[moving]).any():
        return False
    noise = noise_of(x, bend_of(x), moving)
    return noise.range > 0.0 and not noise.measured


def computed_findings(smooth: Collection[str], friction: Mapping[str, Slope], judged: Collection[str]) -> list[Finding]:
    """That the efforts are a model's, where all joints that would show friction have none, and no noise.

    Args:
        smooth: joints of :func:`smooth_joints`.
        friction: mean torque along the motion, of the joints that tell it.
        judged: joints to speak of.
    """
    telling = {joint: slope for joint, slope in friction.items() if joint in judged}
    if not telling or not set(telling) <= set(smooth) or any(slope.positive for slope in telling.values()):
        return []
    most = max(abs(slope.value) + slope.half for slope in telling.values())
    text = (
        f"The efforts of {', '.join(telling)} have no noise (a millionth of their range or less) and no friction "
        f"(at most {most:.2g} along the motion): they look computed from a model, and no contact shows in these. If "
        'they were measured, state [log] effort_kind = "motor-torque" (or "joint-torque" or "motor-current").'
    )
    return [Finding("effort-no-torque", "error", text)]
