"""Sweeps that ignore what earlier logs tell, D-optimal and as long as the plan's, beside the plan's: half widths.

Not simulated: information of the law as it is found in the end, with the noise that the plan reckons with.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.plan import sweeps as sw
from collaudit.core.plan.friction_design import FrictionDesign, friction_design
from collaudit.core.plan.moves import MoveCheck
from collaudit.core.plan.planning import Plan
from collaudit.fixtures.simulated_robot import FixtureRobot


def uninformed_ratios(
    check: MoveCheck, arm: FixtureRobot, before: FrictionFile, plan: Plan, together: bool = False
) -> dict[str, list[float]]:
    """Half widths after uninformed sweeps over those of the plan, of every joint that was open, by symbol.

    Args:
        check: limits of the arm.
        arm: its true friction.
        before: what earlier logs told; both kinds of sweeps are added to it.
        plan: the plan; the uninformed sweeps take as long, every joint as long as any other.
        together: whether the uninformed sweeps are of all joints at once, too; else one joint at a time, as is usual.
    """
    names = plan.robot.joint_names
    every = {one.joint: one for one in plan.file.sweeps}
    seconds = max(one.end_s for one in plan.file.sweeps) / (1 if together else len(names))
    out: dict[str, list[float]] = {symbol: [] for symbol in "ABCD"}
    for j, name in enumerate(names):
        fit, truth = before.joints[name], arm.friction[j].parameters()
        if fit.identifiable or truth is None:
            continue
        design = _of_truth(fit, truth, float(check.limits.torque[j]))
        mine = design.half_widths(_added(design, every[name].speeds_rad_s if name in every else ()), 1)
        naive = design.half_widths(_added(design, _d_optimal(check, j, fit, seconds)), 1)
        for symbol in out:
            out[symbol].append(naive[symbol] / mine[symbol])
    return out


def _of_truth(fit: FrictionFit, truth: dict[str, float], torque_nm: float) -> FrictionDesign:
    """What the earlier points tell of the true law."""
    return friction_design(replace(fit, model="static-lugre", parameters=truth, identifiable=True), torque_nm, 1.0)


def _added(design: FrictionDesign, speeds: tuple[float, ...]) -> FloatArray:
    return sum((design.information(v, sw.useful_s(sw.level_s(v))) for v in speeds), np.zeros_like(design.known))


def _d_optimal(check: MoveCheck, joint: int, fit: FrictionFit, seconds: float) -> tuple[float, ...]:
    """Speeds of a joint of which nothing is known but the noise: det of the information rises most for the time."""
    sweeps = sw.nothing_swept(check, {}, joint)
    noise = friction_design(fit, 1.0, 1.0)
    sweeps = replace(sweeps, design=replace(sweeps.design, noise=noise.noise, beyond=noise.beyond))
    grid = sw.speed_grid(check, sweeps)
    size = np.array([list(values.values()) for values in sweeps.design.guesses])
    rows = grid.gradients * size[:, None, :]
    information = 1e-9 * np.tile(np.eye(size.shape[1]), (len(size), 1, 1))
    chosen: list[float] = []
    while seconds > 0.0:
        gain = np.log1p(np.einsum("gnp,gpq,gnq->gn", rows, np.linalg.inv(information), rows)).mean(axis=0)
        k = int(np.argmax(gain / grid.cost))
        information += rows[:, k, :, None] * rows[:, k, None, :]
        seconds -= float(grid.cost[k])
        chosen.append(float(grid.speed[k]))
    return tuple(chosen)
