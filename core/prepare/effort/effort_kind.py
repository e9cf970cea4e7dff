"""What the effort is: of the motor or of a sensor behind the gear, and whether the controller took gravity out of it.

A controller may publish the torque of its drives less that of gravity, by its own model of arm and payload. Regressed
on the model's gravity and on its inertial torque, with friction and an offset beside them, such an effort holds the
second and nothing of the first. A current holds both by the same factor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.prepare.effort.effort_gain import sliding_columns, slope_beside
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.vendors.joint_words import TORQUE_SENSED

EffortSource = Literal["motor", "joint"]

_MOST_ROWS = 20_000
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
    settings: LogConfig, series: UniformSeries, robot: RobotModel
) -> tuple[EffortKind, tuple[Finding, ...]]:
    """What ``[log] effort_kind`` states; for ``auto`` what the arm's name and the data say, which are findings.

    Args:
        settings: ``[log]``.
        series: the log, all joints in model order.
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
        return EffortKind(), (Finding("effort-compensated", "error", text),)
    if stated != "auto":
        source: EffortSource = "joint" if stated == "joint-torque" else "motor"
        return EffortKind(source, "stated" if stated == "gravity-compensated" else "no"), ()
    kind, findings = _by_name(robot.joint_names)
    shares = _shares(series, robot)
    if shares is None or not _without_gravity(*shares):
        return kind, findings
    (gravity, off), (inertia, spread) = shares
    text = (
        f"The effort holds the arm's inertia in motion ({inertia:.2g} ± {spread:.2g} of the model's, 95 %) and "
        f"none of its gravity ({gravity:.2g} ± {off:.2g}), at rest or in motion: the controller seems to have taken it "
        'out, or [robot] states the base or gravity wrongly. State [log] effort_kind = "gravity-compensated" if the '
        'controller does so; otherwise correct [robot], and state "motor-torque" or "joint-torque".'
    )
    return EffortKind(kind.source, "seen"), (*findings, Finding("effort-compensated", "error", text))


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


def _without_gravity(gravity: _Share, inertia: _Share) -> bool:
    least = inertia[0] - inertia[1]
    return least > _SOME and abs(gravity[0]) + gravity[1] < _NONE * min(1.0, least)


def _shares(series: UniformSeries, robot: RobotModel) -> tuple[_Share, _Share] | None:
    """How much of the model's gravity and inertial torque the effort holds, over all joints; None where untold.

    Weighted means over the joints, by their standard errors.
    """
    if series.effort is None or series.effort_unit != "Nm" or not robot.has_inertials:
        return None
    rows = np.flatnonzero(np.isfinite(series.effort).all(axis=1) & np.isfinite(series.velocity_rad_s).all(axis=1))
    rows = rows[:: max(1, rows.size // _MOST_ROWS)]
    position, velocity = series.position_rad[rows], series.velocity_rad_s[rows]
    gravity = robot.gravity_torque(position)
    moving = robot.inverse_dynamics(position, velocity, series.acceleration_rad_s2[rows]) - gravity
    found = []
    for j in range(velocity.shape[1]):
        use = (np.abs(velocity[:, j]) > MOVING_RAD_S) & np.isfinite(moving[:, j]) & np.isfinite(gravity[:, j])
        effort, v, second = series.effort[rows[use], j], velocity[use, j], np.floor(series.time_s[rows[use]])
        weight, inertia = gravity[use, j], moving[use, j]
        of_gravity = slope_beside(effort, weight, sliding_columns(v, [inertia]), second)
        of_inertia = slope_beside(effort, inertia, sliding_columns(v, [weight]), second)
        if of_gravity is not None and of_inertia is not None:
            found.append(((of_gravity.value, of_inertia.value), (of_gravity.half, of_inertia.half)))
    if not found:
        return None
    value, error = (np.array(part) for part in zip(*found, strict=True))
    error = np.maximum(error / STANDARD_ERRORS_95, 1e-9)
    weight = 1.0 / error**2
    mean = np.sum(weight * value, axis=0) / np.sum(weight, axis=0)
    # joints that differ by more than their errors say how well one number fits them all
    between = np.sum(weight * (value - mean) ** 2, axis=0) / max(1, len(found) - 1)
    half = STANDARD_ERRORS_95 * np.sqrt(np.maximum(1.0, between) / np.sum(weight, axis=0))
    return (float(mean[0]), float(half[0])), (float(mean[1]), float(half[1]))
