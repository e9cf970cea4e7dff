"""A torque that depends on one joint's angle alone: a spring, a counterbalance, a cable."""

from dataclasses import dataclass

import numpy as np

from collaudit.core.numeric.arrays import FloatArray

#: Polynomials in the angle, from degree 1 on: a constant is the offset.
DEGREE = 4
#: What lies this share of the range beyond the angles seen is still known.
_BEYOND = 0.05


def scaled_angle(angle_rad: FloatArray, low_rad: float, high_rad: float) -> FloatArray:
    """Angles from -1 to 1 over a range."""
    return np.asarray((2.0 * angle_rad - low_rad - high_rad) / (high_rad - low_rad))


@dataclass(frozen=True, slots=True)
class AngleTorque:
    """Torque over the angle, as what it is at five angles; the polynomial of degree four through them between.

    Attributes:
        angle_rad: (5,) evenly over the angles seen.
        torque_nm: (5,) there, N·m (N if prismatic), its mean over the motion left to the offset.
        ci95_nm: (5,) their intervals; None where they were not asked for.
    """

    angle_rad: tuple[float, ...]
    torque_nm: tuple[float, ...]
    ci95_nm: tuple[tuple[float, float], ...] | None = None

    def at(self, angle_rad: FloatArray) -> FloatArray:
        """(n,) torque at (n,) angles, N·m; NaN beyond those seen."""
        ends = self.angle_rad[0], self.angle_rad[-1]
        nodes = scaled_angle(np.array(self.angle_rad), *ends)
        x = scaled_angle(angle_rad, *ends)
        through = np.polynomial.legendre.legfit(nodes, np.array(self.torque_nm), DEGREE)
        out = np.polynomial.legendre.legval(np.clip(x, -1.0, 1.0), through)
        return np.asarray(np.where(np.abs(x) <= 1.0 + 2.0 * _BEYOND, out, np.nan))
