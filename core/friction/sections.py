"""Constant-velocity sections: where M·ddq and C·dq vanish and effort is gravity and friction (eq. 12)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from collaudit.core.config.schema import SectionsConfig
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span, centred_extremes, run_bounds
from collaudit.core.numeric.filters import low_pass
from collaudit.core.numeric.parallel import Progress
from collaudit.core.numeric.stats import median_of
from collaudit.core.torque_table.log_samples import settled

#: Above this speed another joint counts as moving (rad/s; m/s if prismatic), as its pose changes.
_MOVING_RAD_S = 0.01
#: Speeds are compared after this low-pass: encoder steps at slow speeds are not speed changes.
_SECTION_BANDWIDTH_HZ = 5.0
#: A speed is constant within so many standard deviations of its own noise, which is no change; but no more of it.
_NOISE_SDS, _NOISE_SHARE = 4.0, 0.2
#: Speeds are constant that stay within this share of their mean, or within this of it where that is more, rad/s.
SPEED_TOLERANCE, SPEED_TOLERANCE_RAD_S = 0.05, 0.003
#: Shorter stretches are no sections, s; and what is taken off each end, where motion has not settled, s: of
#: cruises of a second and more, most is left.
MIN_DURATION_S, SETTLE_S = 0.15, 0.1
#: Standard deviation of noise over the median of its |third differences|: 1.4826 / sqrt(20).
_SD_PER_THIRD_DIFFERENCE = 0.3315
#: Most of a stretch that either end loses to settling, beyond the half of ``SETTLE_S`` that is always taken off.
_SETTLING_SHARE = 0.125


@dataclass(frozen=True, slots=True)
class Section:
    """A constant-velocity stretch of one joint.

    Attributes:
        joint: joint name.
        span: samples on the uniform time base, settling margins already taken off.
        velocity_rad_s: mean, signed.
        position_rad: lowest and highest position.
        others_moving: joints that moved meanwhile.
    """

    joint: str
    span: Span
    velocity_rad_s: float
    position_rad: tuple[float, float]
    others_moving: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SectionSet:
    """Sections of all joints of a log, and by joint how many stretches of motion are none, by reason."""

    sections: tuple[Section, ...]
    rejected: Mapping[str, Counter[str]]

    def of(self, joint: str) -> tuple[Section, ...]:
        """Sections of one joint."""
        return tuple(s for s in self.sections if s.joint == joint)

    def known_in(self, series: UniformSeries) -> SectionSet:
        """The sections of the same log with less effort known: whole ones, and pieces that are long enough."""
        found: list[Section] = []
        for section in self.sections:
            j = series.column(section.joint)
            pieces = _known_pieces(section.span, series, j, _least(series))
            whole = pieces == [section.span]
            found += [section] if whole else [_measure(series, section.joint, j, piece) for piece in pieces]
        return replace(self, sections=tuple(found))


def find_sections(series: UniformSeries, config: SectionsConfig, progress: Progress | None = None) -> SectionSet:
    """Segment every joint's motion into constant-velocity sections.

    A section is a gap-free stretch of one direction in which the speed stays within
    max(0.05 · speed, 0.003 rad/s), more where its own noise is larger, of its median for at least
    ``MIN_DURATION_S`` after settling is taken off both ends, where effort is known: an eighth of the stretch,
    ``SETTLE_S`` at most and half of it at least. What lies just after a reversal is none: friction is not that of
    sliding there. ``progress`` is called with joints done and in all.

    Returns:
        Sections, and how many stretches of motion are none, by reason.
    """
    bandwidth = min(_SECTION_BANDWIDTH_HZ, series.bandwidth_hz)
    smooth = low_pass(series.velocity_rad_s, series.segments, series.period_s, bandwidth)

    sections: list[Section] = []
    rejected: dict[str, Counter[str]] = {joint: Counter() for joint in series.joint_names}
    for j, joint in enumerate(series.joint_names):  # not in threads: short calls, section by section
        logged = series.raw_velocity_rad_s
        noise = 0.0 if logged is None else _noise(logged[:, j], 2.0 * bandwidth * series.period_s)
        quiet = _quiet(smooth[:, j], _least(series), noise)
        slid, _ = settled(series.segments, series.position_rad[:, j], smooth[:, j], config.min_speed_rad_s)
        for span in _moving_spans(smooth[:, j], slid, series.segments, config.min_speed_rad_s):
            found, lost = _split(smooth[:, j], quiet, span, series, j, noise)
            sections += [_measure(series, joint, j, s) for s in found]
            rejected[joint].update(lost)
        if progress is not None:
            progress(j + 1, len(series.joint_names))
    return SectionSet(tuple(sections), rejected)


def _moving_spans(v: FloatArray, slid: BoolArray, segments: Sequence[Span], min_speed: float) -> list[Span]:
    """Stretches of one direction, faster than ``min_speed``, that the joint ``slid`` far enough for, in one segment."""
    spans = []
    for segment in segments:
        part, far = v[segment.slice], slid[segment.slice]
        for mask in (far & (part >= min_speed), far & (part <= -min_speed)):
            bounds = zip(*run_bounds(mask), strict=True)
            spans += [Span(segment.start + int(a), segment.start + int(b)) for a, b in bounds]
    return sorted(spans)


def _least(series: UniformSeries) -> int:
    """Samples of a section at least."""
    return ceil(MIN_DURATION_S / series.period_s)


def _noise(v: FloatArray, passed: float) -> float:
    """Standard deviation of a logged speed's noise behind a low-pass that passes this share of white noise's power."""
    steps = np.abs(np.diff(v, n=3))
    known = steps[np.isfinite(steps) & (steps > 0)]
    return _SD_PER_THIRD_DIFFERENCE * median_of(known) * min(1.0, passed) ** 0.5 if known.size else 0.0


def _quiet(v: FloatArray, least: int, noise: float) -> BoolArray:
    """(n,) where the speed is constant over the ``least`` samples about each; not told where some of them are unknown.

    Once for a joint: stretch by stretch, calls would take longer than what they do.
    """
    bottom, top = centred_extremes(v, least)
    middle = 0.5 * (top + bottom)
    return np.asarray(top - bottom <= 2.0 * _tolerance(np.abs(middle), noise))


def _split(
    v: FloatArray, quiet: BoolArray, span: Span, series: UniformSeries, j: int, noise: float
) -> tuple[list[Span], list[str]]:
    """Sections inside one stretch of motion, and what was rejected of it."""
    least = _least(series)
    if len(span) < least + 2 * _settling(len(span), series):
        return [], ["too short"]
    part = v[span.slice]
    plateaus = _plateaus(part, quiet[span.slice], least, noise)
    if not plateaus:
        return [], ["speed not constant"]
    found: list[Span] = []
    lost: list[str] = []
    for start, stop in plateaus:
        whole = Span(span.start + start, span.start + stop)
        settle = _settling(len(whole), series)
        if len(whole) < least + 2 * settle:
            lost.append("too short after settling")
            continue
        inner = Span(whole.start + settle, whole.stop - settle)
        pieces = _known_pieces(inner, series, j, least)
        if not pieces:
            lost.append("effort missing")
        for piece in pieces:
            if series.saturated[piece.slice, j].any():
                lost.append("effort saturated")
            elif not np.isfinite(series.position_rad[piece.slice]).all():
                lost.append("position missing")
            else:
                found.append(piece)
    return found, lost


def _known_pieces(inner: Span, series: UniformSeries, j: int, least: int) -> list[Span]:
    """Parts of a section in which the effort is known, long enough to be sections: what was left out cuts it."""
    if series.effort is None:
        return []
    starts, stops = run_bounds(np.isfinite(series.effort[inner.slice, j]))
    return [
        Span(inner.start + int(a), inner.start + int(b)) for a, b in zip(starts, stops, strict=True) if b - a >= least
    ]


def _settling(length: int, series: UniformSeries) -> int:
    """Samples taken off each end: of a short stretch less, since logs of fast motion have no others."""
    half, whole = (ceil(share * SETTLE_S / series.period_s) for share in (0.5, 1.0))
    return min(whole, max(half, ceil(_SETTLING_SHARE * length)))


def _tolerance(speed: FloatArray, noise: float) -> FloatArray:
    """How far speeds (n,) may be off their mean and count as constant."""
    own = np.minimum(_NOISE_SDS * noise, _NOISE_SHARE * speed)
    return np.asarray(np.maximum(np.maximum(SPEED_TOLERANCE * speed, SPEED_TOLERANCE_RAD_S), own))


def _plateaus(part: FloatArray, quiet: BoolArray, least: int, noise: float) -> list[tuple[int, int]]:
    """Longest stretches of constant speed: seeded by windows of ``least`` samples, grown about their median."""
    half = least // 2
    starts, stops = run_bounds(quiet[half : part.size - half])  # of windows that lie inside
    starts, stops = starts + half, stops + half
    found: list[tuple[int, int]] = []
    free_from = 0
    for a, b in zip(starts, stops, strict=True):
        seed = slice(max(int(a) - half, free_from), int(b) + half)
        if seed.stop - seed.start < least:
            continue
        start, stop = _grow(part, seed, noise)
        start = max(start, free_from)
        if stop - start >= least:
            found.append((start, stop))
            free_from = stop
    return found


def _grow(part: FloatArray, seed: slice, noise: float) -> tuple[int, int]:
    """The longest run about the seed's median speed that stays within tolerance of it."""
    middle = median_of(part[seed])
    starts, stops = run_bounds(np.abs(part - middle) <= _tolerance(np.abs(middle), noise))
    overlap: IntArray = np.minimum(stops, seed.stop) - np.maximum(starts, seed.start)
    if overlap.size == 0 or overlap.max() <= 0:
        return seed.start, seed.start
    best = int(np.argmax(overlap))
    return int(starts[best]), int(stops[best])


def _measure(series: UniformSeries, joint: str, j: int, span: Span) -> Section:
    s = span.slice
    velocity, position = series.velocity_rad_s[s, j], series.position_rad[s, j]
    motion = series.velocity_rad_s[s]
    if not np.isfinite(motion.sum()):
        motion = np.nan_to_num(motion)
    fastest = np.max(np.abs(motion), axis=0)
    others = tuple(name for k, name in enumerate(series.joint_names) if k != j and fastest[k] > _MOVING_RAD_S)
    return Section(
        joint=joint,
        span=span,
        velocity_rad_s=float(np.mean(velocity)),
        position_rad=(float(np.min(position)), float(np.max(position))),
        others_moving=others,
    )
