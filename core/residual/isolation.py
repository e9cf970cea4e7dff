"""Which columns of a residual are judged apart, and the joint that an alarm in one of them is named after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from collaudit.core.data.uniform_series import UniformSeries


class Isolation(Protocol):
    """What a residual tells of the place of a contact."""

    @property
    def isolates(self) -> bool:
        """Whether a joint's residual stands for torque at that joint."""

    def judged_columns(self, watched: Sequence[int], gamma_nm: Mapping[str, float]) -> list[int]:
        """Columns to judge, of the watched ones; ``gamma_nm`` has the threshold of each joint."""

    def joint_of(self, column: int, sample: int) -> str:
        """The joint that an event which begins at this sample of this column is named after."""


@dataclass(frozen=True, slots=True)
class EachJoint:
    """One residual a joint: every column is judged, and names its joint.

    Attributes:
        joint_names: the judged joints.
    """

    joint_names: tuple[str, ...]

    @property
    def isolates(self) -> bool:
        """Yes."""
        return True

    def judged_columns(self, watched: Sequence[int], gamma_nm: Mapping[str, float]) -> list[int]:
        """All that are watched."""
        return list(watched)

    def joint_of(self, column: int, sample: int) -> str:
        """The column's joint."""
        return self.joint_names[column]


@dataclass(frozen=True, slots=True, eq=False)
class WholeArm:
    """One residual of the whole arm, the same in every column: detection without isolation.

    Attributes:
        series: the judged joints.
    """

    series: UniformSeries

    @property
    def isolates(self) -> bool:
        """No."""
        return False

    def judged_columns(self, watched: Sequence[int], gamma_nm: Mapping[str, float]) -> list[int]:
        """One column, that of the lowest threshold."""
        return sorted(watched, key=lambda j: gamma_nm[self.series.joint_names[j]])[:1]

    def joint_of(self, column: int, sample: int) -> str:
        """The joint that moves fastest."""
        return self.series.joint_names[int(np.nanargmax(np.abs(self.series.velocity_rad_s[sample])))]
