"""The page of a plan: what it is, limits, sweeps, the moving arm, what it should tell, clean hours."""

from __future__ import annotations

import numpy as np

from collaudit.core.plan.planning import Plan
from collaudit.reports.page.environment import environment
from collaudit.reports.plots.moving_arm import moving_arm, positions_over_time
from collaudit.reports.values import plan_rows as rows

_FRAMES = 240


def plan_page(plan: Plan) -> str:
    """The page as text, without scripts; the same plan gives the same bytes."""
    file, bodies = plan.file, plan.robot.bodies
    assert bodies is not None
    t, q, _, _ = plan.motion.sampled(plan.motion.duration_s / _FRAMES)
    frames = [*bodies.joint_names, bodies.frame_names[-1]]
    points = np.array([np.vstack([np.zeros(3), plan.robot.frame_positions(pose, frames)]) for pose in q])
    tables = [
        ("Sweeps", rows.SWEEP_HEAD, rows.sweep_rows(file), "One joint at a time; every speed both ways."),
        (
            "What it should tell", rows.PREDICTION_HEAD, rows.prediction_rows([p for p in file.predictions if p.joint]),
            rows.PREDICTION_NOTE,
        ),
        ("Clean hours", *rows.clean_table(file), rows.clean_words(file)),
        ("Limits", rows.LIMIT_HEAD, rows.limit_rows(file), "Hard: no part of the motion passes one."),
    ]  # fmt: skip
    arm = rows.prediction_rows([p for p in file.predictions if not p.joint])
    notes = [
        ("Taken for granted, not stated", file.assumed),
        ("Surroundings", file.surroundings),
        ("Links with a shape of the description", file.shapes),
        ("Links as capsules", [f"{joint}: radius {1e3 * r:.0f} mm" for joint, r in file.capsules_m.items()]),
        ("Not kept apart, being neighbours or nearly so", file.unchecked),
        ("Not planned or not predicted", file.missing),
    ]
    return (
        environment()
        .get_template("plan.html.j2")
        .render(
            plan=file,
            tables=tables,
            inertials=(rows.PREDICTION_HEAD, arm),
            notes=[(title, lines) for title, lines in notes if lines],
            arm=moving_arm(points, plan.motion.duration_s),
            joints=[(name, positions_over_time(t, q[:, j], file.limits[name], f"joint-{j}"))
                    for j, name in enumerate(plan.robot.joint_names)],
        )
    )  # fmt: skip
