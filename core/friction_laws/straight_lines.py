"""The straight line of speed: Coulomb and viscous friction."""

from __future__ import annotations

import numpy as np

from collaudit.core.friction_laws.friction_law import Parameter, SeparableLaw, plain
from collaudit.core.numeric.arrays import FloatArray


def _line(v: FloatArray, _c: float | FloatArray) -> tuple[FloatArray, ...]:
    return np.ones_like(v), v


_NAMED, _NATURAL = plain("A", "D")

COULOMB_VISCOUS = SeparableLaw(
    name="coulomb-viscous",
    title="Coulomb and viscous",
    formula="f(v) = A + D·v",
    parameters=(Parameter("A", "friction", "level of the line"), Parameter("D", "viscous", "slope of the line")),
    shape=_line,
    named=_NAMED,
    natural=_NATURAL,
)
