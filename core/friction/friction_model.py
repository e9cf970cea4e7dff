"""A fitted friction law as a function of velocity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.friction.friction_laws import law_curve
from collaudit.core.friction.temperature_model import TemperatureModel
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.blocks import SAMPLES, blocks

#: Breakaway may exceed the friction at the slowest measured speed by this factor where the data cannot tell.
UNKNOWN_BREAKAWAY = 1.5
_STANDSTILL = 1e-9
#: Laws whose value towards zero speed is breakaway, once their parameters are determined.
_WITH_BREAKAWAY = ("static-lugre", "stribeck-tustin", "stribeck-gauss")


@dataclass(frozen=True, slots=True)
class FrictionModel:
    """f(v) = sgn(v)·curve(|v|) of any law in :mod:`laws`.

    Attributes:
        name: of the law.
        values: parameters by symbol, in the units of the fit.
        speed_range: slowest and fastest speed measured.
        breakaway_known: whether friction towards zero speed is determined.
        warmth: how friction goes with the joint's temperature, where that is to be used.
    """

    name: str
    values: Mapping[str, float]
    speed_range: tuple[float, float]
    breakaway_known: bool
    warmth: TemperatureModel | None = None

    @classmethod
    def of(cls, fit: FrictionFit) -> FrictionModel | None:
        """The law of a fit, or None when there is none."""
        if fit.model is None or fit.speed_range_rad_s is None:
            return None
        values = {key.partition("_")[0]: value for key, value in fit.parameters.items()}
        return cls(fit.model, values, fit.speed_range_rad_s, fit.identifiable and fit.model in _WITH_BREAKAWAY)

    def torque(self, velocity: FloatArray) -> FloatArray:
        """Friction at each velocity (any shape), zero at zero velocity."""
        if velocity.ndim != 1 or velocity.size <= SAMPLES:
            return self._torque(velocity)
        out = np.empty(velocity.shape)
        for block in blocks(velocity.size):
            out[block] = self._torque(velocity[block])
        return out

    def _torque(self, velocity: FloatArray) -> FloatArray:
        direction = np.sign(velocity)
        speed = np.maximum(np.abs(velocity), _STANDSTILL)
        return np.asarray(direction * law_curve(self.name, self.values, speed, direction))

    @property
    def hold(self) -> float:
        """Largest friction of a joint at rest or presliding: breakaway, or a stated factor above the slowest."""
        slow = self.speed_range[0]
        ends = np.array([_STANDSTILL, slow, -_STANDSTILL, -slow])
        towards_zero, at_slow = np.max(np.abs(self.torque(ends)).reshape(2, 2), axis=0)
        if self.breakaway_known:
            return float(max(towards_zero, at_slow))
        return UNKNOWN_BREAKAWAY * float(at_slow)
