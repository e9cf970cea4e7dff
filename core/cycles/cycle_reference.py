"""The second residual: what a cycle leaves beyond the same place of other cycles, or of earlier nights.

The difference has its own level by the law that the first residual has, and stands under the same rule. Envelopes over
repeated programs: Zhang and Jing 2019, [6] of the paper.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from collaudit.core.config.schema import Config
from collaudit.core.cycles.cycle_search import DrawnPath, Motion, find_cycles
from collaudit.core.cycles.null_level import NullEvidence, motion_levels
from collaudit.core.cycles.path_place import PLACE_S, CyclePath, Placed, along, placed, usual_path
from collaudit.core.data.audit_result import RuleFacts
from collaudit.core.data.cycles_result import CycleFacts, CycleReference
from collaudit.core.data.signals import CycleSignals, State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span
from collaudit.core.numeric.parallel import each
from collaudit.core.numeric.stats import SD_PER_MAD, median_of, robust_sd
from collaudit.core.residual.friction_level import follow_level
from collaudit.core.residual.residual import FRICTION_LEVEL_SD, Residual, ResidualInputs
from collaudit.core.residual.torque_zero import balanced_zero, follow_zero

#: Cycles are alike in speed within such a share of the logarithm; at a place a sample may differ by more, and by so
#: many places a second where the arm hardly moves.
_SPEED_CLASS, _LIKE_SPEED, _LIKE_PLACES_S = 0.1, 0.25, 10.0
#: A reference is made of so many cycles at most, evenly over the log.
_MOST_CYCLES = 60
#: ... and of a place at which nearly all of them were judged.
_NEARLY_ALL = 0.8
#: The spread at a place is that of so much motion about it, s: a few cycles tell it poorly.
_SPREAD_S = 0.25
#: Thresholds change over the path in such steps of the usual one.
_STEP = 8.0
#: A night's path is this one's where at nearly all places no joint is further off, rad: it then has the same torque.
_SAME_PATH_RAD, _MOST_PLACES = 0.01, 0.99


@dataclass(frozen=True, slots=True, eq=False)
class CycleResidual:
    """The second residual of a log.

    Attributes:
        signals: sample by sample.
        proven: (n,) samples whose reference rests on nights that passed.
        facts: what is said of it.
        reference: of this log, for later nights; None where it has too few cycles.
    """

    signals: CycleSignals
    proven: BoolArray
    facts: CycleFacts
    reference: CycleReference | None


def cycle_residual(
    series: UniformSeries,
    residual: Residual,
    rule: RuleFacts,
    config: Config,
    inputs: ResidualInputs,
    earlier: Sequence[CycleReference],
) -> CycleResidual | None:
    """The difference to the same place of other cycles, with its thresholds; None where nothing repeats.

    Args:
        series: the judged joints.
        residual: the ordinary one.
        rule: joints with a threshold, and the persistence.
        config: how cycles are known, how many a reference needs, whether friction's level is followed.
        inputs: laws, and how far the zero of a torque is followed.
        earlier: what passed nights say of this residual of the program, in their order.
    """
    if config.cycles.find == "off":
        return None
    drawn, least = DrawnPath.of(series), config.cycles.least
    on_path, nights = _on_known_path(drawn, earlier)
    if on_path is None:
        spans = find_cycles(series, drawn, config.cycles)
        if len(spans) < 2:
            return None
        on_path = placed(drawn, spans, usual_path(drawn, spans))
    drifting, friction = _not_followed(series, residual, inputs)
    speed = along_path_speeds(on_path, series)
    speeds = on_path.at_places(speed)[:, :, 0]
    classes = [_SpeedClass.of(members, speeds, nights, least) for members in _speed_classes(speeds)]
    # what drifts is followed on the difference, which errors of the model do not move
    first = on_path.at_places(drifting)
    difference = _beside(on_path, drifting, speed, classes, lambda one: one.references(first, 1))
    steady = drifting - _drift(difference, friction, series, inputs, config)
    table = on_path.at_places(steady)
    torque = _beside(on_path, steady, speed, classes, lambda one: one.references(table, least))
    scale = _beside(on_path, np.zeros_like(steady), speed, classes, lambda one: one.weights(table, least))
    gamma = (-scale * _levels(torque, -scale, rule, series)).astype(np.float32)
    torque[np.isnan(gamma)] = np.nan
    place = (on_path.place / (on_path.path.share.size - 1)).astype(np.float32)
    signals = CycleSignals(on_path.number, place, torque, gamma)
    largest = max(classes, key=lambda one: one.members.size, default=None)
    facts = _facts(
        series, signals, on_path.spans, drawn, steady, config, max((len(x.nights) for x in classes), default=0)
    )
    reference = None if largest is None else largest.kept(table, least, on_path.path)
    proven = np.isin(on_path.number, [int(k) for one in classes if one.nights for k in one.members])
    return CycleResidual(signals, proven, facts, reference)


def _not_followed(series: UniformSeries, residual: Residual, inputs: ResidualInputs) -> tuple[FloatArray, FloatArray]:
    """(n, j) what model and friction as fitted leave, NaN where friction is no value; and friction as fitted."""
    torque = np.where(residual.state == State.JUDGED, residual.torque_nm, np.nan)
    friction = np.zeros_like(torque)
    for j, joint in enumerate(series.joint_names):
        if joint in residual.levels:
            friction[:, j] = inputs.laws[joint].torque(series.velocity_rad_s[:, j])
            torque[:, j] += friction[:, j] * residual.levels[joint].deviation
        if joint in residual.zeros:
            torque[:, j] += residual.zeros[joint].offset_nm
    return torque, friction


def _drift(
    difference: FloatArray, friction: FloatArray, series: UniformSeries, inputs: ResidualInputs, config: Config
) -> FloatArray:
    """(n, j) friction's level and the torque's zero as a difference to other cycles shows them."""
    out = np.zeros_like(difference)

    def of_joint(j: int) -> None:
        there = np.isfinite(difference[:, j])
        rest = np.where(there, difference[:, j], 0.0)
        if config.detect.friction_level == "followed":
            centred = rest - balanced_zero(rest, series.velocity_rad_s[:, j], there, series.period_s, False)
            level = follow_level(centred, friction[:, j], there, series.period_s, FRICTION_LEVEL_SD, False)
            out[:, j] = friction[:, j] * level.deviation
        bound = inputs.zero_bound_nm.get(series.joint_names[j], 0.0)
        zero = follow_zero(rest - out[:, j], there, series.period_s, bound, False)
        if zero is not None:
            out[:, j] += zero.offset_nm

    each(of_joint, range(difference.shape[1]))
    return out


@dataclass(frozen=True, slots=True, eq=False)
class _SpeedClass:
    """Cycles that run about as fast as each other.

    Attributes:
        members: their numbers.
        chosen: those that a reference is made of.
        speed: (p,) the usual one, places a second.
        nights: earlier nights that run as fast; none where they are too few for a reference.
    """

    members: IntArray
    chosen: IntArray
    speed: FloatArray
    nights: list[CycleReference]

    @classmethod
    def of(cls, members: IntArray, speeds: FloatArray, nights: Sequence[CycleReference], least: int) -> _SpeedClass:
        usual = median_and_spread(speeds[members], 1)[0]
        alike = [night for night in nights if np.nanmedian(np.abs(usual / night.speed - 1.0)) < _SPEED_CLASS]
        even = np.linspace(0, members.size - 1, min(members.size, _MOST_CYCLES)).astype(np.int64)
        return cls(members, members[even], usual, alike if len(alike) >= least else [])

    def of_nights(self, field: str, least: int) -> tuple[FloatArray, FloatArray]:
        """Median and spread (p, j) over the nights."""
        return median_and_spread(np.stack([getattr(night, field) for night in self.nights]), least)

    def references(self, table: FloatArray, least: int) -> Iterator[tuple[int, FloatArray]]:
        """Each cycle's number with its reference (p, j), of the chosen others; NaN where they are fewer than needed."""
        if self.nights:
            middle = self.of_nights("median_nm", least)[0]
            yield from ((k, middle) for k in self.members.tolist())
            return
        ordered = np.sort(table[self.chosen], axis=0)
        count = np.count_nonzero(np.isfinite(ordered), axis=0)
        count[count < _NEARLY_ALL * len(ordered)] = 0  # a place that few cycles judge is told by odd ones
        whole = np.where(count < least, np.nan, _middle(ordered, count))
        for k in self.members.tolist():
            if k not in self.chosen:
                yield k, whole
                continue
            own = table[k]
            there = np.isfinite(own)
            rank = np.where(there, np.count_nonzero(ordered < own, axis=0), len(ordered))
            yield k, np.where(count - there < least, np.nan, _middle(ordered, count - there, rank))

    def weights(self, table: FloatArray, least: int) -> Iterator[tuple[int, FloatArray]]:
        """Each cycle's number with the spread (p, j) at each place over the usual one, at least 1, in steps."""
        spread = median_and_spread(table[self.chosen], least)[1]
        if self.nights:
            spread = np.hypot(self.of_nights("median_nm", least)[1], self.of_nights("spread_nm", least)[0])
        known = np.isfinite(spread)
        width = max(1, round(_SPREAD_S / PLACE_S))
        sums, counts = (
            uniform_filter1d(x, width, axis=0) for x in (np.where(known, spread, 0.0), known.astype(np.float64))
        )
        mean = np.where(known, sums / np.maximum(counts, 1e-9), np.nan)
        usual = np.maximum(median_and_spread(mean, 1)[0], 1e-12)
        weight = np.maximum(np.ceil(_STEP * mean / usual) / _STEP, 1.0)
        return ((k, weight) for k in self.members.tolist())

    def kept(self, table: FloatArray, least: int, path: CyclePath) -> CycleReference | None:
        """What later nights may know of this one."""
        middle, spread = median_and_spread(table[self.chosen], least)
        if not np.isfinite(middle).any():
            return None
        return CycleReference(
            version="",
            night="",
            log="",
            position_rad=path.position_rad,
            share=path.share,
            speed=self.speed,
            median_nm=middle,
            spread_nm=spread,
        )


def _beside(
    on_path: Placed,
    torque: FloatArray,
    speed: FloatArray,
    classes: Sequence[_SpeedClass],
    references: Callable[[_SpeedClass], Iterable[tuple[int, FloatArray]]],
) -> FloatArray:
    """(n, j) a torque less the reference of its cycle at its place; NaN without, or where it runs at another speed."""
    out = np.full(torque.shape, np.nan, order="F")
    for one in classes:
        for k, at in references(one):
            part = on_path.spans[k].slice
            found = on_path.of_samples(k, np.column_stack([at, one.speed]))
            apart = np.abs(speed[part, 0] - found[:, -1])
            found[~(apart <= _LIKE_SPEED * found[:, -1] + _LIKE_PLACES_S)] = np.nan
            out[part] = torque[part] - found[:, :-1]
    return out


def _facts(
    series: UniformSeries,
    signals: CycleSignals,
    spans: Sequence[Span],
    drawn: DrawnPath,
    steady: FloatArray,
    config: Config,
    nights: int,
) -> CycleFacts:
    known = np.isfinite(signals.torque_nm)
    named = {joint: j for j, joint in enumerate(series.joint_names) if known[:, j].any()}
    compared = int(np.unique(signals.number[known.any(axis=1)]).size)
    lengths = np.array([len(span) for span in spans]) * series.period_s
    before = {joint: robust_sd((x := steady[known[:, j], j]) - median_of(x)) for joint, j in named.items()}

    return CycleFacts(
        stated=bool(config.cycles.spans_s or config.cycles.label),
        starts_s=tuple(float(series.time_s[span.start]) for span in spans),
        duration_s=(float(lengths.min()), median_of(lengths), float(lengths.max())),
        path_rad=float(drawn.way_rad[spans[0].stop - 1] - drawn.way_rad[spans[0].start]),
        compared=compared,
        least=config.cycles.least,
        nights=nights,
        gamma_nm={joint: float(np.nanmin(signals.gamma_nm[:, j])) for joint, j in named.items()},
        spread_share={
            joint: robust_sd(signals.torque_nm[known[:, j], j]) / max(before[joint], 1e-12)
            for joint, j in named.items()
        },
        judged_s={joint: float(np.count_nonzero(known[:, j])) * series.period_s for joint, j in named.items()},
        unseen=_unseen(len(spans), compared, config.cycles.least, nights),
    )


def _on_known_path(drawn: DrawnPath, nights: Sequence[CycleReference]) -> tuple[Placed | None, list[CycleReference]]:
    """The log on the path of earlier nights, and the nights on it; None where it goes along no known one."""
    for latest in reversed(nights):
        path = CyclePath(latest.position_rad, latest.share)
        spans = along(drawn, path)
        if not spans:
            continue
        on_path = placed(drawn, spans, path)
        off = np.abs(on_path.at_places(drawn.motion.position_rad) - path.position_rad).max(axis=2)
        near = median_and_spread(off, 1)[0] < _SAME_PATH_RAD
        if near[np.isfinite(off).any(axis=0)].mean() > _MOST_PLACES:
            return on_path, [one for one in nights if np.array_equal(one.position_rad, path.position_rad)]
    return None, []


def along_path_speeds(on_path: Placed, motion: Motion) -> FloatArray:
    """(n, 1) speed along the path, places a second; NaN where a sample has no place."""
    slope = np.gradient(on_path.path.position_rad, axis=0)
    known = np.isfinite(on_path.place)
    along = slope[np.rint(on_path.place[known]).astype(np.int64)]
    size = np.maximum(np.einsum("nj,nj->n", along, along), np.finfo(np.float64).tiny)
    out = np.full((on_path.place.size, 1), np.nan)
    out[known, 0] = np.einsum("nj,nj->n", motion.velocity_rad_s[known], along) / size
    return out


def _speed_classes(speeds: FloatArray) -> list[IntArray]:
    """Numbers of the cycles (c, p) that run about as fast as each other, as far as they were judged at all."""
    there = np.flatnonzero(np.isfinite(speeds).any(axis=1))
    if there.size == 0:
        return []
    usual = median_and_spread(speeds[there], 1)[0]
    share = median_and_spread((speeds[there] / usual).T, 1)[0]
    of_class = np.rint(np.log(np.maximum(share, 1e-3)) / _SPEED_CLASS)
    return [there[of_class == one] for one in np.unique(of_class)]


def median_and_spread(values: FloatArray, least: int) -> tuple[FloatArray, FloatArray]:
    """Median and robust standard deviation of (c, …) values over c; NaN where fewer than ``least`` are known."""
    ordered = np.sort(values, axis=0)
    known = np.count_nonzero(np.isfinite(ordered), axis=0)
    middle = _middle(ordered, known)
    spread = SD_PER_MAD * _middle(np.sort(np.abs(values - middle), axis=0), known)
    few = known < least
    return np.where(few, np.nan, middle), np.where(few, np.nan, spread)


def _middle(ordered: FloatArray, known: NDArray[np.integer], rank: NDArray[np.integer] | None = None) -> FloatArray:
    """Median of the first ``known`` of sorted values, the one at ``rank`` taken out where that is given."""
    ends = []
    for k in (np.maximum(known - 1, 0) // 2, known // 2):
        at = k if rank is None else k + (k >= rank)
        ends.append(np.take_along_axis(ordered, np.minimum(at, len(ordered) - 1)[None], axis=0)[0])
    return np.asarray(0.5 * (ends[0] + ends[1]))


def _levels(torque: FloatArray, scale: FloatArray, rule: RuleFacts, series: UniformSeries) -> FloatArray:
    """(j,) threshold of the difference where its spread is usual, N·m; NaN of joints that have none."""
    out = np.full(torque.shape[1], np.nan)
    for joint in rule.gamma_nm:
        j = series.column(joint)
        evidence = NullEvidence(torque[:, j] / scale[:, j], np.isfinite(torque[:, j]), series.period_s)
        levels = motion_levels([evidence], [(1,), (rule.n,)], len(rule.gamma_nm))
        if levels:
            # the zero is followed on the difference itself: none of it is left from one day to the next
            out[j] = float(f"{min(level.gamma_nm - level.zero_doubt_nm for level in levels):.3g}")
    return out


def _unseen(cycles: int, compared: int, least: int, nights: int) -> tuple[str, ...]:
    """What the comparison of cycles does not cover."""
    where = f"in every cycle of {nights} nights" if nights else "in most cycles"
    texts = [
        f"A contact {where} is part of the reference: there the ordinary residual alone judges, at its own γ.",
        "What changes slowly over many cycles is no contact to this comparison: collaudit trend shows it.",
        "At rest and next to it, at reversals, off the path and between cycles the ordinary residual alone judges.",
    ]
    if compared < cycles:
        texts.append(
            f"{cycles - compared} of {cycles} cycles have no reference: fewer than {least} others, or nights, that "
            "run as fast."
        )
    return tuple(texts)
