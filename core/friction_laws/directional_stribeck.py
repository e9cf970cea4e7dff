"""Stribeck laws by direction: level, breakaway and viscous friction forward and backward, one speed of fading.

The speed at which breakaway fades is a property of the lubricant and is taken to be one; what a gear has by direction
is how strong its friction is.
"""

from __future__ import annotations

import numpy as np

from collaudit.core.friction_laws.friction_law import Parameter, RateTerm, SeparableLaw, Shape, plain
from collaudit.core.friction_laws.straight_lines import only_the_mean
from collaudit.core.friction_laws.stribeck import STATIC_LUGRE, STRIBECK_GAUSS
from collaudit.core.numeric.arrays import FloatArray


def by_direction(shape: Shape) -> Shape:
    """The columns of a law once for each direction: forward and backward of the first, of the second, …"""

    def both(v: FloatArray, d: FloatArray, c: float | FloatArray) -> tuple[FloatArray, ...]:
        ahead, back = np.asarray(d > 0, dtype=float), np.asarray(d < 0, dtype=float)
        return tuple(side * column for column in shape(v, d, c) for side in (ahead, back))

    return both


_NAMED, _NATURAL = plain("Ap", "Am", "Bp", "Bm", "Dp", "Dm", "C", rate="C")
_PARAMETERS = (
    Parameter("Ap", "friction", "Coulomb friction forward"),
    Parameter("Am", "friction", "Coulomb friction backward"),
    Parameter("Bp", "friction", "extra friction near standstill forward"),
    Parameter("Bm", "friction", "extra friction near standstill backward"),
    Parameter("Dp", "viscous", "viscous friction forward"),
    Parameter("Dm", "viscous", "viscous friction backward"),
    Parameter("C", "rate", "how fast that extra fades with speed"),
)

ASYMMETRIC_LUGRE = SeparableLaw(
    name="asymmetric-lugre",
    title="static LuGre by direction",
    formula="f(v) = Ap + Bp·exp(−C·v) + Dp·v forward, Am + Bm·exp(−C·v) + Dm·v backward",
    parameters=_PARAMETERS,
    breakaway=True,
    directional=True,
    remarks=only_the_mean,
    shape=by_direction(STATIC_LUGRE.shape),
    named=_NAMED,
    natural=_NATURAL,
    rate=RateTerm("exp(-C·v)", "an exponential", "C", "gone", ("Bp", "Bm", "C")),
)

ASYMMETRIC_STRIBECK_GAUSS = SeparableLaw(
    name="asymmetric-stribeck-gauss",
    title="Stribeck (Gauss) by direction",
    formula="f(v) = Ap + Bp·exp(−(C·v)²) + Dp·v forward, Am + Bm·exp(−(C·v)²) + Dm·v backward",
    parameters=_PARAMETERS,
    breakaway=True,
    directional=True,
    remarks=only_the_mean,
    shape=by_direction(STRIBECK_GAUSS.shape),
    named=_NAMED,
    natural=_NATURAL,
    rate=RateTerm("exp(-(C·v)²)", "a Gaussian", "C", "gone", ("Bp", "Bm", "C")),
)
