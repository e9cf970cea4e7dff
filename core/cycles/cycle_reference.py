"""The second residual: what a cycle leaves beyond the same place of other cycles, or of earlier nights.

The difference has its own level by the law that the first residual has, and stands under the same rule. Envelopes over
repeated programs: Zhang and Jing 2019, [6] of the paper.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

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
from collaudit.core.data.cycles_result import CycleFacts, CycleReference
from collaudit.core.data.signals import CycleSignals, State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span
from collaudit.core.numeric.parallel import each
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
    drifting, friction = _not_followed(series, residual, inputs)
    speed = along_path_speeds(on_path, series)
    speeds = on_path.at_places(speed)[:, :, 0]
    classes = [SpeedClass.of(members, speeds, nights, LEAST_CYCLES) for members in speed_classes(speeds)]
    # what drifts is followed on the difference, which errors of the model do not move
    first = on_path.at_places(drifting)
    difference = _beside(on_path, drifting, speed, classes, lambda one: one.references(first, 1))
    steady = drifting - _drift(difference, friction, series, inputs)
    table = on_path.at_places(steady)
    torque = _beside(on_path, steady, speed, classes, lambda one: one.references(table, LEAST_CYCLES))
    scale = _beside(on_path, np.zeros_like(steady), speed, classes, lambda one: one.weights(table, LEAST_CYCLES))
    gamma = (-scale * _levels(torque, -scale, rule, series)).astype(np.float32)
    torque[np.isnan(gamma)] = np.nan
    place = (on_path.place / (on_path.path.share.size - 1)).astype(np.float32)
    signals = CycleSignals(on_path.number, place, torque, gamma)
    largest = max(classes, key=lambda one: one.members.size, default=None)
    facts = _facts(
        series, signals, on_path.spans, drawn, steady, config, max((len(x.nights) for x in classes), default=0)
    )
    reference = None if largest is None else largest.kept(table, LEAST_CYCLES, on_path.path)
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


def _drift(difference: FloatArray, friction: FloatArray, series: UniformSeries, inputs: ResidualInputs) -> FloatArray:
    """(n, j) friction's level and the torque's zero as a difference to other cycles shows them."""
    out = np.zeros_like(difference)

    def of_joint(j: int) -> None:
        there = np.isfinite(difference[:, j])
        rest = np.where(there, difference[:, j], 0.0)
        centred = rest - balanced_zero(rest, series.velocity_rad_s[:, j], there, series.period_s, False)
        level = follow_level(centred, friction[:, j], there, series.period_s, FRICTION_LEVEL_SD, False)
        out[:, j] = friction[:, j] * level.deviation
        bound = inputs.zero_bound_nm.get(series.joint_names[j], 0.0)
        zero = follow_zero(rest - out[:, j], there, series.period_s, bound, False)
        if zero is not None:
            out[:, j] += zero.offset_nm

    each(of_joint, range(difference.shape[1]))
    return out


def _beside(
    on_path: Placed,
    torque: FloatArray,
    speed: FloatArray,
    classes: Sequence[SpeedClass],
    references: Callable[[SpeedClass], Iterable[tuple[int, FloatArray]]],
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
        least=LEAST_CYCLES,
        nights=nights,
        gamma_nm={joint: float(np.nanmin(signals.gamma_nm[:, j])) for joint, j in named.items()},
        spread_share={
            joint: robust_sd(signals.torque_nm[known[:, j], j]) / max(before[joint], 1e-12)
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
