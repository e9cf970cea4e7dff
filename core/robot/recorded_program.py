"""Arithmetic recorded once and replayed over many samples: one NumPy operation a step, in buffers that stay in cache.

A recursion over a robot's links, written with ordinary operators, is run on :class:`Value` in place of numbers. What it
does is recorded, with the robot's constants folded in: products with 0 and 1 and sums with 0 vanish, signs are carried
along for nothing, equal terms are computed once. A :class:`Program` then runs the steps on whole blocks of samples.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from collaudit.core.numeric.arrays import FloatArray


class Value:
    """A number of the computation that is recorded: plus or minus a node of its recording."""

    __slots__ = ("negative", "node", "recorder")  # thousands are made when a program starts

    def __init__(self, recorder: Recorder, node: int, negative: bool = False) -> None:
        """``node``: its number; ``negative``: whether this is minus what the node holds."""
        self.recorder, self.node, self.negative = recorder, node, negative

    def __neg__(self) -> Value:
        return Value(self.recorder, self.node, not self.negative)

    def __add__(self, other: Scalar) -> Scalar:
        return self.recorder.sum_of(self, other)

    __radd__ = __add__

    def __sub__(self, other: Scalar) -> Scalar:
        return self.recorder.sum_of(self, -other)

    def __rsub__(self, other: Scalar) -> Scalar:
        return self.recorder.sum_of(-self, other)

    def __mul__(self, other: Scalar) -> Scalar:
        return self.recorder.product_of(self, other)

    __rmul__ = __mul__


Scalar: TypeAlias = Value | float


class _Step(NamedTuple):
    """One operation on a node, and on a second node or a constant where it has two operands."""

    ufunc: np.ufunc
    first: int
    second: int | None
    constant: float | None

    @property
    def nodes(self) -> tuple[int, ...]:
        """What has to be computed before it."""
        return (self.first,) if self.second is None else (self.first, self.second)


class Recorder:
    """Records operations on values, each only once."""

    def __init__(self, inputs: int) -> None:
        """``inputs``: how many signals the computation starts from."""
        self._inputs = inputs
        self._steps: list[_Step] = []
        self._known: dict[_Step, int] = {}

    def inputs(self) -> list[Value]:
        """The signals, in the order in which a program is handed them."""
        return [Value(self, k) for k in range(self._inputs)]

    def cosine(self, x: Scalar) -> Scalar:
        """The cosine of a value."""
        return Value(self, self._node(np.cos, x.node)) if isinstance(x, Value) else math.cos(x)

    def sine(self, x: Scalar) -> Scalar:
        """The sine of a value."""
        return Value(self, self._node(np.sin, x.node), x.negative) if isinstance(x, Value) else math.sin(x)

    def sum_of(self, x: Value, y: Scalar) -> Scalar:
        """x + y."""
        if not isinstance(y, Value):
            if y == 0.0:
                return x
            ufunc = np.subtract if x.negative else np.add
            return Value(self, self._node(ufunc, x.node, constant=float(y)), x.negative)
        if x.negative == y.negative:
            return Value(self, self._node(np.add, *sorted((x.node, y.node))), x.negative)
        if x.node == y.node:
            return 0.0
        plus, minus = (y, x) if x.negative else (x, y)
        return Value(self, self._node(np.subtract, plus.node, minus.node))

    def product_of(self, x: Value, y: Scalar) -> Scalar:
        """x · y."""
        if not isinstance(y, Value):
            if y == 0.0:
                return 0.0
            negative = x.negative != (y < 0.0)
            node = x.node if abs(y) == 1.0 else self._node(np.multiply, x.node, constant=abs(float(y)))
            return Value(self, node, negative)
        ufunc = np.square if x.node == y.node else np.multiply
        operands = (x.node,) if x.node == y.node else sorted((x.node, y.node))
        return Value(self, self._node(ufunc, *operands), x.negative != y.negative)

    def _node(self, ufunc: np.ufunc, first: int, second: int | None = None, constant: float | None = None) -> int:
        """Number of the node that holds the operation's result."""
        step = _Step(ufunc, first, second, constant)
        found = self._known.get(step)
        if found is None:
            found = self._known[step] = self._inputs + len(self._steps)
            self._steps.append(step)
        return found

    def program(self, outputs: Sequence[Scalar]) -> Program:
        """What computes these values, and nothing that they do not need."""
        return Program(self._inputs, self._steps, outputs)


class Program:
    """Steps on numbered cells: first the inputs, then the outputs, then buffers, then constants."""

    def __init__(self, inputs: int, steps: Sequence[_Step], outputs: Sequence[Scalar]) -> None:
        self.inputs, self.outputs = inputs, len(outputs)
        self._buffers = 0
        self._constants: list[float] = []
        self._calls: list[tuple[np.ufunc, tuple[int, ...]]] = []
        self._fixed = [(row, value) for row, value in enumerate(outputs) if not isinstance(value, Value)]
        wanted: dict[int, list[tuple[int, bool]]] = defaultdict(list)
        for row, value in enumerate(outputs):
            if isinstance(value, Value):
                wanted[value.node].append((row, value.negative))
        cells, free, last = list(range(inputs)), list[int](), _last_use(inputs, steps, wanted)
        for node in range(inputs):
            self._store(node, wanted.get(node, ()))
        for node, step in enumerate(steps, inputs):
            cells.append(-1)
            if node in last:
                operands = [cells[x] for x in step.nodes]
                operands += [] if step.constant is None else [self._constant(step.constant)]
                free += [cells[x] for x in set(step.nodes) if x >= inputs and last[x] == node]
                cells[node] = free.pop() if free else self._buffer()
                self._calls.append((step.ufunc, (*operands, cells[node])))
                self._store(cells[node], wanted.get(node, ()))
                free += [cells[node]] if last[node] == node else []  # an output that nothing else needs

    def _buffer(self) -> int:
        self._buffers += 1
        return self.inputs + self.outputs + self._buffers - 1

    def _constant(self, value: float) -> int:
        """Constants are numbered from -1 downwards: the number of buffers is not known yet."""
        self._constants.append(value)
        return -len(self._constants)

    def _store(self, cell: int, wanted: Iterable[tuple[int, bool]]) -> None:
        for row, negative in wanted:
            self._calls.append((np.negative if negative else np.positive, (cell, self.inputs + row)))

    def run_of(self, count: int) -> Run:
        """Memory and calls for that many samples at a time."""
        memory = np.zeros((self.inputs + self.outputs + self._buffers, count))
        cells: list[Any] = [*memory, *reversed(self._constants)]
        first = self.inputs + self.outputs
        for row, value in self._fixed:
            memory[self.inputs + row] = value
        calls = [(ufunc, tuple(cells[k] for k in operands)) for ufunc, operands in self._calls]
        return Run(memory[: self.inputs], memory[self.inputs : first], calls)


class Run:
    """A program with its memory: fill ``inputs`` (k, m), run, read ``outputs`` (r, m)."""

    def __init__(
        self, inputs: FloatArray, outputs: FloatArray, calls: Sequence[tuple[np.ufunc, tuple[Any, ...]]]
    ) -> None:
        self.inputs, self.outputs = inputs, outputs
        self._calls = calls

    def run(self) -> None:
        """Compute the outputs."""
        with np.errstate(invalid="ignore"):  # the sine of what is not finite is not a number, and that is right
            for ufunc, operands in self._calls:
                ufunc(*operands)


def _last_use(inputs: int, steps: Sequence[_Step], outputs: Iterable[int]) -> dict[int, int]:
    """The node that is the last to use a node, by node, for those that the outputs need; its own for an output."""
    last = {node: node for node in outputs}
    for node in range(inputs + len(steps) - 1, inputs - 1, -1):
        if node in last:
            for operand in steps[node - inputs].nodes:
                last[operand] = max(last.get(operand, -1), node)
    return last
