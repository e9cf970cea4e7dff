"""Message profiles: which fields of which types are joint signals or a wrench. Data, not code."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Role = Literal["joint_states", "wrench"]


@dataclass(frozen=True, slots=True)
class Profile:
    """How to read one family of message types.

    Field paths are dotted. A path may end in ``[*]`` for a sequence of messages of which one field is meant
    (``joints[*].position``).

    Attributes:
        name: what ``inspect`` calls it.
        role: ``joint_states`` or ``wrench``.
        types: the message types it reads.
        stamp: path of the header's stamp, or None.
        names: path of the joint names, or None where the type has none.
        position, velocity, effort: paths of (j,) numbers.
        wrench: paths of the six numbers, force then torque.
    """

    name: str
    role: Role
    types: tuple[str, ...]
    stamp: str | None = "header.stamp"
    names: str | None = None
    position: str | None = None
    velocity: str | None = None
    effort: str | None = None
    wrench: tuple[str, ...] = ()

    def quantities(self) -> dict[str, str]:
        """Quantity to field path, of those the profile has."""
        pairs = (("position", self.position), ("velocity", self.velocity), ("effort", self.effort))
        return {key: path for key, path in pairs if path is not None}


def _wrench_paths(prefix: str) -> tuple[str, ...]:
    return tuple(f"{prefix}{part}.{axis}" for part in ("force", "torque") for axis in "xyz")


PROFILES: tuple[Profile, ...] = (
    Profile(
        name="joint-state",
        role="joint_states",
        types=("sensor_msgs/msg/JointState",),
        names="name",
        position="position",
        velocity="velocity",
        effort="effort",
    ),
    Profile(
        name="wrench-stamped",
        role="wrench",
        types=("geometry_msgs/msg/WrenchStamped",),
        wrench=_wrench_paths("wrench."),
    ),
    Profile(
        name="wrench",
        role="wrench",
        types=("geometry_msgs/msg/Wrench",),
        stamp=None,
        wrench=_wrench_paths(""),
    ),
)

_BY_TYPE = {kind: profile for profile in PROFILES for kind in profile.types}


def profile_of(type_name: str) -> Profile | None:
    """The profile that reads a message type, or None."""
    return _BY_TYPE.get(type_name)
