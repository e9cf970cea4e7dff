"""The sample clock behind bad stamps: position increments over velocity are multiples of a steady period.

A controller samples evenly; a PC that stamps the packets on arrival does not, and packets get lost. Between two samples
a joint moves dq = v·dt, so dq / v tells how much time passed, whatever the stamps say. Where that is a whole number of
one period, step after step, the period and the lost samples are known. Where the arm stands, or the evidence is weak,
nothing is claimed.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from collaudit.core.data.joint_log import MOVING_RAD_S
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, run_bounds
from collaudit.core.numeric.stats import median_of, robust_sd

#: Robust spread of the steps about whole periods, in periods: stamps this good need no help.
_STEADY = 0.1
#: The motion must tell each step at least this well, in periods, and this much better than the stamps.
_SHARP, _BETTER = 0.12, 0.4
_LEAST_STEPS = 200
#: More equal stamps than this share are no messages sent twice but a clock too coarse.
_MOST_ALIKE = 0.02
#: Steps further than this from a whole number of periods are left to the stamps.
_UNCLEAR = 0.35
#: Longer holes are measured by the stamps: velocity at their ends says too little of what lies between.
_MOST_PERIODS = 8
#: Velocity and position of a joint must agree this well over the log to be believed as its clock.
_GAIN = (0.7, 1.4)
#: Samples whose median deviation places a stretch without evidence.
_LEVEL = 200


@dataclass(frozen=True, slots=True, eq=False)
class MotionClock:
    """Stamps rebuilt from the motion.

    Attributes:
        stamps_s: (n,) a whole number of periods apart; aligned with the recorded stamps in the median.
        period_s: the period, in the recorded clock's seconds.
        jitter_s: robust standard deviation of the recorded stamps about the rebuilt ones, s.
    """

    stamps_s: FloatArray
    period_s: float
    jitter_s: float


def motion_clock(
    stamps: FloatArray, position: FloatArray, velocity: FloatArray | None, rows: IntArray | None = None
) -> MotionClock | None:
    """Rebuild the clock of samples whose stamps scatter.

    Args:
        stamps: (n,) as recorded, s, not descending.
        position: (m, j) rad, continued over wraps.
        velocity: (m, j) rad/s as logged, or None.
        rows: (n,) of position and velocity that the stamps are of, all without; picked only where stamps scatter.

    Returns:
        The clock; None where the motion does not show one, or the stamps are steady and need none.
    """
    steps = np.diff(stamps)
    if steps.size < _LEAST_STEPS:
        return None
    usual = median_of(steps)
    usual = usual if usual > 0.0 else float(np.mean(steps))
    if usual <= 0.0 or (_off_comb(steps / usual) <= _STEADY and np.mean(steps <= 0.0) <= _MOST_ALIKE):
        return None
    if velocity is None:  # nothing to compare positions with
        return None
    if rows is not None:
        position, velocity = position[rows], velocity[rows]
    passed, speed = _passed_s(steps, position, velocity)
    usable = np.isfinite(passed) & (speed > MOVING_RAD_S)
    if np.count_nonzero(usable) < _LEAST_STEPS:  # the arm moves too little
        return None
    # the faster half tells the period best
    clear = usable & (speed >= float(np.median(speed[usable])))
    period, spread = _period(passed[clear])
    if not spread <= _SHARP:  # no multiples of one period
        return None
    ratio = passed[clear] / period
    whole = np.round(ratio)
    if _typical(ratio - whole) > _BETTER * _typical(steps[clear] / period - whole):  # the stamps fit as well
        return None
    counts, determined = _counts(passed, steps, period, usable)
    return _rebuilt(stamps, counts, determined)


def _off_comb(ratio: FloatArray) -> float:
    """Robust spread of numbers about the nearest whole ones; about 0.37 for numbers of no such kind."""
    return robust_sd(ratio - np.round(ratio))


def _typical(deviation: FloatArray) -> float:
    """Root mean square of deviations, in periods, none counted as more than one."""
    return float(np.sqrt(np.mean(np.minimum(np.abs(deviation), 1.0) ** 2)))


def _passed_s(steps: FloatArray, position: FloatArray, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n - 1,) time between samples by the motion of all joints, s, and their joint speed, rad/s.

    Weighted least squares of dq = v·dt over the joints, each velocity in the scale that the whole log gives it.
    """
    moved = np.diff(position, axis=0)
    mean = 0.5 * (velocity[1:] + velocity[:-1])
    mean = np.where(np.isfinite(moved + mean), mean, 0.0)
    moved = np.where(mean == 0.0, 0.0, moved)
    top, power = np.zeros(steps.size), np.zeros(steps.size)
    for j in range(position.shape[1]):
        v, dq = mean[:, j], moved[:, j]
        strength = float(np.sum(v * v * steps))
        gain = float(v @ dq) / strength if strength > 0.0 else 0.0
        if _GAIN[0] < gain < _GAIN[1]:
            top += v * dq / gain
            power += v * v
    with np.errstate(invalid="ignore", divide="ignore"):
        passed = np.where(power > 0.0, top / power, np.nan)
    return passed, np.sqrt(power)


def _period(passed: FloatArray) -> tuple[float, float]:
    """The period that times are multiples of, s, and their spread about its multiples, in periods."""
    period = float(np.median(passed))
    for _ in range(5):
        if period == 0.0:  # most samples do not move
            return period, float("inf")
        whole = np.round(passed / period)
        use = (whole >= 1) & (whole <= _MOST_PERIODS) & (np.abs(passed / period - whole) < _UNCLEAR)
        if not use.any():
            return period, float("inf")
        period = float(np.median(passed[use] / whole[use]))
    return period, _off_comb(passed / period)


def _counts(passed: FloatArray, steps: FloatArray, period: float, usable: BoolArray) -> tuple[IntArray, BoolArray]:
    """(n - 1,) whole periods in each step, at least 0, and whether the motion tells them."""
    ratio = np.where(usable, passed / period, 1.0)
    whole = np.round(ratio)
    long = usable & (ratio > _MOST_PERIODS)
    stamped = np.round(steps / period)
    whole = np.where(long, np.maximum(stamped, 1.0), whole)
    determined = usable & (whole >= 0) & (np.abs(ratio - whole) < _UNCLEAR) & ~long
    whole = np.where(determined | long, whole, 1.0)
    return whole.astype(np.int64), determined


def _rebuilt(stamps: FloatArray, counts: IntArray, determined: BoolArray) -> MotionClock | None:
    """Stamps from the counts; stretches that the motion does not tell are placed by the recorded stamps."""
    places = np.concatenate(([0.0], np.cumsum(counts, dtype=np.float64)))
    starts, stops = run_bounds(determined)
    spans = list(zip(starts.tolist(), (stops + 1).tolist(), strict=True))
    places += _lost_unseen(stamps, places, determined, pooled_period(stamps, places, spans))
    period = pooled_period(stamps, places, spans)
    off = stamps - period * places
    off -= np.median(off)
    jitter = robust_sd(off)
    # an even clock may not be off for seconds; where nothing moves, where a sample was lost makes no difference
    told = off[1:][determined]
    # jitter averages out over two hundred samples, a wrong count does not
    parts = np.array_split(told, max(1, told.size // _LEAST_STEPS))
    if max(abs(float(np.median(part))) for part in parts) > 3.0 * max(period, robust_sd(np.diff(off))):
        return None
    return MotionClock(stamps - off, period, jitter)


def _lost_unseen(stamps: FloatArray, places: FloatArray, determined: BoolArray, period: float) -> FloatArray:
    """(n,) samples lost so far in stretches that the motion does not tell, by how far the stamps went on there."""
    off = stamps - period * places
    added = np.zeros(stamps.size)
    starts, stops = run_bounds(~determined)
    if not starts.size:
        return added
    level, shift = float(np.median(off[: max(int(starts[0]), _LEVEL)])), 0
    scatter = robust_sd(np.diff(off)) / np.sqrt(2.0)
    for a, b in zip(starts, stops, strict=True):
        after = off[b : b + _LEVEL]
        late = float(np.median(after)) - shift * period - level
        lost = round(late / period)
        if lost >= 1 and late > max(0.7 * period, 4.0 * scatter / np.sqrt(after.size)):
            shift += lost
            many, few = divmod(lost, int(b - a))  # at the steps that the stamps say are the longest
            order = np.argsort(stamps[a:b] - stamps[a + 1 : b + 1], kind="stable")
            added[a + 1 : b + 1] += many
            added[a + 1 + order[:few]] += 1
    return np.asarray(np.cumsum(added))


def pooled_period(stamps: FloatArray, places: FloatArray | IntArray, spans: Iterable[tuple[int, int]]) -> float:
    """Stamp against place by least squares, each stretch (start, stop) of samples with an origin of its own, s."""
    top = bottom = 0.0
    for start, stop in spans:
        x = places[start:stop] - np.mean(places[start:stop])
        top, bottom = top + float(x @ stamps[start:stop]), bottom + float(x @ x)
    return top / bottom


def clock_findings(clock: MotionClock, fresh: BoolArray) -> list[Finding]:
    """What was rebuilt and from what; (n,) samples that are no copy of the one before."""
    lost = int(np.sum(np.round(np.diff(clock.stamps_s[fresh]) / clock.period_s) - 1.0))
    text = (
        f"Stamps scatter by {1e3 * clock.jitter_s:.2g} ms (robust standard deviation), but positions advance by "
        f"velocity times whole multiples of {1e3 * clock.period_s:.6g} ms: the times were rebuilt from that "
        f"clock, with {lost} samples lost."
    )
    findings = [fact(text)]
    repeated = int(fresh.size - np.count_nonzero(fresh))
    if repeated:
        text = f"{repeated} samples repeat the one before while the arm moves and were left out (the first was kept)."
        findings.append(Finding("time-duplicate", "warning", text))
    return findings
