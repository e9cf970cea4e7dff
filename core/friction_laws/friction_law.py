"""What a friction law is: a curve, and the facts that fitting, files and reports need to know about it.

Every law is ``f(v) = sgn(v) · curve(|v|)``. Two kinds differ in how they are fitted: a separable law is linear in all
but one parameter, a ridge law is linear in many whose size is held small. A new law is an instance of one of them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from collaudit.core.numeric.arrays import FloatArray

Values = Mapping[str, float]
Interval = tuple[float | None, float | None]
Shape = Callable[[FloatArray, float | FloatArray], tuple[FloatArray, ...]]
ParameterKind = Literal["friction", "viscous", "rate", "speed", "number"]
_OF_RATE = ("rate", "speed")


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a law.

    Attributes:
        symbol: as in the formula; the key in friction.json is the symbol and its unit.
        kind: its dimension: ``friction`` (N·m), ``viscous`` (N·m·s/rad), ``rate`` (s/rad), ``speed`` (rad/s) or
            ``number`` (none); N and m of prismatic joints.
        meaning: a few words for reports.
        numbered: whether it stands for a series, its symbol followed by 1, 2, …
    """

    symbol: str
    kind: ParameterKind
    meaning: str = ""
    numbered: bool = False


@dataclass(frozen=True, slots=True)
class RateTerm:
    """The part of a separable law that its rate C belongs to, as messages name it.

    Attributes:
        text: the term.
        noun: the term in words.
        rate: C as the formula writes it.
        large: what the term is at speeds where C·v is large: ``gone`` or ``level``.
        unknown: symbols that are not determined where C is not.
    """

    text: str
    noun: str
    rate: str
    large: str
    unknown: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionLaw(ABC):
    """Facts about a law that do not depend on how it is fitted.

    Attributes:
        name: as in the configuration and in friction.json.
        title: in words.
        formula: text of the curve.
        parameters: in the order of the file.
        breakaway: whether its value towards zero speed is breakaway, once its parameters are determined.
        data_driven: whether only the curve means anything, and not its parameters.
    """

    name: str
    title: str
    formula: str
    parameters: tuple[Parameter, ...]
    breakaway: bool = False
    data_driven: bool = False

    def __post_init__(self) -> None:
        """Check that keys of friction.json can be told apart: a symbol ends at the first underscore."""
        symbols = [p.symbol for p in self.parameters]
        if len(set(symbols)) < len(symbols) or not all(s.isalnum() for s in symbols):
            raise ValueError(f"{self.name}: symbols must differ and consist of letters and digits, found {symbols}")

    @abstractmethod
    def curve(self, values: Values, speed: FloatArray) -> FloatArray:
        """Friction against the motion.

        Args:
            values: parameters by symbol.
            speed: (n,) > 0.

        Returns:
            (n,) positive where it opposes the motion.
        """

    def parameter(self, symbol: str) -> Parameter:
        """The parameter of a symbol; of a series, the one of ``W3`` is ``W``.

        Raises:
            KeyError: the law has no such parameter.
        """
        for p in self.parameters:
            if symbol == p.symbol and not p.numbered:
                return p
            if p.numbered and symbol.rstrip("0123456789") == p.symbol != symbol:
                return p
        raise KeyError(symbol)


@dataclass(frozen=True, slots=True, kw_only=True)
class SeparableLaw(FrictionLaw):
    """A law that is linear in its parameters at a fixed rate C, so that one separable least squares fits it.

    ``shape`` gives the columns. The parameters are their coefficients, in this order, and among them C itself (of the
    kind ``rate``) or 1/C (``speed``); a law of which that does not hold translates between both in a class of its own.

    Attributes:
        shape: columns (n,) of the k linear coefficients from speed (n,) and C; (m, n) from (m, 1) of C.
        rate: the term that C belongs to; None for a law without one.
        as_line: of the reference law: what level and slope of the straight line stand for, by the interval of C.
    """

    shape: Shape
    rate: RateTerm | None = None
    as_line: Callable[[Interval], tuple[str, str]] | None = None

    @property
    def symbols(self) -> tuple[str, ...]:
        """Parameters in the order of the file."""
        return tuple(p.symbol for p in self.parameters)

    @property
    def linear(self) -> tuple[Parameter, ...]:
        """Those that are coefficients of columns."""
        return tuple(p for p in self.parameters if p.kind not in _OF_RATE)

    @property
    def viscous_columns(self) -> tuple[int, ...]:
        """Coefficients that are viscous friction: columns whose parameter is of that kind."""
        return tuple(k for k, p in enumerate(self.linear) if p.kind == "viscous")

    def named(self, coefficients: FloatArray, c: float) -> dict[str, float]:
        """Parameters by symbol from coefficients (k,) and C."""
        known = dict(zip((p.symbol for p in self.linear), coefficients.tolist(), strict=True))
        turned = {"rate": float(c), "speed": 1.0 / c if c else np.inf}
        return {p.symbol: known[p.symbol] if p.symbol in known else turned[p.kind] for p in self.parameters}

    def natural(self, values: Values) -> tuple[FloatArray, float]:
        """The way back; at a Stribeck speed of 0 all that fades is gone."""
        c = 0.0
        for p in self.parameters:
            if p.kind in _OF_RATE:
                value = values[p.symbol]
                c = value if p.kind == "rate" else 1.0 / value if value else np.inf
        return np.array([values[p.symbol] for p in self.linear]), c

    def curve(self, values: Values, speed: FloatArray) -> FloatArray:
        """Friction against the motion; see :meth:`FrictionLaw.curve`."""
        linear, c = self.natural(values)
        return np.asarray(sum(x * column for x, column in zip(linear, self.shape(speed, c), strict=True)))


@dataclass(frozen=True, slots=True, kw_only=True)
class RidgeLaw(FrictionLaw):
    """The line ``A + D·v`` and weighted columns ``W1, W2, …`` of speed, laid out by the speeds measured.

    The weights are held small by a ridge, chosen by the data. A law of this kind has the parameters A, D, W and those
    of its layout.

    Attributes:
        layout: parameters that the speeds measured (n,) set, by symbol.
        columns: (n, k) columns of the weights at speeds (n,), from the layout.
        least_points: fewer friction points than this cannot carry it.
        least_held_out: the same of the points that are left when speeds are held out.
    """

    layout: Callable[[FloatArray], dict[str, float]]
    columns: Callable[[FloatArray, Values], FloatArray]
    least_points: int
    least_held_out: int

    def curve(self, values: Values, speed: FloatArray) -> FloatArray:
        """Friction against the motion; see :meth:`FrictionLaw.curve`."""
        columns = self.columns(speed, values)
        weights = np.array([values[f"W{k}"] for k in range(1, columns.shape[-1] + 1)])
        return np.asarray(values["A"] + values["D"] * speed + columns @ weights)


def without_column(law: SeparableLaw, symbol: str) -> SeparableLaw:
    """The law with one parameter, a coefficient of its own, held at zero and left out."""
    column = [p.symbol for p in law.linear].index(symbol)

    def shape(speed: FloatArray, c: float | FloatArray) -> tuple[FloatArray, ...]:
        columns = law.shape(speed, c)
        return (*columns[:column], *columns[column + 1 :])

    return replace(law, parameters=tuple(p for p in law.parameters if p.symbol != symbol), shape=shape)
