"""Laws with breakaway that fades with speed: static LuGre, eq. (11), and the Stribeck curves, eq. (10).

Sources: C. Canudas de Wit et al., "A new model for control of systems with friction", IEEE Trans. Autom. Control 40,
1995 (LuGre, Gaussian Stribeck curve); B. Armstrong-Hélouvry et al., Automatica 30, 1994 (the exponential one).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from collaudit.core.friction_laws.friction_law import (
    Coefficients,
    Interval,
    Parameter,
    RateTerm,
    SeparableLaw,
    Values,
    plain,
)
from collaudit.core.numeric.arrays import FloatArray


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


def _negative_breakaway(ci95: Mapping[str, Interval | None]) -> tuple[str, ...]:
    bounds = ci95["B"]
    if bounds is None or (bounds[1] or 0.0) >= 0:
        return ()
    return (
        "B is negative: friction rises towards a level instead of falling from breakaway; A is not a Coulomb level.",
    )


def _stribeck_named(x: FloatArray, c: float) -> dict[str, float]:
    a, b, d = (float(v) for v in x)
    return {"Fc": a, "Fs": a + b, "vs": 1.0 / c, "sigma2": d}


def _stribeck_natural(values: Values) -> Coefficients:
    linear = np.array([values["Fc"], values["Fs"] - values["Fc"], values["sigma2"]])
    return linear, 1.0 / values["vs"] if values["vs"] else np.inf  # at a Stribeck speed of 0 the rest is gone


_NAMED, _NATURAL = plain("A", "B", "C", "D", rate="C")
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
    remarks=_negative_breakaway,
    shape=_exponential,
    named=_NAMED,
    natural=_NATURAL,
    rate=RateTerm("exp(-C·v)", "an exponential", "C", "gone", ("B", "C")),
    as_line=_as_line,
)

STRIBECK_GAUSS = SeparableLaw(
    name="stribeck-gauss",
    title="Stribeck (Gauss)",
    formula="f(v) = Fc + (Fs − Fc)·exp(−(v/vs)²) + sigma2·v",
    parameters=_STRIBECK,
    breakaway=True,
    shape=_gaussian,
    named=_stribeck_named,
    natural=_stribeck_natural,
    rate=RateTerm("exp(-(v/v_s)²)", "a Gaussian", "1/v_s", "gone", ("Fs", "vs")),
)
