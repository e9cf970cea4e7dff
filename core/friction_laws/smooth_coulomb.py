"""Coulomb friction that rises smoothly from zero speed."""

from __future__ import annotations

import numpy as np

from collaudit.core.friction_laws.friction_law import Parameter, RateTerm, SeparableLaw, plain
from collaudit.core.numeric.arrays import FloatArray


def _smooth(v: FloatArray, _d: FloatArray, c: float | FloatArray) -> tuple[FloatArray, ...]:
    return np.tanh(c * v), v


_NAMED, _NATURAL = plain("A", "C", "D", rate="C")

SMOOTH_COULOMB_VISCOUS = SeparableLaw(
    name="smooth-coulomb-viscous",
    title="Coulomb and viscous, smooth at low speed",
    formula="f(v) = A·tanh(C·v) + D·v",
    parameters=(
        Parameter("A", "friction", "Coulomb friction"),
        Parameter("C", "rate", "how fast friction rises with speed"),
        Parameter("D", "viscous", "viscous friction"),
    ),
    shape=_smooth,
    named=_NAMED,
    natural=_NATURAL,
    rate=RateTerm("tanh(C·v)", "a hyperbolic tangent", "C", "level", ("C",)),
)
