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
Coefficients = tuple[FloatArray, float]
Shape = Callable[[FloatArray, float | FloatArray], tuple[FloatArray, ...]]
ParameterKind = Literal["friction", "viscous", "rate", "speed", "number"]


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


def no_remarks(_ci95: Mapping[str, Interval | None]) -> tuple[str, ...]:
    """Nothing has to be said about a fit of the law."""
    return ()


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
        remarks: sentences on what a fit means, from its intervals by symbol.
    """

    name: str
    title: str
    formula: str
    parameters: tuple[Parameter, ...]
    breakaway: bool = False
    data_driven: bool = False
    remarks: Callable[[Mapping[str, Interval | None]], tuple[str, ...]] = no_remarks

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

    ``shape`` gives the columns; ``named`` and ``natural`` translate between their coefficients and C on one side and
    the parameters a reader knows on the other.

    Attributes:
        shape: columns (n,) of the k linear coefficients from speed (n,) and C; (m, n) from (m, 1) of C.
        named: coefficients (k,) and C to parameters by symbol.
        natural: the way back.
        rate: the term that C belongs to; None for a law without one.
        as_line: of the reference law: what level and slope of the straight line stand for, by the interval of C.
    """

    shape: Shape
    named: Callable[[FloatArray, float], dict[str, float]]
    natural: Callable[[Values], Coefficients]
    rate: RateTerm | None = None
    as_line: Callable[[Interval], tuple[str, str]] | None = None

    @property
    def symbols(self) -> tuple[str, ...]:
        """Parameters in the order of the file."""
        return tuple(p.symbol for p in self.parameters)

    @property
    def viscous_columns(self) -> tuple[int, ...]:
        """Coefficients that are viscous friction: columns whose parameter is of that kind."""
        return tuple(_column(self, p.symbol) for p in self.parameters if p.kind == "viscous")

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


def _column(law: SeparableLaw, symbol: str) -> int:
    """Number of the coefficient that alone moves a parameter."""
    size = len(law.symbols) - (law.rate is not None)
    base = law.named(np.zeros(size), 1.0)[symbol]
    (column,) = (i for i in range(size) if law.named(np.eye(size)[i], 1.0)[symbol] != base)
    return column


def without_column(law: SeparableLaw, symbol: str) -> SeparableLaw:
    """The law with one parameter, that a coefficient of its own stands for, held at zero and left out."""
    column = _column(law, symbol)

    def shape(speed: FloatArray, c: float | FloatArray) -> tuple[FloatArray, ...]:
        columns = law.shape(speed, c)
        return (*columns[:column], *columns[column + 1 :])

    def named(linear: FloatArray, c: float) -> dict[str, float]:
        every = law.named(np.insert(linear, column, 0.0), c)
        return {name: value for name, value in every.items() if name != symbol}

    def natural(values: Values) -> Coefficients:
        linear, c = law.natural({**values, symbol: 0.0})
        return np.delete(linear, column), c

    parameters = tuple(p for p in law.parameters if p.symbol != symbol)
    return replace(law, parameters=parameters, shape=shape, named=named, natural=natural)


def plain(
    *symbols: str, rate: str = ""
) -> tuple[Callable[[FloatArray, float], dict[str, float]], Callable[[Values], Coefficients]]:
    """``named`` and ``natural`` of a law whose parameters are its coefficients and its rate themselves.

    Args:
        symbols: parameters in the order of the file.
        rate: which of them is C.
    """
    linear = tuple(s for s in symbols if s != rate)

    def named(x: FloatArray, c: float) -> dict[str, float]:
        known = dict(zip(linear, (float(v) for v in x), strict=True))
        return {s: known.get(s, float(c)) for s in symbols}

    def natural(values: Values) -> Coefficients:
        return np.array([values[s] for s in linear]), values.get(rate, 0.0)

    return named, natural
