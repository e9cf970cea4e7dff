"""A robot's constants as the recursions want them: every joint about or along the z of its own axes."""

from __future__ import annotations

from dataclasses import dataclass

from collaudit.core.numeric.arrays import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """A joint and the body it moves.

    Attributes:
        parent: number of the joint that moves this one, -1 for the base.
        prismatic: whether it slides along z; else it turns about z.
        rotation, translation: (3, 3), (3,) m: pose of its axes at position zero in its parent's.
        mass_kg: of the body.
        first_kg_m: (3,) mass times centre of mass, in the joint's axes.
        inertia: (3, 3) kg·m² about the joint's origin.
        armature: reflected rotor inertia, kg·m² or kg.
    """

    parent: int
    prismatic: bool
    rotation: FloatArray
    translation: FloatArray
    mass_kg: float
    first_kg_m: FloatArray
    inertia: FloatArray
    armature: float


@dataclass(frozen=True, slots=True, eq=False)
class FramePlacement:
    """A frame: the number of the joint that moves it (-1: none), and its (3, 3), (3,) pose in that joint's axes."""

    link: int
    rotation: FloatArray
    translation: FloatArray
