"""An arm's kinematics, as far as a drawing of it needs them: joint after joint, and the tool."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from collaudit.core.numeric.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class ArmLink:
    """One joint of the model, which turns about the z of its own axes or slides along it.

    Attributes:
        joint: whose position moves it; None for one that is held.
        parent: number of the joint that moves this one, -1 for the base.
        prismatic: whether it slides.
        rotation: its axes at position zero in its parent's: a rotation matrix, row by row.
        translation_m: its origin there.
        factor, offset: its position is ``factor`` times that of ``joint``, plus ``offset``, rad or m.
    """

    joint: str | None
    parent: int
    prismatic: bool
    rotation: tuple[float, ...]
    translation_m: tuple[float, float, float]
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class ArmGeometry:
    """All joints, parents before children, and the tool: the joint that moves it (-1: none) and its place there, m."""

    links: tuple[ArmLink, ...]
    tool_link: int
    tool_m: tuple[float, float, float]


def arm_at(arm: ArmGeometry, position: Mapping[str, float]) -> tuple[FloatArray, FloatArray]:
    """Where the joints and the tool are: the product of one rotation and one translation a joint.

    Args:
        arm: its kinematics.
        position: of each joint, rad or m.

    Returns:
        (k + 1, 3) origins of the k joints and of the tool in the base, m; (k, 3) directions of the joints' axes.
    """
    turns, origins = [np.eye(3)], [np.zeros(3)]  # the base first
    for link in arm.links:
        q = link.offset + (0.0 if link.joint is None else link.factor * position[link.joint])
        turn = turns[link.parent + 1] @ np.reshape(link.rotation, (3, 3))
        origin = origins[link.parent + 1] + turns[link.parent + 1] @ link.translation_m
        c, s = (1.0, 0.0) if link.prismatic else (np.cos(q), np.sin(q))
        origins.append(origin + (q * turn[:, 2] if link.prismatic else 0.0))
        turns.append(turn @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))
    tool = origins[arm.tool_link + 1] + turns[arm.tool_link + 1] @ arm.tool_m
    return np.array([*origins[1:], tool]), np.array([turn[:, 2] for turn in turns[1:]])
