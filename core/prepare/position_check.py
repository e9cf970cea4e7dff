"""Do positions look like radians? Checked against the joint limits and against what an arm can do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.robot_model import RobotModel

#: No arm's joint turns further than two turns either way from its zero; degrees pass this at once.
_TWO_TURNS_RAD = 4.0 * np.pi
#: Beyond a joint limit by this much is no calibration error, rad. (A limit within two turns proves nothing: the
#: UR3's last wrist turns on past its URDF's.)
_BEYOND_LIMIT_RAD = 1.0
#: Moves of less than this on every joint, while efforts say otherwise, look like degrees taken for radians twice.
_TINY_RAD = 0.06
_DEGREE = np.pi / 180.0


def position_findings(position: FloatArray, joints: Sequence[str], robot: RobotModel, stated: str) -> list[Finding]:
    """Joints whose positions cannot be radians, or cannot have been degrees.

    Args:
        position: (n, j) rad (m if prismatic), after conversion from the stated unit.
        joints: j names, a part of the robot's.
        robot: kinds and limits of the joints.
        stated: the unit the configuration states, ``rad`` or ``deg``.
    """
    turning = [j for j, name in enumerate(joints) if robot.joint_types[robot.joint_names.index(name)] == "revolute"]
    if not turning or not any(np.isfinite(position[:, j]).any() for j in turning):
        return []
    if stated == "deg":
        return _too_small(position[:, turning])
    out = []
    for j in turning:
        reach = max(float(np.nanmax(position[:, j], initial=0.0)), -float(np.nanmin(position[:, j], initial=0.0)))
        low, high = robot.position_limits[robot.joint_names.index(joints[j])]
        limit = max(_TWO_TURNS_RAD, np.nan_to_num(max(abs(low), abs(high)), posinf=0.0) + _BEYOND_LIMIT_RAD)
        if reach > limit:
            out.append(
                Finding(
                    "log-position-unit-suspect",
                    "error",
                    f"Joint '{joints[j]}' reaches {reach:.4g} rad, where at most {limit:.4g} is plausible: degrees? "
                    'Then say so in [log.units]: position = "deg". Nothing was converted, and nothing is judged.',
                    joint=joints[j],
                )
            )
    return out


def _too_small(position: FloatArray) -> list[Finding]:
    """Positions stated in degrees that would be an ordinary motion had they been radians."""
    span = float(np.nanmax(np.nanmax(position, axis=0) - np.nanmin(position, axis=0)))
    if not 0.01 * _DEGREE < span < _TINY_RAD:
        return []
    text = (
        f"No joint moves by more than {span / _DEGREE:.3g} degrees in the whole log as stated; taken as radians it "
        f'would be {span / _DEGREE:.3g} rad. If they are radians, say so in [log.units]: position = "rad". Nothing was '
        "converted, and nothing is judged."
    )
    return [Finding("log-position-unit-suspect", "error", text)]
