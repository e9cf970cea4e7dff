"""Gear ripple in constant-velocity sections: waves over position beside what a slow stroke has of its own.

A slow stroke covers few periods of a gear's ripple, or a part of one, so that its mean holds some of it. The ripple is
the same in every stroke at that place: blocks of one stroke and repeated strokes do not show it as scatter, and the
standard error of the point is too small. Other strokes that pass the same places tell it: the waves are fitted to all
sections of a joint together, each with a parabola of its own for gravity and friction, and taken off the effort.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.friction.sections import Section
from collaudit.core.numeric.arrays import FloatArray, IntArray

#: Slower waves have the shape of gravity and of cables; faster ones average out within the slowest strokes.
_FEWEST_CYCLES, _MOST_CYCLES = 40, 800
#: Positions are put into bins so wide to look for waves, and the transform is so many times as long: cycles a turn need
#: not be whole.
_BIN_RAD, _PADDED = 1e-3, 4
#: Two waves differ by so much phase over the travel at least; a step of their fit turns that phase by no more, rad.
_APART, _MOST_SHIFT = 4.0, 1.0
_MOST_WAVES = 6
#: A wave counts from this many standard errors, sections being the clusters, of the larger of its two directions. The
#: largest of hundreds of waves of noise reaches four.
_SURE = 6.0
_MOST_SAMPLES = 12_000
#: Samples that a section's own parabola takes up: a section of no more has nothing to say of waves.
_PARABOLA = 3
_FEWEST_SECTIONS, _LEAST_TRAVEL_RAD = 8, 0.2


@dataclass(frozen=True, slots=True, eq=False)
class SectionRipple:
    """Waves of one joint's effort over its position, for each direction.

    Attributes:
        cycles: (w,) 1/rad.
        coefficients: (2, 2w) in the unit of the effort: cosines and sines forward, then backward.
        covariance: (5w, 5w) of both directions' coefficients, then of the cycles.
    """

    cycles: FloatArray
    coefficients: FloatArray
    covariance: FloatArray

    def torque(self, position: FloatArray, velocity: float) -> FloatArray:
        """(n,) effort of the waves at positions passed at this signed velocity."""
        return np.asarray(_waves(position, self.cycles) @ self.coefficients[0 if velocity > 0 else 1])

    def gradient(self, position: FloatArray, velocity: float) -> FloatArray:
        """(5w,) derivative of the waves' mean over these positions by coefficients and cycles."""
        side = np.full(position.size, 0 if velocity > 0 else 1)
        waves = _waves(position, self.cycles)
        parts = [_sided(waves, side), _by_cycles(position, side, waves, self.coefficients)]
        return np.asarray(np.concatenate(parts, axis=1).mean(axis=0))

    def sd(self, gradient: FloatArray) -> float:
        """Standard error of what has this derivative."""
        return float(np.sqrt(max(float(gradient @ self.covariance @ gradient), 0.0)))


def section_ripple(series: UniformSeries, sections: Sequence[Section], j: int) -> SectionRipple | None:
    """Waves that the sections of one joint have in common; None where none is sure.

    Args:
        series: the log on its uniform time base.
        sections: of the joint.
        j: its column.
    """
    step = max(1, sum(len(s.span) for s in sections) // _MOST_SAMPLES)
    sections = [s for s in sections if len(s.span) > _PARABOLA * step]
    if len(sections) < _FEWEST_SECTIONS or series.effort is None:
        return None
    rows = [np.arange(s.span.start, s.span.stop, step) for s in sections]
    section = np.repeat(np.arange(len(sections)), [r.size for r in rows])
    at = np.concatenate(rows)
    side = np.array([int(s.velocity_rad_s < 0) for s in sections])[section]
    data = _Samples.of(series.position_rad[at, j], series.effort[at, j], section, side)
    if np.ptp(data.position) < _LEAST_TRAVEL_RAD:
        return None
    return _fitted(data)


def without_ripple(
    series: UniformSeries, effort: FloatArray, sections: Sequence[Section], j: int, ripple: SectionRipple | None
) -> FloatArray:
    """(n, j) effort without the waves of joint j, in its sections."""
    if ripple is None:
        return effort
    effort = effort.copy(order="K")
    for section in sections:
        rows = section.span.slice
        effort[rows, j] -= ripple.torque(series.position_rad[rows, j], section.velocity_rad_s)
    return effort


@dataclass(frozen=True, slots=True, eq=False)
class _Samples:
    """Samples of all sections: position, effort without each section's parabola, section, side (1 of backward ones).

    ``basis`` (n, 3) is that of the parabolas.
    """

    position: FloatArray
    effort: FloatArray
    section: IntArray
    side: IntArray
    basis: FloatArray

    @classmethod
    def of(cls, position: FloatArray, effort: FloatArray, section: IntArray, side: IntArray) -> _Samples:
        """An orthonormal basis of parabolas in each section, and the effort without it."""
        basis = np.empty((position.size, _PARABOLA))
        for rows in np.split(np.arange(position.size), np.flatnonzero(np.diff(section)) + 1):
            x = position[rows] - position[rows].mean()
            x = x / max(float(np.max(np.abs(x))), 1e-12)
            basis[rows] = np.linalg.qr(np.stack([np.ones_like(x), x, x * x], axis=1))[0]
        whole = cls(position, effort, section, side, basis)
        return cls(position, whole.without_parabolas(effort[:, None])[:, 0], section, side, basis)

    def without_parabolas(self, columns: FloatArray) -> FloatArray:
        """(n, k) columns less their projection on the parabolas of each section."""
        starts = np.searchsorted(self.section, np.arange(int(self.section[-1]) + 1))
        out = columns
        for part in self.basis.T:
            along = np.add.reduceat(part[:, None] * columns, starts, axis=0)
            out = out - part[:, None] * along[self.section]
        return out


def _fitted(data: _Samples) -> SectionRipple | None:
    """One wave after the other, all of them fitted again with each; the last that is not sure is dropped."""
    found: SectionRipple | None = None
    cycles, left = np.empty(0), data.effort
    for _ in range(_MOST_WAVES):
        fresh = _strongest(data, left)
        if fresh is None or np.any(np.abs(cycles - fresh) * np.ptp(data.position) < _APART):
            break
        ripple, left = _solved(data, np.append(cycles, fresh))
        if not _sure(ripple):
            break
        found, cycles = ripple, ripple.cycles
    return found


def _solved(data: _Samples, cycles: FloatArray) -> tuple[SectionRipple, FloatArray]:
    """Least squares (Gauss and Newton for the cycles), covariance clustered by section (sandwich), and what is left."""
    w = cycles.size
    for last in (False, True):
        waves = _waves(data.position, cycles)
        linear = data.without_parabolas(_sided(waves, data.side))
        inverse = np.linalg.pinv(linear.T @ linear, hermitian=True)
        coefficients = (inverse @ (linear.T @ data.effort)).reshape(2, 2 * w)
        left = data.effort - linear @ coefficients.ravel()
        by_cycles = data.without_parabolas(_by_cycles(data.position, data.side, waves, coefficients))
        columns = np.concatenate([linear, by_cycles], axis=1)
        inverse = np.linalg.pinv(columns.T @ columns, hermitian=True)
        if not last:
            most = _MOST_SHIFT / float(np.ptp(data.position))
            cycles = cycles + np.clip((inverse @ (columns.T @ left))[4 * w :], -most, most)
    count = int(data.section[-1]) + 1
    starts = np.searchsorted(data.section, np.arange(count))
    score = np.add.reduceat(left[:, None] * columns, starts, axis=0)
    covariance = count / (count - 1.0) * inverse @ (score.T @ score) @ inverse
    return SectionRipple(cycles, coefficients, covariance), left


def _sure(ripple: SectionRipple) -> bool:
    """Whether the last wave stands clear of its standard error, in one direction at least."""
    w = ripple.cycles.size
    last = np.array([w - 1, 2 * w - 1])
    variance = np.diagonal(ripple.covariance)[: 4 * w].reshape(2, 2 * w)
    size, error = np.sum(ripple.coefficients[:, last] ** 2, axis=1), 0.5 * np.sum(variance[:, last], axis=1)
    return bool(np.any(size > _SURE**2 * error))


def _strongest(data: _Samples, left: FloatArray) -> float | None:
    """1/rad of the wave that explains most, directions apart (Fourier transform over bins of position)."""
    place = ((data.position - data.position.min()) / _BIN_RAD).astype(np.int64)
    bins = int(place.max()) + 1
    length = 1 << int(np.ceil(np.log2(_PADDED * bins)))
    cycles = 2.0 * np.pi * np.fft.rfftfreq(length, _BIN_RAD)
    looked = (cycles >= _FEWEST_CYCLES) & (cycles <= _MOST_CYCLES)
    if not looked.any():
        return None
    explained = np.zeros(cycles.size)
    for side in (0, 1):
        here = data.side == side
        if here.any():
            total = np.bincount(place[here], weights=left[here], minlength=bins)
            explained += np.abs(np.fft.rfft(total, length)) ** 2 / np.count_nonzero(here)
    return float(cycles[int(np.argmax(np.where(looked, explained, -1.0)))])


def _waves(position: FloatArray, cycles: FloatArray) -> FloatArray:
    """(n, 2w) cosines, then sines."""
    angle = position[:, None] * cycles
    return np.concatenate([np.cos(angle), np.sin(angle)], axis=1)


def _sided(waves: FloatArray, side: IntArray) -> FloatArray:
    """(n, 4w) derivatives of the waves by the coefficients forward, then backward."""
    back = side[:, None] == 1
    return np.concatenate([np.where(back, 0.0, waves), np.where(back, waves, 0.0)], axis=1)


def _by_cycles(position: FloatArray, side: IntArray, waves: FloatArray, coefficients: FloatArray) -> FloatArray:
    """(n, w) derivatives of the waves by their cycles."""
    w = waves.shape[1] // 2
    own = coefficients[side]
    return np.asarray(position[:, None] * (own[:, w:] * waves[:, :w] - own[:, :w] * waves[:, w:]))
