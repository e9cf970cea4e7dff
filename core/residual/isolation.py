"""Which columns of a residual are judged apart, and the joint that an alarm in one of them is named after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from collaudit.core.numeric.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class EachJoint:
    """One residual a joint: every column is judged, and names its joint.

    Attributes:
        isolates: a joint's residual stands for torque at that joint.
        joint_names: the judged joints.
    """

    isolates: ClassVar[bool] = True
    joint_names: tuple[str, ...]

    def judged_columns(self, watched: Sequence[int], gamma_nm: Mapping[str, float]) -> list[int]:
        """All that are watched; ``gamma_nm`` has the threshold of each joint."""
        return list(watched)

    def joint_of(self, column: int, sample: int) -> str:
        """The column's joint."""
        return self.joint_names[column]


@dataclass(frozen=True, slots=True, eq=False)
class WholeArm:
    """One residual of the whole arm, in every column in that joint's scale: detection without isolation.

    Attributes:
        isolates: no joint's residual stands for torque at that joint.
        joint_names: the judged joints.
        scale_nm: (j,) what stands for one unit of the arm's residual in each column.
        shown: (n, j) what each joint shows of a contact.
        look: samples from the onset in which that is looked at.
    """

    isolates: ClassVar[bool] = False
    joint_names: tuple[str, ...]
    scale_nm: FloatArray
    shown: FloatArray
    look: int = 1

    def judged_columns(self, watched: Sequence[int], gamma_nm: Mapping[str, float]) -> list[int]:
        """One column, that of the lowest threshold in its scale: at it, each joint alone alarms."""
        return sorted(watched, key=lambda j: gamma_nm[self.joint_names[j]] / self.scale_nm[j])[:1]

    def joint_of(self, column: int, sample: int) -> str:
        """The joint that shows most after the onset."""
        part = self.shown[sample : sample + self.look]
        return self.joint_names[int(np.nanargmax(np.abs(part).max(axis=0)))]


Isolation = EachJoint | WholeArm
