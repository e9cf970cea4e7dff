"""A fitted friction law as a function of velocity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.result import FrictionFit
from collaudit.core.series import FloatArray

#: Breakaway may exceed the friction at the slowest measured speed by this factor where the data cannot tell.
UNKNOWN_BREAKAWAY = 1.5


@dataclass(frozen=True, slots=True)
class FrictionModel:
    """f(v) = sgn(v)·(A + B·exp(-C·|v|) + D·|v|), eq. (11) with its odd extension.

    Attributes:
        a, b, c, d: parameters in the units of the fit; b = c = 0 for Coulomb-viscous.
        speed_range: slowest and fastest speed measured.
        breakaway_known: whether friction towards zero speed is determined.
    """

    a: float
    b: float
    c: float
    d: float
    speed_range: tuple[float, float]
    breakaway_known: bool

    @classmethod
    def of(cls, fit: FrictionFit) -> FrictionModel | None:
        """The law of a fit, or None when there is none."""
        if fit.model is None or fit.speed_range_rad_s is None:
            return None
        values = {key[0]: value for key, value in fit.parameters.items()}
        return cls(
            values["A"],
            values.get("B", 0.0),
            values.get("C", 0.0),
            values["D"],
            fit.speed_range_rad_s,
            fit.identifiable,
        )

    def torque(self, velocity: FloatArray) -> FloatArray:
        """Friction at each velocity (any shape), zero at zero velocity."""
        speed = np.abs(velocity)
        return np.asarray(np.sign(velocity) * (self.a + self.b * np.exp(-self.c * speed) + self.d * speed))

    @property
    def hold(self) -> float:
        """Largest friction of a joint at rest or presliding: breakaway, or a stated factor above the slowest."""
        slow = self.speed_range[0]
        at_slow = abs(self.a + self.b * float(np.exp(-self.c * slow)) + self.d * slow)
        if self.breakaway_known:
            return max(abs(self.a + self.b), at_slow)
        return UNKNOWN_BREAKAWAY * at_slow
