"""Programs over long, narrow arrays: by blocks of samples in threads, in the joints of a log."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np

from collaudit.core.data.columns import Columns
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.tables import table

#: Samples at a time: long enough that calling NumPy costs little, short enough that a program's buffers stay in cache.
_BLOCK = 16384
Sample: TypeAlias = Callable[[FloatArray], FloatArray]
_AGREE = 1e-9  # of the largest value: rounding alone leaves 1e-14


class Run(Protocol):
    """A computation with its memory: fill ``inputs`` (k, m), run, read ``outputs`` (r, m)."""

    @property
    def inputs(self) -> FloatArray:
        """(k, m)."""
        ...

    @property
    def outputs(self) -> FloatArray:
        """(r, m)."""
        ...

    def run(self) -> None:
        """Compute the outputs."""
        ...


class Batched(Protocol):
    """A computation of ``outputs`` numbers from ``inputs`` numbers for many samples at once."""

    inputs: int
    outputs: int

    def run_of(self, count: int) -> Run:
        """Memory for that many samples at a time."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """Inputs: (n, c) values, as (r, n) rows scale · (matrix · values + offset), as far as there are any."""

    values: Columns
    matrix: FloatArray | None = None
    offset: FloatArray | None = None
    scale: float = 1.0

    def fill(self, rows: FloatArray, block: slice) -> None:
        """Put a block of samples into (r, m) rows."""
        if self.matrix is None:
            rows[...] = self.values[block].T
        else:
            np.matmul(self.matrix, self.values[block].T, out=rows)
        if self.offset is not None:
            rows += self.offset[:, None]
        if self.scale != 1.0:
            rows *= self.scale


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """So many of a program's outputs that are one array; by the transpose of ``back`` (rows, c) they become c."""

    rows: int
    back: FloatArray | None = None


def evaluate(program: Batched, signals: Sequence[Signal], parts: Sequence[Part] = ()) -> list[FloatArray]:
    """Run a program over all samples; one with any input that is not finite is NaN altogether.

    Args:
        program: its inputs are the rows of the signals, one after the other.
        signals: of n samples each.
        parts: what its outputs are, one after the other; one array of them all without.

    Returns:
        (n, c) arrays, one a part.
    """
    count = signals[0].values.shape[0]
    parts = parts or (Part(program.outputs),)
    out = [table(count, p.rows if p.back is None else p.back.shape[1]) for p in parts]
    idle: list[Run] = []

    def one(block: slice) -> None:
        try:
            run = idle.pop()
        except IndexError:
            run = program.run_of(min(_BLOCK, count))
        samples = len(range(*block.indices(count)))
        inputs, first = run.inputs[:, :samples], 0
        for signal in signals:
            height = signal.values.shape[1] if signal.matrix is None else signal.matrix.shape[0]
            signal.fill(inputs[first : first + height], block)
            first += height
        run.run()
        known, first = np.isfinite(inputs).all(axis=0), 0
        for part, array in zip(parts, out, strict=True):
            rows = run.outputs[first : first + part.rows, :samples]
            array[block] = rows.T if part.back is None else np.matmul(rows.T, part.back)
            if not known.all():
                array[block][~known] = np.nan
            first += part.rows
        idle.append(run)

    for _ in ordered_map(one, [slice(start, start + _BLOCK) for start in range(0, count, _BLOCK)]):
        pass
    return out


class OneByOne:
    """A computation that is given as a function of one sample: the reference, and slow."""

    def __init__(self, inputs: int, outputs: int, sampler: Callable[[], Sample]) -> None:
        """``sampler``: makes a function from (inputs,) to (outputs,) that works in memory of its own."""
        self.inputs, self.outputs = inputs, outputs
        self._sampler = sampler

    def run_of(self, count: int) -> Run:
        """Memory for that many samples at a time."""
        return _Loop(np.zeros((self.inputs, count)), np.zeros((self.outputs, count)), self._sampler())


@dataclass(frozen=True, slots=True, eq=False)
class _Loop:
    inputs: FloatArray
    outputs: FloatArray
    sample: Sample

    def run(self) -> None:
        """Compute the outputs."""
        for k in range(self.inputs.shape[1]):
            self.outputs[:, k] = self.sample(np.ascontiguousarray(self.inputs[:, k]))


def checked(program: Batched, reference: Batched) -> Batched:
    """The program, if it gives what the reference gives at a few samples without a pattern; else the reference."""
    fast, slow = program.run_of(5), reference.run_of(5)
    squares = np.arange(1.0, 5.0 * program.inputs + 1.0) ** 2
    fast.inputs[:] = slow.inputs[:] = 2.0 * np.cos(squares).reshape(-1, 5)  # numpy.random would have to be imported
    fast.run()
    slow.run()
    close = np.abs(fast.outputs - slow.outputs) <= _AGREE * max(1.0, float(np.abs(slow.outputs).max(initial=0.0)))
    return program if close.all() else reference
