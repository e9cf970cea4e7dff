"""One joint as a robot description states it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from collaudit.core.data.joint_log import JointType


@dataclass(frozen=True, slots=True)
class JointFacts:
    """One joint as described.

    Attributes:
        name: joint name.
        kind: revolute (also for URDF's continuous) or prismatic.
        link: the link it moves.
        lower, upper: position limits, rad or m; NaN where there are none.
        effort_limit: N·m or N; NaN where there is none.
        leader: the joint it mimics, or None.
        multiplier, offset: position = multiplier · leader + offset.
        speed_limit: rad/s or m/s; NaN where there is none.
        parent: the link it hangs on, of a URDF.
    """

    name: str
    kind: JointType
    link: str
    lower: float = math.nan
    upper: float = math.nan
    effort_limit: float = math.nan
    leader: str | None = None
    multiplier: float = 1.0
    offset: float = 0.0
    speed_limit: float = math.nan
    parent: str = ""
