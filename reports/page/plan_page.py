"""The page of a plan: what it is, the moving arm, sweeps, what it should tell, clean hours, limits."""

from __future__ import annotations

import numpy as np

from collaudit.core.plan.planning import Plan
from collaudit.reports.page.environment import environment
from collaudit.reports.plots.arm_pose import moving_arm, positions_over_time
from collaudit.reports.sections.plan_sections import plan_sections

_FRAMES = 240


def plan_page(plan: Plan) -> str:
    """The page as text, without scripts; the same plan gives the same bytes."""
    file, bodies = plan.file, plan.robot.bodies
    assert bodies is not None
    t, q, _, _ = plan.motion.sampled(plan.motion.duration_s / _FRAMES)
    frames = [*bodies.joint_names, bodies.frame_names[-1]]
    points = np.array([np.vstack([np.zeros(3), plan.robot.frame_positions(pose, frames)]) for pose in q])
    return (
        environment()
        .get_template("plan.html.j2")
        .render(
            plan=file,
            sections=plan_sections(file),
            arm=moving_arm(points, plan.motion.duration_s),
            joints=[(name, positions_over_time(t, q[:, j], file.limits[name], f"joint-{j}"))
                    for j, name in enumerate(plan.robot.joint_names)],
        )
    )  # fmt: skip
