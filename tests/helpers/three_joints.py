"""A three-joint arm and smooth motion of it whose torque is known in closed form."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from arms import dh_robot, dh_row
from origins import log_source

from collaudit.core.config.schema import Config
from collaudit.core.data.joint_log import JointLog
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.robot.robot_model import RobotModel

NAMES = ("joint1", "joint2", "joint3")
COULOMB, VISCOUS = np.array([6.0, 5.0, 3.0]), np.array([8.0, 6.0, 4.0])
ARMATURE = np.array([0.8, 0.8, 0.4])


def tables(scale: float = 1.0, **extra: object) -> dict[str, Any]:
    """The settings of :func:`settings` as they stand in a file."""
    rows = [
        dh_row(6.0, (0, 0.02, 0), (0.05, 0.05, 0.05), d=0.3, a=0.05, alpha=-np.pi / 2),
        dh_row(5.0 * scale, (-0.15 * scale, 0, 0.02), (0.02, 0.06, 0.06), a=0.35),
        dh_row(3.0 / scale, (-0.12, 0.01, 0), (0.01, 0.03, 0.03), a=0.30),
    ]
    robot = dh_robot(rows, armature_kg_m2=[0.8, 0.8, 0.4])
    tool = extra.pop("tool", None)
    if tool:
        robot["tool"] = tool
    return {"robot": robot, **extra}


def settings(scale: float = 1.0, **extra: object) -> Config:
    """A three-joint arm; ``scale`` is how far its description is off, in masses and centres."""
    return Config.of(tables(scale, **extra))


def arm(config: Config) -> RobotModel:
    return build_robot(config.robot, Path(), NAMES)


def sines(rng: np.random.Generator, t: np.ndarray, joints: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and acceleration (n, j) of smooth motion: three sines a joint, of phases at random."""
    q, v, a = (np.zeros((t.size, joints)) for _ in range(3))
    for j in range(joints):
        for w, size in ((0.5 + 0.13 * j, 0.7), (1.3 + 0.2 * j, 0.35), (2.9 + 0.3 * j, 0.1)):
            p = rng.uniform(0, 2 * np.pi)
            q[:, j] += size * np.sin(w * t + p)
            v[:, j] += size * w * np.cos(w * t + p)
            a[:, j] -= size * w**2 * np.sin(w * t + p)
    return q, v, a


def log_of(truth: RobotModel, gain: np.ndarray, seed: int = 0, seconds: float = 60.0, unit: str = "Nm") -> JointLog:
    """Smooth motion of all joints; the torque in closed form, friction, offset, coloured and white noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, seconds, 0.008)
    q, v, a = sines(rng, t, 3)
    torque = truth.inverse_dynamics(q, v, a) + COULOMB * np.sign(v) + VISCOUS * v + np.array([0.5, -0.3, 0.2])
    slow = np.cumsum(rng.standard_normal(torque.shape), axis=0)
    slow = np.apply_along_axis(lambda x: x - np.convolve(x, np.ones(125) / 125, "same"), 0, slow)
    torque += 0.3 * rng.standard_normal(torque.shape) + 0.3 * slow / slow.std()
    source = log_source()
    return JointLog(t, NAMES, q, v, torque * gain, "raw" if unit == "raw" else "Nm", None, source)
