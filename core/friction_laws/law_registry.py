"""The friction laws, the one table of them, and their names as a type that is checked against it.

A new law is an instance of ``SeparableLaw`` or ``RidgeLaw`` here and its line in ``LAWS``. Everything
else follows: the configuration takes its name, ``model = "auto"`` compares it, friction.json and reports name its
parameters. No other room compares or lists names of laws.

Laws with breakaway that fades with speed: static LuGre, eq. (11), and the Gaussian Stribeck curve, eq. (10): C. Canudas
de Wit et al., "A new model for control of systems with friction", IEEE Trans. Autom. Control 40, 1995.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from collaudit.core.errors import CollauditError
from collaudit.core.friction_laws.friction_law import (
    FrictionLaw,
    Interval,
    Parameter,
    RateTerm,
    RidgeLaw,
    SeparableLaw,
    Values,
)
from collaudit.core.numeric.arrays import FloatArray


def _line(v: FloatArray, _c: float | FloatArray) -> tuple[FloatArray, ...]:
    return np.ones_like(v), v


COULOMB_VISCOUS = SeparableLaw(
    name="coulomb-viscous",
    title="Coulomb and viscous",
    formula="f(v) = A + D·v",
    parameters=(Parameter("A", "friction", "level of the line"), Parameter("D", "viscous", "slope of the line")),
    shape=_line,
)


def _smooth(v: FloatArray, c: float | FloatArray) -> tuple[FloatArray, ...]:
    return np.tanh(c * v), v


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
    rate=RateTerm("tanh(C·v)", "a hyperbolic tangent", "C", "level", ("C",)),
)


def _levelling(v: FloatArray, c: float | FloatArray) -> tuple[FloatArray, ...]:
    return np.ones_like(v), -np.expm1(-c * v), v


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
    rate=RateTerm("exp(-C·v)", "an exponential", "C", "gone", ("R", "C")),
)


def _exponential(v: FloatArray, c: float | FloatArray) -> tuple[FloatArray, ...]:
    return np.ones_like(v), np.exp(-c * v), v


def _gaussian(v: FloatArray, c: float | FloatArray) -> tuple[FloatArray, ...]:
    return np.ones_like(v), np.exp(-((c * v) ** 2)), v


def _as_line(c_interval: Interval) -> tuple[str, str]:
    """A slowly falling exponential is part of the line (A + B, D - B·C); one that is gone is not (A, D)."""
    if c_interval[0] is None and c_interval[1] is not None:
        return "A + B", "D - B·C"
    if c_interval[0] is not None and c_interval[1] is None:
        return "A (A + B if C is small)", "D (D - B·C if C is small)"
    return "A + B (A alone if C is large)", "D - B·C (D alone if C is large)"


class _BreakawayLaw(SeparableLaw):
    """A law that names breakaway itself, Fs, where the coefficient is what it lies above Fc."""

    def named(self, coefficients: FloatArray, c: float) -> dict[str, float]:
        values = super().named(coefficients, c)
        return {**values, "Fs": values["Fc"] + values["Fs"]}

    def natural(self, values: Values) -> tuple[FloatArray, float]:
        return super().natural({**values, "Fs": values["Fs"] - values["Fc"]})


_STRIBECK = (
    Parameter("Fc", "friction", "Coulomb friction"),
    Parameter("Fs", "friction", "breakaway friction"),
    Parameter("vs", "speed", "Stribeck speed"),
    Parameter("sigma2", "viscous", "viscous friction"),
)

STATIC_LUGRE = SeparableLaw(
    name="static-lugre",
    title="static LuGre",
    formula="f(v) = A + B·exp(−C·v) + D·v",
    parameters=(
        Parameter("A", "friction", "Coulomb friction"),
        Parameter("B", "friction", "extra friction near standstill"),
        Parameter("C", "rate", "how fast that extra fades with speed"),
        Parameter("D", "viscous", "viscous friction"),
    ),
    breakaway=True,
    shape=_exponential,
    rate=RateTerm("exp(-C·v)", "an exponential", "C", "gone", ("B", "C")),
    as_line=_as_line,
)

STRIBECK_GAUSS = _BreakawayLaw(
    name="stribeck-gauss",
    title="Stribeck (Gauss)",
    formula="f(v) = Fc + (Fs − Fc)·exp(−(v/vs)²) + sigma2·v",
    parameters=_STRIBECK,
    breakaway=True,
    shape=_gaussian,
    rate=RateTerm("exp(-(v/v_s)²)", "a Gaussian", "1/v_s", "gone", ("Fs", "vs")),
)


_MOST_CENTRES = 8


def _layout(speed: FloatArray) -> dict[str, float]:
    """Centres v1, v2, … from the slowest to the fastest speed, and the width w, a ratio of speeds (logarithmic)."""
    centres = np.geomspace(speed.min(), speed.max(), max(3, min(_MOST_CENTRES, speed.size // 3)))
    width = float(np.log(centres[1] / centres[0]))
    return {f"v{k}": float(v) for k, v in enumerate(centres, 1)} | {"w": width}


def _bumps(speed: FloatArray, values: Values) -> FloatArray:
    """(n, k) Gaussian bumps over the logarithm of speed."""
    count = sum(symbol.startswith("v") for symbol in values)
    centres = np.array([values[f"v{k}"] for k in range(1, count + 1)])
    x = np.log(np.clip(speed, centres[0], centres[-1]))
    return np.asarray(np.exp(-0.5 * ((x[..., None] - np.log(centres)) / values["w"]) ** 2))


RBF = RidgeLaw(
    name="rbf",
    title="data-driven",
    formula="f(v) = A + D·v + Gaussian bumps over the logarithm of speed",
    parameters=(
        Parameter("A", "friction"),
        Parameter("D", "viscous"),
        Parameter("W", "friction", numbered=True),
        Parameter("v", "speed", numbered=True),
        Parameter("w", "number"),
    ),
    data_driven=True,
    layout=_layout,
    columns=_bumps,
    least_points=8,
    least_held_out=6,
)


#: Simplest first: of laws that explain the points as well with as many parameters, the earlier is taken.
LAWS: dict[str, FrictionLaw] = {
    law.name: law
    for law in (
        COULOMB_VISCOUS,
        SMOOTH_COULOMB_VISCOUS,
        STATIC_LUGRE,
        STRIBECK_GAUSS,
        SATURATING_VISCOUS,
        RBF,
    )
}


def law_named(name: str) -> FrictionLaw:
    """The law of a name.

    Raises:
        CollauditError: there is none.
    """
    if name not in LAWS:
        raise CollauditError("there is no friction law of this name", found=name, expected=" or ".join(LAWS))
    return LAWS[name]


#: The straight line that every law is compared with, and that is fallen back to.
LINE = COULOMB_VISCOUS
#: The law whose undetermined parameters explain why the line was taken; an F test takes it where no speed can be held
#: out.
REFERENCE = STATIC_LUGRE


@dataclass(frozen=True, slots=True)
class NameOfLaw:
    """Which texts a key or field accepts: looked up in the table when asked, so that a law added later is known.

    Whoever holds such a text checks it when it is made; the published schemas list the choices.

    Attributes:
        extra: other texts that are allowed.
    """

    extra: tuple[str, ...] = ()

    @property
    def choices(self) -> tuple[str, ...]:
        """All texts that are allowed."""
        return (*self.extra, *LAWS)


#: The name of a law.
LawName = Annotated[str, NameOfLaw()]
#: What the configuration may ask for.
LawChoice = Annotated[str, NameOfLaw(("auto",))]
