"""Weighted least squares of one force at a frame from joint torques, and its uncertainty.

Directions whose singular value is small are not seen by any joint: they are left out of the fit and named.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.data.detection_result import ContactForce
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95

#: Lever arms below this (m) see a force too faintly to say anything.
_BLIND_M = 0.03


@dataclass(frozen=True, slots=True, eq=False)
class Directions:
    """Directions of a force in a frame's axes: (k, 3) those that some joint sees, and (3 - k, 3) the others."""

    seen: FloatArray
    blind: FloatArray

    @classmethod
    def of(cls, arm: FloatArray) -> Directions | None:
        """Of lever arms (joints, 3); None where nothing is seen."""
        if arm.size == 0:
            return None
        _, lengths, directions = np.linalg.svd(arm)
        if lengths[0] < _BLIND_M:
            return None
        size = np.concatenate([lengths, np.zeros(3 - lengths.size)])
        return cls(directions[size >= _BLIND_M], directions[size < _BLIND_M])


@dataclass(frozen=True, slots=True, eq=False)
class ForceFit:
    """A force at a frame by weighted least squares of its torques, over the directions that are seen.

    Attributes:
        frame: of the link.
        arm: (k, 3) lever arms of the joints that count.
        directions: of the force.
        torque: (k,) of the joints, N·m.
        weight: (k,) 1 / N·m.
        inverse: (d, k) pseudoinverse of the weighted lever arms along the directions that are seen.
        amount: (d,) of the force along them, N.
    """

    frame: str
    arm: FloatArray
    directions: Directions
    torque: FloatArray
    weight: FloatArray
    inverse: FloatArray
    amount: FloatArray

    @classmethod
    def of(cls, frame: str, arm: FloatArray, directions: Directions, torque: FloatArray, noise: FloatArray) -> ForceFit:
        """With the standard deviations (k,) of the torques, N·m."""
        weight = 1.0 / np.maximum(noise, 1e-3)
        inverse: FloatArray = np.asarray(np.linalg.pinv((arm @ directions.seen.T) * weight[:, None]), dtype=np.float64)
        # tau_e is what the drives bring up: the force on the robot is its negative.
        return cls(frame, arm, directions, torque, weight, inverse, -(inverse @ (torque * weight)))

    @property
    def force_n(self) -> FloatArray:
        """(3,) in the frame's axes."""
        return np.asarray(self.directions.seen.T @ self.amount)

    @property
    def size_n(self) -> float:
        """Of the force."""
        return float(np.linalg.norm(self.force_n))

    @property
    def misfit(self) -> float:
        """Weighted, squared, of all joints."""
        return float(np.sum(((self.torque + self.arm @ self.force_n) * self.weight) ** 2))

    def described(self, rotation: FloatArray) -> ContactForce:
        """The force with its uncertainty; ``rotation`` (3, 3) turns the frame's axes to those of the base."""
        force, seen, amount = self.force_n, self.directions.seen, self.amount
        misfit = self.torque + self.arm @ force
        spare = self.torque.size - seen.shape[0]
        inflate = max(1.0, float(np.sqrt(np.sum((misfit * self.weight) ** 2) / spare))) if spare > 0 else 1.0
        covariance = inflate**2 * (self.inverse @ self.inverse.T)
        in_base = rotation @ force
        spread = rotation @ seen.T @ covariance @ seen @ rotation.T
        blind = [rotation @ d for d in self.directions.blind]
        total = self.size_n
        along = amount / total if total > 0 else np.ones_like(amount) / np.sqrt(amount.size)
        width = STANDARD_ERRORS_95 * float(np.sqrt(along @ covariance @ along))
        hidden = [any(abs(b[axis]) > 0.5 for b in blind) for axis in range(3)]
        half = [None if hidden[i] else STANDARD_ERRORS_95 * float(np.sqrt(spread[i, i])) for i in range(3)]
        return ContactForce(
            frame=self.frame,
            force_n=(float(in_base[0]), float(in_base[1]), float(in_base[2])),
            ci95_n=(half[0], half[1], half[2]),
            size_n=total,
            size_ci95_n=(max(0.0, total - width), total + width),
            blind=tuple((float(b[0]), float(b[1]), float(b[2])) for b in blind),
            misfit_nm=float(np.sqrt(np.mean(misfit**2))),
        )
