"""Laws with a part that rises with speed and levels off.

Coulomb friction that rises smoothly from zero speed, and viscous friction whose rise levels off, as that of harmonic
drives and of grease that thins does.
"""

from __future__ import annotations

import numpy as np

from collaudit.core.friction_laws.friction_law import Parameter, RateTerm, SeparableLaw, plain
from collaudit.core.numeric.arrays import FloatArray


def _smooth(v: FloatArray, c: float | FloatArray) -> tuple[FloatArray, ...]:
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


def _levelling(v: FloatArray, c: float | FloatArray) -> tuple[FloatArray, ...]:
    return np.ones_like(v), -np.expm1(-c * v), v


_RISE_NAMED, _RISE_NATURAL = plain("A", "R", "C", "D", rate="C")

#: The curve of static LuGre with the opposite sign of its exponential: either law is refused where the other holds.
SATURATING_VISCOUS = SeparableLaw(
    name="saturating-viscous",
    title="Coulomb and viscous, levelling off",
    formula="f(v) = A + R·(1 − exp(−C·v)) + D·v",
    parameters=(
        Parameter("A", "friction", "friction at low speed"),
        Parameter("R", "friction", "rise with speed that levels off"),
        Parameter("C", "rate", "how fast that rise levels off with speed"),
        Parameter("D", "viscous", "viscous friction at high speed"),
    ),
    shape=_levelling,
    named=_RISE_NAMED,
    natural=_RISE_NATURAL,
    rate=RateTerm("exp(-C·v)", "an exponential", "C", "gone", ("R", "C")),
)
