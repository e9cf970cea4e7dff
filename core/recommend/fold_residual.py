"""The residual of one joint whose laws change with the fold that a sample is in: each law only where it judges.

A law is evaluated and smoothed in the blocks of its fold and a little around them, so that all folds together cost
little more than one residual. A kernel of first order forgets where such a piece begins to the last digit: values are
those of :mod:`collaudit.core.residual.residual` over the whole log. One of second order may keep a difference of a last
digit for ever; where it smooths, a friction level is followed or ripple is checked against the log, the piece is the
log.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import DetectConfig
from collaudit.core.data.signals import State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.dataclass import dataclass
from collaudit.core.friction.extrapolation import extrapolation_doubt
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.gear.load_term import load_torque
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span
from collaudit.core.numeric.blocks import exceeds
from collaudit.core.numeric.kernel import Kernel
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.runs import rows_within, run_bounds
from collaudit.core.numeric.stage_progress import Progress
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.balance import Balance
from collaudit.core.residual.friction_bounds import Travel, loose_bounds, rest_below
from collaudit.core.residual.friction_level import FrictionLevel, fixed_level, follow_level
from collaudit.core.residual.gear_terms import carried_load, known_ripple
from collaudit.core.residual.residual import BEYOND_RANGE, SIGMAS, mark_reasons

#: After so many time constants of a kernel a wrong start is below the last digit, rounding included.
_FORGOTTEN = 80.0
#: Coefficients of a denominator of first order.
_FORGETS = 2


@dataclass(frozen=True, slots=True, eq=False)
class FoldResidual:
    """Residual of the judged joints, each sample with the laws of its fold; each (n, j).

    Attributes:
        torque_nm: residual; NaN where unknown.
        evidence: samples on which the rule could fire.
        judged: those of them at which friction is a value.
    """

    torque_nm: FloatArray
    evidence: BoolArray
    judged: BoolArray


def fold_residual(
    prepared: Prepared,
    balance: Balance,
    laws: Sequence[Sequence[FrictionModel | None]],
    fold: NDArray[np.int16],
    barred: frozenset[str],
    config: DetectConfig,
    progress: Progress | None = None,
) -> FoldResidual:
    """Residual of every judged joint.

    Args:
        prepared: the log.
        balance: torque balance of its judged joints before friction.
        laws: for each judged joint its law in each fold; None where a joint has none.
        fold: (n,) number of the fold that a sample is in.
        barred: joints that a finding forbids judging.
        config: as for the residual of one law.
        progress: called with joints done and in all.
    """
    series = prepared.judged_series
    shape = series.position_rad.shape
    torque = np.full(shape, np.nan, order="F")
    evidence, judged = (np.zeros(shape, dtype=np.bool_, order="F") for _ in range(2))
    state = np.zeros(shape, dtype=np.int8, order="F")
    mark_reasons(state, torque, series, replace(balance, total_nm=None))  # where that is no number the residual is none
    parts = [_Part.of(fold == k, series, balance) for k in range(len(laws[0]) if laws else 0)]

    def fill_joint(j: int) -> None:
        found = [law for law in laws[j] if law is not None]
        if not found:
            return
        column = _Column.of(prepared, balance, j, fold, parts, config, found)
        for _ in ordered_map(lambda k: column.fill(k, found[k]), range(len(found))):  # each its own samples
            pass
        torque[:, j] = column.torque_nm
        usable = np.isfinite(column.torque_nm) & (state[:, j] == State.JUDGED) & ~column.too_fast
        usable &= ~series.saturated[:, j] & (series.joint_names[j] not in barred)
        evidence[:, j], judged[:, j] = usable, usable & ~column.loose

    for done, _ in enumerate(ordered_map(fill_joint, range(shape[1])), start=1):
        if progress is not None:
            progress(done, shape[1])
    return FoldResidual(torque, evidence, judged)


@dataclass(frozen=True, slots=True)
class _Part:
    """The blocks of one fold: its own samples, and with those around them that its kernel remembers.

    ``own_rows`` and ``wide_rows`` are the numbers of its samples: a law is evaluated for all blocks in one go.
    """

    wide: Sequence[Span]
    own_rows: IntArray
    wide_rows: IntArray

    @classmethod
    def of(cls, mask: BoolArray, series: UniformSeries, balance: Balance) -> _Part:
        margin = _margin(balance.kernel, series.period_s)
        own, wide = (_spans(mask, series.segments, around) for around in (0, margin))
        return cls(wide, _rows_of(own), _rows_of(wide))


@dataclass(frozen=True, slots=True, eq=False)
class _Column:
    """One joint: what does not depend on its law, and the residual that is being filled; arrays are (n,).

    ``share`` is friction as a share of its law at the joint's temperature, ``doubt`` what that may be wrong by.
    """

    prepared: Prepared
    balance: Balance
    j: int
    fold: NDArray[np.int16]
    parts: Sequence[_Part]
    config: DetectConfig
    velocity: FloatArray
    total: FloatArray
    travel: Travel
    load_nm: FloatArray | None
    share: FloatArray | None
    doubt: float
    whole: bool
    torque_nm: FloatArray
    too_fast: BoolArray
    loose: BoolArray

    @classmethod
    def of(
        cls,
        prepared: Prepared,
        balance: Balance,
        j: int,
        fold: NDArray[np.int16],
        parts: Sequence[_Part],
        config: DetectConfig,
        laws: Sequence[FrictionModel],
    ) -> _Column:
        assert balance.total_nm is not None
        series, law = prepared.judged_series, laws[0]  # the laws of a joint are corrected alike
        velocity, total = (np.ascontiguousarray(x[:, j]) for x in (balance.velocity_rad_s, balance.total_nm))
        load = carried_load(prepared, series.joint_names[j], law)
        heat, model = None if series.temperature_c is None else series.temperature_c[:, j], law.temperature_model
        share, doubt = (None, 0.0) if heat is None or model is None else (model.share(heat), model.doubt(heat))
        needed = [x[span.slice] for span in series.segments for x in (velocity, load) if x is not None]
        whole = config.friction_level != "fixed" or bool(law.ripple) or len(balance.kernel.denominator) > _FORGETS
        whole = whole or not all(np.isfinite(x.sum()) for x in needed)
        marks = (np.zeros(velocity.size, dtype=np.bool_) for _ in range(2))
        torque = np.full(velocity.size, np.nan)
        travel = Travel.of(series, j, velocity)
        known = (velocity, total, travel, load, share, doubt)
        return cls(prepared, balance, j, fold, parts, config, *known, whole, torque, *marks)

    def fill(self, k: int, law: FrictionModel) -> None:
        """Fill the samples of one fold."""
        series, kernel, part = self.prepared.judged_series, self.balance.kernel, self.parts[k]
        pieces = series.segments if self.whole else part.wide
        sliding = np.full(self.velocity.size, np.nan) if self.whole else np.empty(self.velocity.size)
        inside = _rows_of(pieces) if self.whole else part.wide_rows
        sliding[inside] = self._shared(self._sliding(law, inside), inside)
        slowest = rest_below(law, self.config.slow_speed_rad_s)
        steady, travel = self.travel.settled(series, self.velocity, slowest, self.config.reversal_travel_rad)
        if self.whole:
            steady &= np.isfinite(sliding)
        around = _Around.of(self, steady, k)
        smooth = kernel.apply(sliding[:, None], pieces, series.period_s)[:, 0]
        total, level = self._level(law, smooth, around)
        rows = part.own_rows
        self.torque_nm[rows] = total[rows] - (1.0 + level.deviation[rows]) * smooth[rows]
        fast = rows[exceeds(self.velocity[rows], BEYOND_RANGE * law.speed_range[1])]
        doubt = extrapolation_doubt(law, self.velocity[fast])
        self.too_fast[fast] = ~(doubt <= self.config.beyond_range * np.abs(sliding[fast]))
        self._fill_loose(law, around, travel, slowest, total, level)

    def _sliding(self, law: FrictionModel, at: slice | IntArray) -> FloatArray:
        """Steady friction at samples, before the share of their temperature."""
        sliding = law.torque(self.velocity[at])
        if self.load_nm is not None and law.load is not None:
            sliding = sliding + load_torque(law.load, self.load_nm[at], self.velocity[at])
        return sliding

    def _shared(self, torque: FloatArray, at: slice | IntArray) -> FloatArray:
        return torque if self.share is None else np.asarray(self.share[at] * torque)

    def _level(self, law: FrictionModel, smooth: FloatArray, around: _Around) -> tuple[FloatArray, FrictionLevel]:
        """Balance without ripple, and the friction level."""
        series, balance, config = self.prepared.judged_series, self.balance, self.config
        sd = float(np.hypot(config.friction_level_sd, self.doubt))
        if not self.whole:
            return self.total, fixed_level(self.total.size, sd)
        usable = ~(series.edge | balance.unsettled | series.saturated[:, self.j])
        usable &= ~exceeds(self.velocity, BEYOND_RANGE * law.speed_range[1])
        usable[around.rows[around.undecided]] = False
        left = self.total - smooth
        ripple, _ = known_ripple(series, self.j, self.velocity, law, balance.kernel, left, usable)
        total = self.total - ripple
        if config.friction_level == "fixed":
            return total, fixed_level(total.size, sd)
        return total, follow_level(total - smooth, smooth, usable, series.period_s, sd, config.causal)

    def _fill_loose(
        self,
        law: FrictionModel,
        around: _Around,
        travel: FloatArray,
        slowest: float,
        total: FloatArray,
        level: FrictionLevel,
    ) -> None:
        """Fill samples at which friction is an interval: the distance of the unexplained torque from it."""
        low, high = np.empty(around.rows.size), np.empty(around.rows.size)
        inside = _rows_of(around.spans)
        rows = around.rows[inside]
        sliding = self._sliding(law, rows)
        shared = self._shared(sliding, rows)
        least, most = shared.copy(), shared.copy()
        at = np.flatnonzero(around.marked[inside])
        picked = rows[at]
        ends = loose_bounds(
            law, self.velocity[picked], sliding[at], travel[picked], slowest, self.config.reversal_travel_rad
        )
        least[at], most[at] = ends if self.share is None else self.share[picked] * ends
        scale = 1.0 + level.deviation[rows]
        slack = SIGMAS * level.sd[rows] * np.maximum(np.abs(least), np.abs(most))
        low[inside], high[inside] = scale * least - slack, scale * most + slack
        low, high = around.smoothed(low), around.smoothed(high)
        own = np.flatnonzero(around.undecided & around.own)
        rows = around.rows[own]
        unexplained = total[rows]
        self.torque_nm[rows] = np.maximum(unexplained - high[own], 0.0) + np.minimum(unexplained - low[own], 0.0)
        self.loose[rows] = True


@dataclass(frozen=True, slots=True, eq=False)
class _Around:
    """Rows around a joint's reversals and rests, one after the other.

    Attributes:
        rows: (k,) sample numbers.
        marked: (k,) where friction is an interval.
        own: (k,) of the fold.
        spans: of rows that are to be smoothed: those of the fold, and what the kernel remembers around them.
        undecided: (k,) rows in whose kernel the marked ones weigh something; right at those of the fold.
    """

    rows: IntArray
    marked: BoolArray
    own: BoolArray
    spans: Sequence[Span]
    undecided: BoolArray
    column: _Column

    @classmethod
    def of(cls, column: _Column, steady: BoolArray, k: int) -> _Around:
        series, kernel = column.prepared.judged_series, column.balance.kernel
        rows, stretches = kernel.near(~steady, series.segments, series.period_s)
        marked, own = ~steady[rows], column.fold[rows] == k
        spans = stretches if column.whole else _spans(own, stretches, _margin(kernel, series.period_s))
        undecided = kernel.reach(marked[:, None], spans, series.period_s)[:, 0]
        return cls(rows, marked, own, spans, undecided, column)

    def smoothed(self, x: FloatArray) -> FloatArray:
        """(k,) values at the spans through the kernel."""
        period_s = self.column.prepared.series.period_s
        return self.column.balance.kernel.apply(x[:, None], self.spans, period_s)[:, 0]


def _margin(kernel: Kernel, period_s: float) -> int:
    """Samples after which the kernel has forgotten where it began; ``settle_s`` is three time constants or more."""
    return max(16, ceil(_FORGOTTEN / 3.0 * kernel.settle_s / period_s))


def _rows_of(spans: Sequence[Span]) -> IntArray:
    """Numbers of the samples of stretches, one after the other."""
    bounds = np.array([(span.start, span.stop) for span in spans], dtype=np.int64).reshape(-1, 2)
    return rows_within(bounds[:, 0], bounds[:, 1])


def _spans(mask: BoolArray, segments: Sequence[Span], margin: int) -> list[Span]:
    """Runs of a mask inside segments, so much wider; those that meet are one."""
    out: list[Span] = []
    for segment in segments:
        last: Span | None = None
        for a, b in zip(*run_bounds(mask[segment.slice]), strict=True):
            start, stop = max(segment.start + int(a) - margin, segment.start), segment.start + int(b) + margin
            if last is not None and start <= last.stop:
                out.pop()
                start = last.start
            last = Span(start, min(stop, segment.stop))
            out.append(last)
    return out
