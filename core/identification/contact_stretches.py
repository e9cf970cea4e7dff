"""Stretches of a log that do not go with the rest of it: contacts, stops and faults, found before anything is fitted.

Each joint's effort is explained by a few columns: the model's torque and its rate, inertia, friction, gravity about the
joint's own axis, an offset. The regression is robust, so that a minority of contacts does not move it; what lies many
robust standard deviations off for several samples is left out of all joints, and the regression is made again without,
until it settles. Nothing here is a result of its own: friction and inertials are fitted afterwards, on what remains.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import ceil

import numpy as np

from collaudit.core.data.columns import Columns, OfTwo, read
from collaudit.core.data.left_out import LeftOut, LeftOutBy, LeftOutSpan
from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.dataclass import dataclass
from collaudit.core.identification.lasting_contact import lasting_contact
from collaudit.core.identification.lone_speeds import untold_beside
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.blocks import blocks
from collaudit.core.numeric.filters import differentiate, low_pass
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.robust_regression import Columns as RegressionColumns
from collaudit.core.numeric.robust_regression import local_spread, robust_fit
from collaudit.core.numeric.runs import closed, marked, run_bounds, spread_over_unknown, widened
from collaudit.core.numeric.stage_progress import Progress, stage
from collaudit.core.numeric.stats import quantile_of, robust_sd
from collaudit.core.prepare.channel_shift import steady
from collaudit.core.prepare.prepared import Prepared

#: A stretch begins where the residual exceeds this many robust standard deviations for this long …
_FAR, _LASTING_S, _LASTING = 6.0, 0.02, 3
#: … reaches as far as it exceeds this many, short dips included, and this much further.
_NEAR, _DIP_S, _MARGIN_S = 2.5, 0.1, 0.1
#: The spread of a residual is taken for no less than this share of the effort's own: no model is better than that.
_LEAST_SHARE = 0.02
#: A joint whose effort is not explained better than to this share of its spread tells nothing.
_UNEXPLAINED = 0.9
#: An effort of no more different values than this is known to a step at best.
_COARSE, _FIRST = 60, 4096
#: Around a reversal friction is not that of sliding: presliding and breakaway would be taken for contact.
_SETTLED_S = 0.2
#: What lies on both sides of a reversal or a standstill of up to this, s, lies there as well; or beside one of half.
_UNTOLD_S = 2.0
#: Speeds over which friction may fall from breakaway: quantiles of those driven, and shares of the fastest.
_SLOW, _OF_FASTEST = (0.03, 0.1, 0.3), (0.05, 0.15, 0.4)
#: Rare speeds count as much as common ones in the regression, up to this many times their share: a few fast strokes
#: would otherwise be forgotten as outliers of a log that is mostly slow.
_SPEED_BINS, _MOST_WEIGHT = 12, 30.0
#: A log in which nothing lies this far off is left whole: errors of a model reach what a light contact does.
_CLEAR = 25.0
_ROUNDS = 8
_MAX_SAMPLES = 20_000
_MIN_SAMPLES = 200
_CELL_S = 4.0  # of samples that a condition needs for a spread of its own
#: With more of the motion left out, margins aside, no majority is left to tell contact from motion by.
MOSTLY = 0.42


@dataclass(frozen=True, slots=True, eq=False)
class _Joint:
    """Moving samples of one joint. They are read where they are used: those of all joints at once take gigabytes.

    Attributes:
        series: the log.
        j: the joint's column.
        rows: (k,) samples of the log.
        effort: (k,) of the joint, filtered as its motion is.
        torque: (n, j) of the model and the tool; None without a model.
        torque_rate: (k,) of the joint's, a second; None without a model.
        scales: speeds over which friction may fall.
        step: that its effort comes in.
    """

    series: UniformSeries
    j: int
    rows: IntArray
    effort: FloatArray
    torque: Columns | None
    torque_rate: FloatArray | None
    scales: Sequence[float]
    step: float

    @property
    def name(self) -> str:
        """Of the joint."""
        return self.series.joint_names[self.j]

    def speed(self) -> FloatArray:
        """(k,)."""
        return np.asarray(np.abs(self.series.velocity_rad_s[:, self.j][self.rows]))

    def acceleration(self) -> FloatArray:
        """(k,) its size."""
        return np.asarray(np.abs(self.series.acceleration_rad_s2[:, self.j][self.rows]))

    def columns(self) -> RegressionColumns:
        """(k, c) what explains the effort."""
        return RegressionColumns(self.rows.size, self._columns)

    def _columns(self, some: slice | IntArray) -> FloatArray:
        """(m, c) at some of the rows: an offset, friction, inertia, gravity, the model's torque and its rate."""
        series, j, rows = self.series, self.j, self.rows[some]
        v, q = read(series.velocity_rad_s, rows, j), read(series.position_rad, rows, j)
        out = np.empty((6 + len(self.scales) + (0 if self.torque is None else 3), rows.size))
        out[0], out[1], out[2], out[3] = 1.0, np.sign(v), v, series.acceleration_rad_s2[rows, j]
        np.cos(q, out=out[4])
        np.sin(q, out=out[5])
        speed = np.abs(v)
        for falling, scale in zip(out[6:], self.scales, strict=False):
            np.exp(np.divide(speed, -scale, out=falling), out=falling)
            falling *= out[1]
        if self.torque is not None and self.torque_rate is not None:
            out[-3], out[-2] = read(self.torque, rows, j), self.torque_rate[some]
            np.multiply(out[1], np.abs(out[-3]), out=out[-1])
        return out.T


def find_contact(
    prepared: Prepared, stated_free: bool = False, progress: Progress | None = None
) -> tuple[BoolArray, LeftOut]:
    """Look for contact in one log.

    Args:
        prepared: the log.
        stated_free: the log is stated to be free of contact: what looks like it is reported and nothing left out.
        progress: called with steps done and in all.

    Returns:
        (n,) samples to leave out, and what there is to say about them.
    """
    series = prepared.series
    n, period = series.time_s.size, series.period_s
    each = ordered_map(lambda j: _joint(prepared, j), range(len(series.joint_names)))
    joints = [found for found in each if found is not None]
    moving = np.zeros(n, dtype=bool)
    for joint in joints:
        moving[joint.rows] = True
    lasting = np.zeros(n, dtype=bool)
    for mask in ordered_map(_lasting, [joint for joint in joints if joint.torque is not None]):
        lasting |= mask
    out = lasting.copy()
    seen: list[tuple[str, FloatArray, BoolArray]] = []
    rounds, settled = 0, False
    while rounds < _ROUNDS and not settled and joints:
        rounds += 1
        part = stage(progress, 1.0 - 0.8 * 0.5 ** (rounds - 1), 1.0 - 0.8 * 0.5**rounds)  # two rounds are usual
        seen = []
        for found in ordered_map(partial(_stretches, out=out, n=n, period=period), joints):
            seen.append(found)
            part(len(seen), len(joints))
        fresh: BoolArray = np.any([lasting, *(core for _, _, core in seen)], axis=0)
        if rounds > _ROUNDS // 2:  # a stretch that comes and goes is left out
            fresh = fresh | out
        settled = bool(np.count_nonzero(fresh ^ out) <= 0.001 * np.count_nonzero(moving))
        out = fresh
    if not lasting.any() and not any(ratio.max(initial=0.0, where=out) >= _CLEAR for _, ratio, _ in seen):
        out, seen = np.zeros(n, dtype=bool), []
    beside = np.zeros(n, dtype=bool)
    cores = [(joint, core) for joint, (_, _, core) in zip(joints, seen, strict=False)]
    for untold in ordered_map(_untold, cores):
        beside |= untold
    wide = widened(out | beside, ceil(_MARGIN_S / period))
    spans = _spans(wide, [(name, ratio) for name, ratio, _ in seen], series.time_s)
    facts = _facts("stated" if stated_free else "found", wide, out, moving, period, spans, rounds, settled)
    return (np.zeros(n, dtype=bool) if stated_free else wide), facts


def labelled_contact(prepared: Prepared, times_s: Sequence[tuple[float, float]]) -> tuple[BoolArray, LeftOut]:
    """Leave out what labels or a truth file mark.

    Args:
        prepared: the log.
        times_s: start and end of each event, seconds from the log's first sample.

    Returns:
        As :func:`find_contact` does.
    """
    series = prepared.series
    out = np.zeros(series.time_s.size, dtype=bool)
    for start, end in times_s:
        a, b = np.searchsorted(series.time_s, [start, end], side="left")
        out[a : max(b, a + 1)] = True
    wide = widened(out, ceil(_MARGIN_S / series.period_s))
    moving = np.asarray((np.abs(series.velocity_rad_s) > MOVING_RAD_S).any(axis=1))
    return wide, _facts("labels", wide, out, moving, series.period_s, _spans(wide, [], series.time_s), 1, True)


def _facts(
    by: LeftOutBy,
    wide: BoolArray,
    core: BoolArray,
    moving: BoolArray,
    period: float,
    spans: tuple[LeftOutSpan, ...],
    rounds: int,
    settled: bool,
) -> LeftOut:
    motion = max(1, int(np.count_nonzero(moving)))
    seen = int(np.count_nonzero(core & moving)) / motion
    return LeftOut(
        by=by,
        spans=spans,
        seconds=float(np.count_nonzero(wide)) * period,
        share=int(np.count_nonzero(wide & moving)) / motion,
        share_seen=seen,
        rounds=rounds,
        settled=settled,
        refused=by != "stated" and seen > MOSTLY,
    )


def _joint(prepared: Prepared, j: int) -> _Joint | None:
    """What explains one joint's effort while it moves; None where it hardly does, or its effort is not known."""
    series = prepared.series
    if series.effort is None:
        return None
    v = series.velocity_rad_s[:, j]
    effort = low_pass(series.effort[:, j : j + 1], series.segments, series.period_s, series.bandwidth_hz)
    known = steady(v, MOVING_RAD_S, round(_SETTLED_S / series.period_s)) & ~(series.edge | series.saturated[:, j])
    known &= np.isfinite(effort[:, 0])
    needed: list[Columns] = [series.position_rad, series.acceleration_rad_s2]
    torque: Columns | None = prepared.rigid_nm
    if prepared.rigid_nm is not None and prepared.contact_nm is not None:
        torque = OfTwo(np.add, prepared.rigid_nm, prepared.contact_nm)
    for table in needed if torque is None else [*needed, torque]:
        for block in blocks(known.size):
            known[block] &= np.isfinite(table[block, j])
    rows = np.flatnonzero(known)
    if rows.size < _MIN_SAMPLES:
        return None
    rate = None
    if torque is not None:
        rate = np.nan_to_num(differentiate(torque[:, j], series.segments, series.period_s)[rows])
    speed = np.abs(v[rows])
    *slow, fastest = (quantile_of(speed, share) for share in (*_SLOW, 0.999))
    scales = [max(s, 1e-6) for s in (*slow, *(share * fastest for share in _OF_FASTEST))]
    return _Joint(series, j, rows, effort[rows, 0], torque, rate, scales, _step(read(series.effort, rows, j)))


def _lasting(joint: _Joint) -> BoolArray:
    return lasting_contact(joint.rows, joint.columns(), joint.effort, joint.series.time_s, joint.step)


def _untold(found: tuple[_Joint, BoolArray]) -> BoolArray:
    joint, core = found
    return untold_beside(joint.rows, joint.speed(), core, joint.series.period_s, 0.5 * _UNTOLD_S)


def _step(effort: FloatArray) -> float:
    """The step of an effort that takes few different values; 0 of a finer one."""
    if np.unique(np.round(effort[:_FIRST], 9)).size > _COARSE:  # a fine one shows it at once
        return 0.0
    values = np.unique(np.round(effort, 9))
    return float(np.median(np.diff(values))) if 1 < values.size <= _COARSE else 0.0


def _stretches(joint: _Joint, out: BoolArray, n: int, period: float) -> tuple[str, FloatArray, BoolArray]:
    """The joint, its (n,) residual in robust standard deviations, 0 where it is not known, and (n,) what is far off."""
    kept = ~out[joint.rows]
    if np.count_nonzero(kept) < _MIN_SAMPLES:
        kept[:] = True
    use = np.flatnonzero(kept)
    use = use[:: max(1, use.size // _MAX_SAMPLES)]
    columns, effort, speed = joint.columns(), joint.effort, joint.speed()
    found = robust_fit(columns.at(use), effort[use], _balanced(speed[use]))
    usual = robust_sd(effort[use] - float(np.median(effort[use])))
    rest = effort - columns.times(found)
    spread = local_spread(rest, kept, (speed, joint.acceleration()), max(_MIN_SAMPLES, round(_CELL_S / period)))
    ratio = np.zeros(n)
    if robust_sd(rest[use]) > _UNEXPLAINED * usual:
        return joint.name, ratio, np.zeros(n, dtype=bool)
    ratio[joint.rows] = np.abs(rest) / np.maximum(spread, max(_LEAST_SHARE * usual, joint.step, 1e-9))
    dip = ceil(_DIP_S / period)
    near = closed(ratio > _NEAR, dip)
    starts, stops = run_bounds(ratio > _FAR)
    lasting = max(_LASTING, ceil(_LASTING_S / period))
    core = np.zeros(n, dtype=bool)
    long = stops - starts >= lasting
    core[starts[long]] = True
    first, last = run_bounds(near)
    hit = np.add.reduceat(core, first) > 0 if first.size else np.zeros(0, dtype=bool)
    # reduceat sums to the next start; no far sample lies between two near stretches, so that is the same
    told = np.zeros(n, dtype=bool)
    told[joint.rows] = True
    far = spread_over_unknown(marked(first[hit], last[hit], n), told, round(0.5 * _UNTOLD_S / period))
    return joint.name, ratio, far


def _balanced(speed: FloatArray) -> FloatArray:
    """(k,) weights that make bins of speed, even in their logarithm, count alike."""
    edges = np.geomspace(max(MOVING_RAD_S, 1e-6), max(float(speed.max()), 2 * MOVING_RAD_S), _SPEED_BINS)
    bins = np.searchsorted(edges, speed)
    count = np.bincount(bins, minlength=_SPEED_BINS + 1)
    return np.asarray(np.minimum(count.max() / count[bins], _MOST_WEIGHT))


def _spans(wide: BoolArray, ratios: Sequence[tuple[str, FloatArray]], time_s: FloatArray) -> tuple[LeftOutSpan, ...]:
    """The stretches with the joints that show them."""
    spans = []
    for a, b in zip(*run_bounds(wide), strict=True):
        peaks = sorted(((float(ratio[a:b].max()), name) for name, ratio in ratios), reverse=True)
        shown = [(peak, name) for peak, name in peaks if peak > _FAR]
        spans.append(
            LeftOutSpan(
                float(time_s[a]),
                float(time_s[b - 1]),
                tuple(name for _, name in shown),
                shown[0][0] if shown else None,
            )
        )
    return tuple(spans)
