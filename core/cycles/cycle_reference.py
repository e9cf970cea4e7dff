"""The second residual: what a cycle leaves beyond the same place of other cycles, or of earlier nights.

The difference has its own level by the law that the first residual has, and stands under the same rule. Envelopes over
repeated programs: Zhang and Jing 2019, [6] of the paper.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.cycles.cycle_search import DrawnPath, find_cycles
from collaudit.core.cycles.null_level import NullEvidence, motion_levels
from collaudit.core.cycles.path_place import (
    CyclePath,
    Placed,
    SpeedClass,
    along,
    along_path_speeds,
    median_and_spread,
    placed,
    speed_classes,
    usual_path,
)
from collaudit.core.data.audit_result import RuleFacts
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.data.signals import CycleFacts, CycleReference, CycleSignals, State
from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.stats import median_of, robust_sd
from collaudit.core.residual.followed_offsets import balanced_zero, follow_level, follow_zero
from collaudit.core.residual.residual import FRICTION_LEVEL_SD, Residual, ResidualInputs

#: At a place the speed of a sample may differ from the usual one by such a share, and by so many places a second where
#: the arm hardly moves.
_LIKE_SPEED, _LIKE_PLACES_S = 0.25, 10.0
#: Other cycles, or passed nights of a store, that a reference needs at each place: a median and a spread of them.
LEAST_CYCLES = 4
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
        config: how cycles are known.
        inputs: laws, and how far the zero of a torque is followed.
        earlier: what passed nights say of this residual of the program, in their order.
    """
    if config.cycles.find == "off":
        return None
    drawn = DrawnPath.of(series)
    on_path, nights = _on_known_path(drawn, earlier)
    if on_path is None:
        spans = find_cycles(series, drawn, config.cycles)
        if len(spans) < 2:
            return None
        on_path = placed(drawn, spans, usual_path(drawn, spans))
    speed = along_path_speeds(on_path, series)
    speeds = on_path.at_places(speed[:, None])[:, :, 0]
    classes = [SpeedClass.of(members, speeds, nights, LEAST_CYCLES) for members in speed_classes(speeds)]
    as_fast = _as_fast(on_path, speed, classes)
    torque = np.empty(series.position_rad.shape, order="F")
    gamma = np.empty(torque.shape, np.float32, order="F")

    def fill(j: int) -> _Steady:
        def beside(references: Callable[[SpeedClass], Iterable[tuple[int, FloatArray]]]) -> FloatArray:
            return np.where(as_fast, _at_samples(on_path, chain.from_iterable(map(references, classes))), np.nan)

        drifting, friction = _not_followed(series, residual, inputs, j)
        # what drifts is followed on the difference, which errors of the model do not move
        first = on_path.at_places(drifting[:, None])[:, :, 0]
        difference = drifting - beside(lambda one: one.references(first, j, 1))
        steady = drifting - _drift(difference, friction, series, inputs, j)
        table = on_path.at_places(steady[:, None])[:, :, 0]
        torque[:, j] = steady - beside(lambda one: one.references(table, j, LEAST_CYCLES))
        scale = beside(lambda one: one.weights(table, j, LEAST_CYCLES))
        gamma[:, j] = scale * _level(torque[:, j], scale, rule, series, j)
        torque[np.isnan(gamma[:, j]), j] = np.nan
        known = np.isfinite(torque[:, j])
        return _Steady(table, robust_sd((x := steady[known]) - median_of(x)) if known.any() else 0.0)

    made = list(ordered_map(fill, range(len(series.joint_names))))
    place = (on_path.place / (on_path.path.share.size - 1)).astype(np.float32)
    signals = CycleSignals(on_path.number, place, torque, gamma)
    largest = max(classes, key=lambda one: one.members.size, default=None)
    spread = {joint: one.spread_nm for joint, one in zip(series.joint_names, made, strict=True)}
    facts = _facts(
        series, signals, on_path.spans, drawn, spread, config, max((len(x.nights) for x in classes), default=0)
    )
    tables = np.stack([one.table_nm for one in made], axis=2)
    reference = None if largest is None else largest.kept(tables, LEAST_CYCLES, on_path.path)
    proven = np.isin(on_path.number, [int(k) for one in classes if one.nights for k in one.members])
    return CycleResidual(signals, proven, facts, reference)


@dataclass(frozen=True, slots=True, eq=False)
class _Steady:
    """One joint's residual less what drifts in it: (c, p) of each cycle at each place, and its robust spread, N·m."""

    table_nm: FloatArray
    spread_nm: float


def _not_followed(
    series: UniformSeries, residual: Residual, inputs: ResidualInputs, j: int
) -> tuple[FloatArray, FloatArray]:
    """(n,) what model and friction as fitted leave, NaN where friction is no value; and friction as fitted."""
    joint = series.joint_names[j]
    torque = residual.torque_nm[:, j] + residual.followed_nm[:, j]
    torque[residual.state[:, j] != State.JUDGED] = np.nan
    friction = np.zeros_like(torque)
    if joint in residual.levels:
        friction = inputs.laws[joint].torque(series.velocity_rad_s[:, j])
    return torque, friction


def _drift(
    difference: FloatArray, friction: FloatArray, series: UniformSeries, inputs: ResidualInputs, j: int
) -> FloatArray:
    """(n,) friction's level and the torque's zero as a difference to other cycles shows them."""
    there = np.isfinite(difference)
    rest = np.where(there, difference, 0.0)
    centred = rest - balanced_zero(rest, series.velocity_rad_s[:, j], there, series.period_s, False)
    level = follow_level(centred, friction, there, series.period_s, FRICTION_LEVEL_SD, False)
    out = friction * level.deviation
    bound = inputs.zero_bound_nm.get(series.joint_names[j], 0.0)
    zero = follow_zero(rest - out, there, series.period_s, bound, False)
    return out if zero is None else out + zero.offset_nm


def _as_fast(on_path: Placed, speed: FloatArray, classes: Sequence[SpeedClass]) -> BoolArray:
    """(n,) samples that go along the path about as fast as their class does there."""
    usual = _at_samples(on_path, ((int(k), one.speed) for one in classes for k in one.members))
    return np.asarray(np.abs(speed - usual) <= _LIKE_SPEED * usual + _LIKE_PLACES_S)


def _at_samples(on_path: Placed, references: Iterable[tuple[int, FloatArray]]) -> FloatArray:
    """(n,) what stands at the place of each sample: of each cycle its number and (p,) values; NaN without."""
    out = np.full(on_path.place.shape, np.nan)
    for k, at in references:
        out[on_path.spans[k].slice] = on_path.of_samples(k, at)
    return out


def _facts(
    series: UniformSeries,
    signals: CycleSignals,
    spans: Sequence[Span],
    drawn: DrawnPath,
    spread_nm: Mapping[str, float],
    config: Config,
    nights: int,
) -> CycleFacts:
    known = np.isfinite(signals.torque_nm)
    named = {joint: j for j, joint in enumerate(series.joint_names) if known[:, j].any()}
    compared = int(np.unique(signals.number[known.any(axis=1)]).size)
    lengths = np.array([len(span) for span in spans]) * series.period_s
    return CycleFacts(
        stated=bool(config.cycles.spans_s or config.cycles.label),
        starts_s=tuple(float(series.time_s[span.start]) for span in spans),
        duration_s=(float(lengths.min()), median_of(lengths), float(lengths.max())),
        path_rad=float(drawn.way_rad[spans[0].stop - 1] - drawn.way_rad[spans[0].start]),
        compared=compared,
        least=LEAST_CYCLES,
        nights=nights,
        gamma_nm={joint: float(np.nanmin(signals.gamma_nm[:, j])) for joint, j in named.items()},
        spread_share={
            joint: robust_sd(signals.torque_nm[known[:, j], j]) / max(spread_nm[joint], 1e-12)
            for joint, j in named.items()
        },
        judged_s={joint: float(np.count_nonzero(known[:, j])) * series.period_s for joint, j in named.items()},
        unseen=_unseen(len(spans), compared, nights),
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


def _level(torque: FloatArray, scale: FloatArray, rule: RuleFacts, series: UniformSeries, j: int) -> float:
    """Threshold of one joint's difference where its spread is usual, N·m; NaN where it has none."""
    if series.joint_names[j] not in rule.gamma_nm:
        return np.nan
    evidence = NullEvidence(torque / scale, np.isfinite(torque), series.period_s)
    levels = motion_levels([evidence], [(1,), (rule.n,)], len(rule.gamma_nm))
    # the zero is followed on the difference itself: none of it is left from one day to the next
    return float(f"{min((level.gamma_nm - level.zero_doubt_nm for level in levels), default=np.nan):.3g}")


def _unseen(cycles: int, compared: int, nights: int) -> tuple[str, ...]:
    """What the comparison of cycles does not cover."""
    where = f"in every cycle of {nights} nights" if nights else "in most cycles"
    texts = [
        f"A contact {where} is part of the reference: there the ordinary residual alone judges, at its own γ.",
        "What changes slowly over many cycles is no contact to this comparison: collaudit trend shows it.",
        "At rest and next to it, at reversals, off the path and between cycles the ordinary residual alone judges.",
    ]
    if compared < cycles:
        texts.append(
            f"{cycles - compared} of {cycles} cycles have no reference: fewer than {LEAST_CYCLES} others, or nights, "
            "that run as fast."
        )
    return tuple(texts)
