"""Gear ripple: waves of torque over position, beside what each stretch of motion has of its own.

A slow stroke covers few periods of a gear's ripple, or a part of one, so that its mean holds some of it. The ripple is
the same in every stroke at that place: blocks of one stroke and repeated strokes do not show it as scatter, and the
standard error of the point is too small. Other strokes that pass the same places tell it: the waves are fitted to all
stretches of a joint together, each with a parabola of its own for gravity and friction. In sections they are taken off
the effort; in settled motion they correct the residual, where time left out confirms them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.data.friction_result import RippleWave
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.friction.sections import Section
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.torque_table.block_sums import estimate, explained, products_of, solutions

#: Slower waves have the shape of gravity and of cables; faster ones average out within the slowest strokes.
_FEWEST_CYCLES, _MOST_CYCLES = 40, 800
#: Positions are put into bins so wide to look for waves, and the transform is so many times as long: cycles a turn need
#: not be whole.
_BIN_RAD, _PADDED = 1e-3, 4
#: Two waves differ by so much phase over the travel at least; a step of their fit turns that phase by no more, rad.
_APART, _MOST_SHIFT = 4.0, 1.0
_MOST_WAVES = 6
#: A wave counts from this many standard errors, stretches being the clusters, of the larger of its two directions. The
#: largest of hundreds of waves of noise reaches four.
SURE = 6.0
_MOST_SAMPLES = 12_000
#: Samples that a stretch's own parabola takes up: one of no more has nothing to say of waves.
_PARABOLA = 3
_FEWEST_STRETCHES, _LEAST_TRAVEL_RAD = 8, 0.2


@dataclass(frozen=True, slots=True, eq=False)
class GearRipple:
    """Waves of one joint's torque over its position, for each direction.

    Attributes:
        cycles: (w,) 1/rad.
        coefficients: (2, 2w) in the unit of the effort: cosines and sines forward, then backward.
        covariance: (5w, 5w) of both directions' coefficients, then of the cycles.
    """

    cycles: FloatArray
    coefficients: FloatArray
    covariance: FloatArray

    @property
    def waves(self) -> tuple[RippleWave, ...]:
        """Each with what is the same both ways, what turns with the motion, and its error."""
        w, error, out = self.cycles.size, np.diagonal(self.covariance), list[RippleWave]()
        for k, cycles in enumerate(self.cycles):
            (ahead, back), own = self.coefficients[:, [k, w + k]], [k, w + k, 2 * w + k, 3 * w + k]
            same, against = (0.5 * (ahead + back)).tolist(), (0.5 * (ahead - back)).tolist()
            sd_nm = float(np.sqrt(np.mean(error[own])))
            out.append(RippleWave(float(cycles), (same[0], same[1]), (against[0], against[1]), sd_nm))
        return tuple(out)

    def columns(self, position: FloatArray, side: IntArray) -> FloatArray:
        """(n, 4w) derivatives by the coefficients; side (n,) is 1 of backward motion."""
        return _sided(_waves(position, self.cycles), side)

    def gradient(self, position: FloatArray, velocity: float) -> FloatArray:
        """(5w,) derivative of the waves' mean over these positions by coefficients and cycles."""
        side = np.full(position.size, 0 if velocity > 0 else 1)
        waves = _waves(position, self.cycles)
        parts = [_sided(waves, side), _by_cycles(position, side, waves, self.coefficients)]
        return np.asarray(np.concatenate(parts, axis=1).mean(axis=0))

    def sd(self, gradient: FloatArray) -> float:
        """Standard error of what has this derivative."""
        return float(np.sqrt(max(float(gradient @ self.covariance @ gradient), 0.0)))


def section_ripple(series: UniformSeries, sections: Sequence[Section], j: int) -> GearRipple | None:
    """Waves that the sections of one joint have in common; None where none is sure.

    Args:
        series: the log on its uniform time base.
        sections: of the joint.
        j: its column.
    """
    step = max(1, sum(len(s.span) for s in sections) // _MOST_SAMPLES)
    sections = [s for s in sections if len(s.span) > _PARABOLA * step]
    if not sections or series.effort is None:
        return None
    rows = [np.arange(s.span.start, s.span.stop, step) for s in sections]
    section, at = np.repeat(np.arange(len(sections)), [r.size for r in rows]), np.concatenate(rows)
    side = np.array([int(s.velocity_rad_s < 0) for s in sections])[section]
    return gear_ripple(series.position_rad[at, j], series.effort[at, j], section, side)


def gear_ripple(
    position: FloatArray, torque: FloatArray, stretch: IntArray, side: IntArray, sure: float = SURE
) -> GearRipple | None:
    """Waves that stretches of motion have in common; None where none is sure.

    Args:
        position, torque: (n,) of a joint.
        stretch: (n,) number of each sample's stretch, from 0 on, rising.
        side: (n,) 1 of backward motion, else 0.
        sure: standard errors from which a wave counts.
    """
    if stretch[-1] + 1 < _FEWEST_STRETCHES or np.ptp(position) < _LEAST_TRAVEL_RAD:
        return None
    return _fitted(_Samples.of(position, torque, stretch, side), sure)


def ripple_torque(waves: Sequence[RippleWave], position_rad: FloatArray, velocity: FloatArray | float) -> FloatArray:
    """(n,) torque of the waves, N·m; at rest only the part that is the same both ways."""
    out = np.zeros(position_rad.shape)
    direction = np.sign(velocity)
    for wave in waves:
        angle = wave.cycles_per_turn * position_rad
        out += (wave.same_nm[0] + wave.against_nm[0] * direction) * np.cos(angle)
        out += (wave.same_nm[1] + wave.against_nm[1] * direction) * np.sin(angle)
    return out


def without_ripple(
    series: UniformSeries, effort: FloatArray, sections: Sequence[Section], j: int, ripple: GearRipple | None
) -> FloatArray:
    """(n,) effort without the waves of joint j, in its sections."""
    if ripple is None:
        return effort
    effort = effort.copy()
    for section in sections:
        rows = section.span.slice
        effort[rows] -= ripple_torque(ripple.waves, series.position_rad[rows, j], section.velocity_rad_s)
    return effort


@dataclass(frozen=True, slots=True, eq=False)
class _Samples:
    """Samples: position, torque without each stretch's parabola, number of the stretch, side (1 of backward ones).

    ``basis`` (n, 3) is that of the parabolas.
    """

    position: FloatArray
    effort: FloatArray
    section: IntArray
    side: IntArray
    basis: FloatArray

    @classmethod
    def of(cls, position: FloatArray, effort: FloatArray, section: IntArray, side: IntArray) -> _Samples:
        """Parabolas over each section, and the effort without its own."""
        low, high = (each.reduceat(position, _starts(section))[section] for each in (np.minimum, np.maximum))
        x = (2.0 * position - low - high) / np.maximum(high - low, 1e-12)
        whole = cls(position, effort, section, side, np.stack([np.ones_like(x), x, x * x], axis=1))
        return replace(whole, effort=whole.without_parabolas(effort[:, None])[:, 0])

    def without_parabolas(self, columns: FloatArray) -> FloatArray:
        """(n, k) columns less what the parabola of each section explains of them."""
        basis = np.column_stack([self.basis, columns])
        sums = products_of(basis[:, None], self.section)[:, 0]
        picks = ([0, 1, 2, k] for k in range(3, sums.shape[1]))
        own = np.stack([solutions(sums[:, pick][..., pick], (0, 1, 2))[0] for pick in picks], axis=2)
        return np.asarray(columns - np.einsum("np,npk->nk", self.basis, own[self.section]))


def _starts(section: IntArray) -> IntArray:
    """(s,) first sample of each section."""
    return np.searchsorted(section, np.arange(int(section[-1]) + 1))


def _fitted(data: _Samples, sure: float) -> GearRipple | None:
    """One wave after the other, all of them fitted again with each; the last that is not sure is dropped."""
    found: GearRipple | None = None
    cycles, left = np.empty(0), data.effort
    for _ in range(_MOST_WAVES):
        fresh = _strongest_wave(data, left)
        if fresh is None or np.any(np.abs(cycles - fresh) * np.ptp(data.position) < _APART):
            break
        ripple, left = _solved(data, np.append(cycles, fresh))
        if not _is_sure(ripple, sure):
            break
        found, cycles = ripple, ripple.cycles
    return found


def _solved(data: _Samples, cycles: FloatArray) -> tuple[GearRipple, FloatArray]:
    """Least squares on sums by section (Gauss and Newton for the cycles), and what is left."""
    w = cycles.size
    for _ in range(2):
        waves = _waves(data.position, cycles)
        linear = data.without_parabolas(_sided(waves, data.side))
        coefficients = explained(linear.T @ linear, linear.T @ data.effort[:, None], np.zeros(1))[0].reshape(2, 2 * w)
        left = data.effort - linear @ coefficients.ravel()
        by_cycles = data.without_parabolas(_by_cycles(data.position, data.side, waves, coefficients))
        sums = products_of(np.column_stack([linear, by_cycles, left])[:, None], data.section)
        found = estimate(
            sums, np.bincount(data.section).astype(np.float64)[:, None], np.arange(5 * w)[None], np.zeros(5 * w)
        )
        most = _MOST_SHIFT / float(np.ptp(data.position))
        ripple = GearRipple(cycles, coefficients, found.covariance)
        cycles = cycles + np.clip(found.value[4 * w :], -most, most)
    return ripple, left


def _is_sure(ripple: GearRipple, sure: float) -> bool:
    """Whether the last wave stands clear of its standard error, in one direction at least."""
    w = ripple.cycles.size
    last = np.array([w - 1, 2 * w - 1])
    variance = np.diagonal(ripple.covariance)[: 4 * w].reshape(2, 2 * w)
    size, error = np.sum(ripple.coefficients[:, last] ** 2, axis=1), 0.5 * np.sum(variance[:, last], axis=1)
    return bool(np.any(size > sure**2 * error))


def _strongest_wave(data: _Samples, left: FloatArray) -> float | None:
    """1/rad of the wave that explains most of (n,) what is left (Fourier transform over bins of position)."""
    place = ((data.position - data.position.min()) / _BIN_RAD).astype(np.int64)
    bins = int(place.max()) + 1
    length = 1 << int(np.ceil(np.log2(_PADDED * bins)))
    cycles = 2.0 * np.pi * np.fft.rfftfreq(length, _BIN_RAD)
    looked = (cycles >= _FEWEST_CYCLES) & (cycles <= _MOST_CYCLES)
    if not looked.any():
        return None
    explained_by = np.zeros(cycles.size)
    for here in (data.side == 1, data.side == 0):
        if here.any():
            total = np.bincount(place[here], weights=left[here], minlength=bins)
            explained_by += np.abs(np.fft.rfft(total, length)) ** 2 / np.count_nonzero(here)
    return float(cycles[int(np.argmax(np.where(looked, explained_by, -1.0)))])


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
