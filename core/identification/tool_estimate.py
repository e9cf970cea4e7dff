"""The tool as joint torques show it: what its body carries beyond the robot's description."""

from __future__ import annotations

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import IdentifiedTool
from collaudit.core.identification.problem.identification_problem import Solution
from collaudit.core.identification.problem.standard_errors import StandardErrors
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95, interval_95
from collaudit.core.robot.robot_model import RobotModel, point_mass_parameters


def point_mass_inertia(before: FloatArray, after: FloatArray) -> FloatArray:
    """(p,) inertia that the mass added to each body has about the joint's origin, were it one point."""
    out = np.zeros_like(before)
    for k in range(0, before.size, 10):
        mass, moment = float(after[k] - before[k]), after[k + 1 : k + 4] - before[k + 1 : k + 4]
        if mass > 1e-3:
            out[k + 4 : k + 10] = point_mass_parameters(mass, moment)[4:]
    return out


def identified_tool(
    robot: RobotModel, config: Config, before: FloatArray, solution: Solution, errors: StandardErrors
) -> IdentifiedTool:
    """Mass and centre of what the tool's body carries: the described tool and what was found on top.

    A tool and the body it is fixed to move as one: what that body's description lacks is taken for the tool.

    Args:
        robot: the arm, the described tool included.
        config: says the tool's frame and the described tool.
        before: (p,) inertials before.
        solution: inertials after.
        errors: how well they are known.
    """
    turn, place, body = robot.in_joint(config.robot.tool.frame)
    k = 10 * body
    mass, com = config.robot.tool.mass_kg, np.array(config.robot.tool.com_m)
    known = 0.0 if isinstance(mass, str) else float(mass)
    at = turn @ com + place
    total = known + float(solution.inertials[k] - before[k])
    moment = known * at + solution.inertials[k + 1 : k + 4] - before[k + 1 : k + 4]
    in_frame = turn.T @ (moment - total * place)
    rows = (np.cumsum(solution.free) - 1)[k : k + 4]
    covariance = errors.covariance[np.ix_(rows, rows)]  # of mass and first moments
    # d(moment in frame) = R^T (dh - dm p)
    jacobian = np.column_stack([-turn.T @ place, turn.T])
    sd = np.sqrt(np.maximum(np.diag(jacobian @ covariance @ jacobian.T), 0.0))
    mass_sd = float(np.sqrt(max(covariance[0, 0], 0.0)))
    x, y, z = (interval_95(value, error) for value, error in zip(in_frame, sd, strict=True))
    centre = in_frame / total if total > STANDARD_ERRORS_95 * mass_sd else None
    return IdentifiedTool(
        frame=config.robot.tool.frame or robot.frame_names[-1],
        mass_kg=total,
        mass_ci95=interval_95(total, mass_sd),
        com_m=None if centre is None else (float(centre[0]), float(centre[1]), float(centre[2])),
        moment_ci95_kg_m=(x, y, z),
    )
