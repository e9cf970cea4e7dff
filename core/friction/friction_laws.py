"""The friction laws behind one interface: their curves, their parameters, and what is linear in them.

Every law is ``f(v) = sgn(v) · curve(|v|)``. At a fixed rate C each is linear in its other parameters
(``shape`` gives the columns), so that one separable least squares fits them all; ``named`` and ``natural``
translate between those coefficients and the parameters a reader knows.

Sources: C. Canudas de Wit et al., "A new model for control of systems with friction", IEEE Trans. Autom.
Control 40, 1995 (LuGre, Stribeck curve); B. Armstrong-Hélouvry et al., Automatica 30, 1994 (the others).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from collaudit.core.numeric.arrays import FloatArray

Shape = Callable[[FloatArray, FloatArray, float], tuple[FloatArray, ...]]
Coefficients = tuple[FloatArray, float]
Values = Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Law:
    """One friction law.

    Attributes:
        name: as in the configuration and in friction.json.
        symbols: parameters in the order of the file.
        shape: columns of the linear coefficients from speed (n,), direction (n,) and rate C.
        has_rate: whether C is fitted.
        named: linear coefficients (k,) and C to parameters by symbol.
        natural: the way back.
        directional: whether both directions have parameters of their own.
        non_negative: whether the coefficients are held at zero or above.
        rate_text: the part of the law that C belongs to.
    """

    name: str
    symbols: tuple[str, ...]
    shape: Shape
    has_rate: bool
    named: Callable[[FloatArray, float], dict[str, float]]
    natural: Callable[[Values], Coefficients]
    directional: bool = False
    non_negative: bool = False
    rate_text: str = ""

    def curve(self, values: Values, speed: FloatArray, direction: FloatArray) -> FloatArray:
        """Friction against the motion at speeds (n,) > 0 in directions (n,) of +1 or -1."""
        linear, c = self.natural(values)
        return np.asarray(sum(x * column for x, column in zip(linear, self.shape(speed, direction, c), strict=True)))


def _line(v: FloatArray, _d: FloatArray, _c: float) -> tuple[FloatArray, ...]:
    return np.ones_like(v), v


def _tustin(v: FloatArray, _d: FloatArray, c: float) -> tuple[FloatArray, ...]:
    return np.ones_like(v), np.exp(-c * v), v


def _gauss(v: FloatArray, _d: FloatArray, c: float) -> tuple[FloatArray, ...]:
    return np.ones_like(v), np.exp(-((c * v) ** 2)), v


def _smooth(v: FloatArray, _d: FloatArray, c: float) -> tuple[FloatArray, ...]:
    return np.tanh(c * v), v


def _two_lines(v: FloatArray, d: FloatArray, _c: float) -> tuple[FloatArray, ...]:
    ahead, back = np.asarray(d > 0, dtype=float), np.asarray(d < 0, dtype=float)
    return ahead, back, ahead * v, back * v


def _plain(*symbols: str) -> tuple[Callable[[FloatArray, float], dict[str, float]], Callable[[Values], Coefficients]]:
    """Parameters that are the coefficients themselves; C, where named, stands before the last one."""
    linear = tuple(s for s in symbols if s != "C")

    def named(x: FloatArray, c: float) -> dict[str, float]:
        known = dict(zip(linear, (float(v) for v in x), strict=True))
        return {s: known.get(s, float(c)) for s in symbols}

    def natural(values: Values) -> Coefficients:
        return np.array([values[s] for s in linear]), values.get("C", 0.0)

    return named, natural


def _stribeck_named(x: FloatArray, c: float) -> dict[str, float]:
    a, b, d = (float(v) for v in x)
    return {"Fc": a, "Fs": a + b, "vs": 1.0 / c, "sigma2": d}


def _stribeck_natural(values: Values) -> Coefficients:
    linear = np.array([values["Fc"], values["Fs"] - values["Fc"], values["sigma2"]])
    return linear, 1.0 / values["vs"]


_STRIBECK = ("Fc", "Fs", "vs", "sigma2")

#: Simplest first: of laws that explain the points as well with as many parameters, the earlier is taken.
LAWS: dict[str, Law] = {
    law.name: law
    for law in (
        Law("coulomb-viscous", ("A", "D"), _line, False, *_plain("A", "D")),
        Law("damping-coulomb", ("A", "D"), _line, False, *_plain("A", "D"), non_negative=True),
        Law(
            "smooth-coulomb-viscous",
            ("A", "C", "D"),
            _smooth,
            True,
            *_plain("A", "C", "D"),
            rate_text="tanh(C·v)",
        ),
        Law(
            "asymmetric-coulomb-viscous",
            ("Ap", "Am", "Dp", "Dm"),
            _two_lines,
            False,
            *_plain("Ap", "Am", "Dp", "Dm"),
            directional=True,
        ),
        Law("static-lugre", tuple("ABCD"), _tustin, True, *_plain(*"ABCD"), rate_text="exp(-C·v)"),
        Law("stribeck-tustin", _STRIBECK, _tustin, True, _stribeck_named, _stribeck_natural, rate_text="exp(-v/v_s)"),
        Law(
            "stribeck-gauss",
            _STRIBECK,
            _gauss,
            True,
            _stribeck_named,
            _stribeck_natural,
            rate_text="exp(-(v/v_s)²)",
        ),
    )
}


def law_curve(name: str, values: Values, speed: FloatArray, direction: FloatArray) -> FloatArray:
    """Friction against the motion of any law, the data-driven one included.

    Args:
        name: of the law.
        values: parameters by symbol.
        speed: (n,) > 0.
        direction: (n,) +1 or -1.
    """
    if name == RBF:
        return rbf_curve(values, speed)
    return LAWS[name].curve(values, speed, direction)


RBF = "rbf"


def rbf_curve(values: Values, speed: FloatArray) -> FloatArray:
    """``A + D·v + Σ W_k exp(-(ln(v/v_k)/w)²/2)``, the bumps held constant beyond the outer centres v_k.

    Args:
        values: A, D, w (a ratio of speeds, logarithmic), and W1, v1, W2, v2 …
        speed: (n,) > 0.
    """
    count = sum(symbol.startswith("W") for symbol in values)
    centres = np.array([values[f"v{k}"] for k in range(1, count + 1)])
    weights = np.array([values[f"W{k}"] for k in range(1, count + 1)])
    bumps = rbf_columns(speed, centres, values["w"])
    return np.asarray(values["A"] + values["D"] * speed + bumps @ weights)


def rbf_columns(speed: FloatArray, centres: FloatArray, width: float) -> FloatArray:
    """(n, k) Gaussian bumps over the logarithm of speed."""
    x = np.log(np.clip(speed, centres[0], centres[-1]))
    return np.asarray(np.exp(-0.5 * ((x[..., None] - np.log(centres)) / width) ** 2))
