"""Small analytic logs for tests of the core: motions and torques in closed form, no simulator."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from origins import log_source

from collaudit.core.data.joint_log import JointLog

PERIOD = 0.002


def make_log(
    time_s: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray | None,
    effort: np.ndarray | None,
    names: Sequence[str] = ("joint1",),
    unit: str = "Nm",
) -> JointLog:
    return JointLog(
        time_s=time_s,
        joint_names=tuple(names),
        position_rad=position,
        velocity_rad_s=velocity,
        effort=effort,
        effort_unit="raw" if unit == "raw" else "Nm",
        wrench=None,
        source=log_source("synthetic", time_s, position, effort),
    )


def strokes(speeds: Sequence[float], travel: float = 0.5, acceleration: float = 4.0) -> tuple[np.ndarray, np.ndarray]:
    """Back and forth over [-travel, travel] with trapezoidal velocity, one cycle a speed: position and velocity."""
    pieces = []
    for v in speeds:
        ramp = np.arange(0, v, acceleration * PERIOD)
        cruise = np.full(round((2 * travel - v**2 / acceleration) / v / PERIOD), v)
        up = np.concatenate([ramp, cruise, ramp[::-1]])
        pieces += [up, np.zeros(100), -up, np.zeros(100)]
    velocity = np.concatenate(pieces)
    position = -travel + np.concatenate(([0.0], np.cumsum(velocity)[:-1])) * PERIOD
    return position, velocity


def lugre(v: np.ndarray, a: float, b: float, c: float, d: float) -> np.ndarray:
    return np.asarray(np.sign(v) * (a + b * np.exp(-c * np.abs(v)) + d * np.abs(v)))
