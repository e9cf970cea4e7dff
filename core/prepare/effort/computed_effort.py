"""Efforts that a controller computes: without a sensor's noise, and without the friction that every drive has."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.channel_noise import bend_of, noise_of
from collaudit.core.torque_table.block_sums import Slope


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
