"""Drives that were switched off, told from the signals: efforts of all joints zero under load, or the same for ever.

A drive that holds or moves an arm has an effort that is never even. Where the efforts of all joints are zero although
gravity pulls, or repeat exactly while the arm rests, brakes hold it, or nothing is measured: nobody can tell whether
anything touches the arm. The ramp to standstill that ends there is the braking, and belongs to it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, log, sqrt

import numpy as np

from collaudit.core.data.joint_log import MOVING_RAD_S, UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span, run_bounds, widened
from collaudit.core.numeric.stats import bend_of, noise_of, quantile_of, varies
from collaudit.core.torque_table.log_samples import thinned

#: Efforts below this share of their usual size are zero; the load that they do not bear is this many times larger.
_ZERO_SHARE, _LOAD_TIMES = 0.02, 5.0
#: Samples that a usual size is told from.
_DRAWN = 100_000
#: Zero for this long, or the same for this long, s.
_ZERO_S, _SAME_S = 0.1, 0.3
#: With fewer joints all efforts pass zero together by the arm's motion: there, zero is a value that repeats.
_MANY_JOINTS = 3
#: Repeats in a row that chance makes less often than this, and this many times the usual.
_CHANCE, _TIMES = 1e-6, 5.0
#: Between standstill and power off, s; longest braking, s.
_REST_S, _BRAKING_S = 0.2, 2.0
#: The speed of a ramp may rise again by this much, rad/s: encoder noise.
_RIPPLE_RAD_S = 0.01
#: Fewest means in motion that tell what share of the load is in the effort.
_FEWEST_MOVING = 5
#: Braking is as steep as this share of the steepest of the ramp; its slope is told over this time, s.
_STEEP, _SLOPE_S = 0.3, 0.02


@dataclass(frozen=True, slots=True)
class DrivesOff:
    """One stretch without drives.

    Attributes:
        span: samples, the braking before it included.
        off: samples in which the efforts tell it.
        braked: whether the arm was moving when the drives went off.
        zero: whether the efforts are zero; else they repeat.
    """

    span: Span
    off: Span
    braked: bool
    zero: bool


def drives_off(series: UniformSeries, rigid_nm: FloatArray | None) -> list[DrivesOff]:
    """Stretches in which the drives were off, with the braking before them.

    Args:
        series: all joints of the log.
        rigid_nm: (n, j) model torque; without it only repeated efforts tell.
    """
    if series.effort is None or series.effort.shape[1] == 0:
        return []
    effort, rigid_nm = _alive(series.effort, rigid_nm)
    speed = _fastest(series.velocity_rad_s)
    same = np.append(False, (effort[1:] == effort[:-1]).all(axis=1))  # every effort is that of the sample before
    exact = same & (effort == 0.0).all(axis=1)
    zero = np.asarray(_zero(effort, same, rigid_nm) | (exact & (speed >= MOVING_RAD_S)))
    zero |= noisy_zero(effort, rigid_nm, speed < MOVING_RAD_S, series.period_s, zero)
    out: list[DrivesOff] = []
    for spans, is_zero in ((_long(zero, _ZERO_S, series.period_s), True), (_repeated(series, same, speed), False)):
        for off in spans:
            if any(known.off.start < off.stop and off.start < known.off.stop for known in out):
                continue
            start = _braking(speed, off.start, series)
            braked = start < off.start or float(speed[off.start]) >= MOVING_RAD_S
            out.append(DrivesOff(Span(start, off.stop), off, braked, is_zero))
    return sorted(out, key=lambda found: found.span.start)


def braking_before(series: UniformSeries, state: Span) -> int:
    """First sample of the braking that ends in a state without drives; that of the state where it ends in motion."""
    speed = _fastest(series.velocity_rad_s)
    stands = float(speed[state.stop - 1]) < MOVING_RAD_S
    return _braking(speed, state.start, series) if stands else state.start


def _alive(effort: FloatArray, rigid_nm: FloatArray | None) -> tuple[FloatArray, FloatArray | None]:
    """Both without joints whose effort is one value all through the log; whole where that is every joint.

    Such a channel is dead, which is a finding of its own; what it does not bear says nothing of the drives.
    """
    alive = np.flatnonzero(varies(effort))
    if alive.size in (0, effort.shape[1]):
        return effort, rigid_nm
    return np.asfortranarray(effort[:, alive]), None if rigid_nm is None else np.asfortranarray(rigid_nm[:, alive])


def _fastest(velocity: FloatArray) -> FloatArray:
    """(n,) speed of the fastest joint; unknown ones count as standing."""
    out = np.zeros(len(velocity))
    for own in velocity.T:
        np.fmax(out, np.abs(own), out=out)
    return out


def _zero(effort: FloatArray, same: BoolArray, rigid_nm: FloatArray | None) -> BoolArray:
    """(n,) samples at which no joint has an effort although some joint has a load."""
    known = np.flatnonzero(np.isfinite(effort).any(axis=0))
    none = np.zeros(effort.shape[0], dtype=np.bool_)
    if rigid_nm is None or not known.size:
        return none
    limit = _ZERO_SHARE * _usual(effort)[known]
    none = np.logical_and.reduce([np.abs(effort[:, j]) <= most for j, most in zip(known, limit, strict=True)])
    if np.count_nonzero(limit > 0) < _MANY_JOINTS:
        none &= same
    if none.any():
        load = np.maximum(_LOAD_TIMES * _ZERO_SHARE * _usual(rigid_nm), 1.0)
        none &= np.logical_or.reduce([np.abs(rigid_nm[:, j]) > load[j] for j in known])
    return np.asarray(none)


def _repeated(series: UniformSeries, same: BoolArray, speed: FloatArray) -> list[Span]:
    """Stretches at rest in which all efforts repeat for longer than the log's own repeats explain."""
    still = speed < MOVING_RAD_S
    starts, stops = run_bounds(np.asarray(same & still))
    length = stops - starts
    least = max(10, ceil(_SAME_S / series.period_s))
    if not (length >= least).any():
        return []
    usual = length[length < least]
    repeats, steps = float(usual.sum()), float(np.count_nonzero(~same))
    share = (repeats + 1.0) / (repeats + steps + 2.0)
    bound = max(least, log(steps / _CHANCE + 1.0) / -log(share), _TIMES * float(usual.max(initial=0)))
    return [Span(int(a) - 1, int(b)) for a, b in zip(starts, stops, strict=True) if b - a >= bound]


def _long(mask: BoolArray, least_s: float, period_s: float) -> list[Span]:
    least = max(10, ceil(least_s / period_s))
    return [Span(int(a), int(b)) for a, b in zip(*run_bounds(mask), strict=True) if b - a >= least]


def _braking(speed: FloatArray, off: int, series: UniformSeries) -> int:
    """First sample of the ramp to standstill that ends at ``off`` or just before; ``off`` where there is none."""
    floor = max((segment.start for segment in series.segments if segment.start <= off), default=0)
    near = max(floor, off - ceil(_REST_S / series.period_s))
    moving = np.flatnonzero(speed[near : off + 1] >= MOVING_RAD_S)
    if moving.size == 0:
        return off
    last = near + int(moving[-1])
    first = max(floor, last - ceil(_BRAKING_S / series.period_s))
    back = speed[first : last + 1][::-1]
    falls = np.flatnonzero(back < np.maximum.accumulate(back) - _RIPPLE_RAD_S)
    top = int(np.argmax(back[: falls[0]])) if falls.size else int(np.argmax(back))  # from here on speed only falls
    step = max(1, round(_SLOPE_S / series.period_s))
    ramp = speed[max(floor, last - top) : last + step + 1]
    if ramp.size <= 2 * step:
        return max(floor, last - top)
    slope = ramp[:-step] - ramp[step:]
    return max(floor, last - top) + int(np.argmax(slope > _STEEP * slope.max()))


#: Means are taken over this time, s: brakes take about as long to grip or let go.
_MEAN_S = 0.3
#: A mean is nothing within so many of its standard errors, or within this share of the arm's largest load: sensors
#: have offsets. A loaded joint bears no more than this share of its own load.
_ERRORS, _BIAS, _SHARE = 5.0, 0.05, 0.2
#: Where so many joints are loaded and bear nothing, offsets of others do not count.
_MANY = 2
_MOSTLY = 0.5
#: A joint is loaded with so many times what counts as nothing, and this much at least, N·m.
_NOISY_LOAD_TIMES, _LEAST_NM = 5.0, 1.0


def noisy_zero(
    effort: FloatArray, rigid_nm: FloatArray | None, still: BoolArray, period_s: float, exact: BoolArray | None = None
) -> BoolArray:
    """(n,) samples of an arm at rest whose efforts are nothing but noise, though gravity pulls.

    Args:
        effort: (n, j), all joints.
        rigid_nm: (n, j) model torque; without it nothing is told.
        still: (n,) the arm stands.
        period_s: sample period, s.
        exact: (n,) samples whose efforts are zero one by one; stretches that are mostly so are left to those.
    """
    none = np.zeros(effort.shape[0], dtype=np.bool_)
    width = max(1, round(_MEAN_S / period_s))
    known = np.flatnonzero(np.isfinite(effort).any(axis=0))
    if rigid_nm is None or effort.shape[0] < 2 * width or not still.any() or not known.size:
        return none
    rest, zero = (
        thinned(mask[:, None].astype(np.float64), width)[:, 0] for mask in (still, none if exact is None else exact)
    )
    mean, load = thinned(effort[:, known], width), np.abs(thinned(rigid_nm[:, known], width))
    usual, borne = _usual(load), np.ones(known.size)
    if np.count_nonzero(rest < 1.0) >= _FEWEST_MOVING:  # amperes that were taken for N·m bear less of the load
        moving = rest < 1.0
        borne = np.minimum(_usual(mean[moving]) / np.maximum(_usual(load[moving]), 1e-12), 1.0)
    columns = (np.ascontiguousarray(effort[:, j]) for j in known)
    noise = np.array([noise_of(x, bend_of(x), still).sd for x in columns])
    limit = np.maximum(_ERRORS * noise / sqrt(width), _BIAS * usual.max() * borne)
    with np.errstate(invalid="ignore"):
        loaded = load > np.maximum(_NOISY_LOAD_TIMES * limit, _LEAST_NM)
        small = np.abs(mean) <= np.where(loaded, np.maximum(limit, _SHARE * borne * load), limit)
    bears = np.count_nonzero(loaded, axis=1)
    nothing = (small | ~(loaded | (bears < _MANY)[:, None])).all(axis=1) & (bears > 0) & (rest == 1.0)
    for a, b in zip(*run_bounds(nothing), strict=True):
        borne_nm = np.abs(mean[a:b].mean(axis=0)).max()  # as on an arm that is mounted otherwise
        none[a * width : b * width] = borne_nm <= _SHARE * usual.max() and np.mean(zero[a:b]) <= _MOSTLY
    return widened(none, width) if none.any() else none


def _usual(x: FloatArray) -> FloatArray:
    """(j,) size of columns (n, j) that is seldom exceeded, of samples drawn evenly; 0 of one that is not known."""
    drawn = x[:: max(1, len(x) // _DRAWN)]
    return np.array([quantile_of(known, 0.95) if (known := np.abs(c[~np.isnan(c)])).size else 0.0 for c in drawn.T])
