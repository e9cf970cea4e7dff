"""Laws that are straight lines of speed: Coulomb and viscous friction, within bounds, and by direction."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from collaudit.core.friction_laws.friction_law import Interval, Parameter, SeparableLaw, plain
from collaudit.core.numeric.arrays import FloatArray


def _line(v: FloatArray, _d: FloatArray, _c: float | FloatArray) -> tuple[FloatArray, ...]:
    return np.ones_like(v), v


def _two_lines(v: FloatArray, d: FloatArray, _c: float | FloatArray) -> tuple[FloatArray, ...]:
    ahead, back = np.asarray(d > 0, dtype=float), np.asarray(d < 0, dtype=float)
    return ahead, back, ahead * v, back * v


def only_the_mean(_ci95: Mapping[str, Interval | None]) -> tuple[str, ...]:
    """What no data of one model can tell of the two directions."""
    return (
        "A constant error of the model's torque, or of the effort's zero, adds to Ap what it takes from Am: rely on "
        "their mean only.",
    )


_NAMED, _NATURAL = plain("A", "D")
_BOTH_NAMED, _BOTH_NATURAL = plain("Ap", "Am", "Dp", "Dm")

COULOMB_VISCOUS = SeparableLaw(
    name="coulomb-viscous",
    title="Coulomb and viscous",
    formula="f(v) = A + D·v",
    parameters=(Parameter("A", "friction", "level of the line"), Parameter("D", "viscous", "slope of the line")),
    shape=_line,
    named=_NAMED,
    natural=_NATURAL,
)

DAMPING_COULOMB = SeparableLaw(
    name="damping-coulomb",
    title="damping and Coulomb, none negative",
    formula="f(v) = A + D·v",
    parameters=(Parameter("A", "friction", "Coulomb friction"), Parameter("D", "viscous", "damping")),
    same_curve_as=COULOMB_VISCOUS.name,
    shape=_line,
    named=_NAMED,
    natural=_NATURAL,
    bounded=True,
)

ASYMMETRIC_COULOMB_VISCOUS = SeparableLaw(
    name="asymmetric-coulomb-viscous",
    title="Coulomb and viscous by direction",
    formula="f(v) = Ap + Dp·v forward, Am + Dm·v backward",
    parameters=(
        Parameter("Ap", "friction", "level forward"),
        Parameter("Am", "friction", "level backward"),
        Parameter("Dp", "viscous", "slope forward"),
        Parameter("Dm", "viscous", "slope backward"),
    ),
    directional=True,
    remarks=only_the_mean,
    shape=_two_lines,
    named=_BOTH_NAMED,
    natural=_BOTH_NATURAL,
)
