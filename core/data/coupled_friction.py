"""Axes that turn with several joints, as the motors of a wrist do, and what was fitted of their friction."""

from dataclasses import dataclass

Bounds = tuple[float | None, float | None]


@dataclass(frozen=True, slots=True)
class Coupling:
    """A motor that turns with more than its own joint.

    Its axis turns at s = sum of weight · joint velocity, and a torque on it acts on each joint with that weight.

    Attributes:
        joint: the joint it belongs to.
        weights: of each joint that it turns with; 1 for its own.
    """

    joint: str
    weights: dict[str, float]

    @property
    def words(self) -> str:
        """The axis as a sum of joints."""
        return " + ".join(f"'{name}'" if w == 1 else f"{w:g}·'{name}'" for name, w in self.weights.items())


@dataclass(frozen=True, slots=True)
class CoupledFriction:
    """Friction and drive inertia on a coupled axis: coulomb·sgn s + viscous·s + inertia·ds/dt.

    Attributes:
        weights: of each joint in the axis' speed s; its torque acts on each joint with the same weight.
        coulomb_nm: N·m on the motor's own joint.
        viscous_nm_s_per_rad: N·m·s/rad.
        inertia_kg_m2: of the drive, kg·m²; None where inertias were not to be identified.
        ci95: of each of these by its name, with the other terms of the joints unknown; open where none is told.
        speed_range_rad_s: slowest and fastest axis speed it was fitted on.
        samples: used.
    """

    weights: dict[str, float]
    coulomb_nm: float
    viscous_nm_s_per_rad: float
    inertia_kg_m2: float | None
    ci95: dict[str, Bounds]
    speed_range_rad_s: tuple[float, float]
    samples: int
