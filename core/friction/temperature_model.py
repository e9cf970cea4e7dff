"""The temperature model: friction as a share of its law over the joint's temperature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.numeric.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class TemperatureModel:
    """A straight line over the temperatures it was fitted on, held at its ends beyond them.

    Attributes:
        per_kelvin: share of friction a kelvin.
        per_kelvin_sd: its standard error.
        at_c: mean temperature of the fit, °C.
        level: what friction was off its law there, as a share.
        range_c: temperatures of the fit, °C.
    """

    per_kelvin: float
    per_kelvin_sd: float
    at_c: float
    level: float
    range_c: tuple[float, float]

    def share(self, temperature_c: FloatArray) -> FloatArray:
        """(n,) friction as a share of its law at (n,) temperatures; what is missing lies between its neighbours."""
        return np.asarray(1.0 + self.level + self.per_kelvin * (self._held(temperature_c) - self.at_c))

    def doubt(self, temperature_c: FloatArray) -> float:
        """The largest standard error that the line's slope leaves in the shares."""
        return self.per_kelvin_sd * float(np.max(np.abs(self._held(temperature_c) - self.at_c), initial=0.0))

    def _held(self, temperature_c: FloatArray) -> FloatArray:
        known = np.flatnonzero(np.isfinite(temperature_c))
        values = temperature_c
        if known.size < temperature_c.size:
            values = np.interp(np.arange(temperature_c.size), known, temperature_c[known])
        return np.clip(values, *self.range_c)
