"""The residual of eq. (5): measured torque less rigid-body dynamics, friction and the commanded tool force."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import DetectConfig
from collaudit.core.data.detection_result import LevelFacts, ZeroFacts
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.data.recommendation_result import JointThreshold
from collaudit.core.data.signals import State
from collaudit.core.friction.friction_model import FrictionModel, extrapolation_doubt, load_doubt, scatter_beyond
from collaudit.core.numeric.arrays import BoolArray, FloatArray, covered
from collaudit.core.numeric.filters import Kernel
from collaudit.core.numeric.parallel import each, ordered_map
from collaudit.core.prepare.calibration import coupled_doubt
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.prepare.quiet_level import QuietLevel
from collaudit.core.residual.balance import Balance
from collaudit.core.residual.followed_offsets import FrictionLevel, balanced_zero, follow_level, follow_zero
from collaudit.core.residual.friction_bounds import FrictionBounds, carried_load, friction_bounds, known_ripple

#: Beyond this multiple of the fastest speed that friction was measured at it does not tell the friction level.
BEYOND_RANGE = 1.05
#: Above that speed a joint is judged until the doubt of its friction exceeds this share of it.
MOST_DOUBT = 0.5
#: How far friction is expected to be off its calibration: standard deviation, as a share.
FRICTION_LEVEL_SD = 0.1
#: Standard errors of the friction level that the threshold carries: 95 %.
SIGMAS = 2.0


@dataclass(frozen=True, slots=True)
class ResidualInputs:
    """What is known of friction and effort when a residual is computed.

    Attributes:
        laws: fitted friction by joint.
        not_judged: joints that a finding forbids judging.
        quiet: level of still joints, which are judged for changes, with a law or without.
        covered: by joint the automatic threshold, which was read off a residual with errors of friction in it: the
            usual ones, those of speeds above the fastest fitted one that it moved at, and its ripple.
        zero_bound_nm: by joint how far the zero of its torque is followed at most; absent: not at all.
    """

    laws: Mapping[str, FrictionModel]
    not_judged: frozenset[str]
    quiet: Mapping[str, QuietLevel] = field(default_factory=dict, kw_only=True)
    covered: Mapping[str, JointThreshold] = field(default_factory=dict, kw_only=True)
    zero_bound_nm: Mapping[str, float] = field(default_factory=dict, kw_only=True)


@dataclass(frozen=True, slots=True, eq=False)
class Residual:
    """Estimate of external joint torque.

    Attributes:
        torque_nm: (n, j) residual; in state FRICTION_INTERVAL only what no friction within its interval
            explains; NaN where unknown.
        effort_nm: (n, j) measured torque that the model was compared with; None when nothing was compared.
        state: (n, j) codes of :class:`State`.
        uncertainty_nm: (n, j) what friction may be wrong by (95 %): its level, and its curve above the fastest fitted
            speed; less what the threshold covers; and what the model torque lacks of fast motion. The threshold is
            raised by it.
        followed_nm: (n, j) by how much friction and the zero of the torque are off their calibration: it was taken off.
        levels: level of friction by joint, where there is a law and a model.
        zeros: zero of the torque by joint, where it is followed.
        balance: the torques before friction, with the kernel that they and the friction have passed.
        hidden_nm: (n, j) what friction within its interval can hide beyond the threshold, whatever the sign of the
            external torque, where friction is no value, else 0. None: nothing is hidden anywhere.
        span_nm: two (n, j), the least and the greatest residual that friction within its interval allows, meaningful in
            state FRICTION_INTERVAL only; None where no joint's friction is an interval of its own.
        still: joints judged for changes of their torque.
        ripple_not_shown_nm: by joint the amplitude of a ripple that the friction file knows and this log does not show
            at its place; the threshold is raised by it, or covers it.
    """

    torque_nm: FloatArray
    effort_nm: FloatArray | None
    state: NDArray[np.int8]
    uncertainty_nm: FloatArray
    followed_nm: FloatArray
    levels: dict[str, LevelFacts]
    zeros: dict[str, ZeroFacts]
    balance: Balance
    hidden_nm: FloatArray | None = None
    span_nm: tuple[FloatArray, FloatArray] | None = None
    still: frozenset[str] = frozenset()
    ripple_not_shown_nm: dict[str, float] = field(default_factory=dict)

    @property
    def model_nm(self) -> FloatArray:
        """(n, j) rigid-body + friction + contact torque that was compared with; NaN where nothing was."""
        if self.effort_nm is None:
            return np.broadcast_to(np.nan, self.torque_nm.shape)
        return self.effort_nm - self.torque_nm


def joint_residuals(prepared: Prepared, balance: Balance, inputs: ResidualInputs, config: DetectConfig) -> Residual:
    """Take friction off a torque balance: eq. (5) per joint.

    While a joint rests, or has travelled less than a hundredth of a radian since it rested or reversed, its
    friction is only known as an interval (:mod:`friction_bounds`). There the residual is the distance of the
    unexplained torque from that interval: nonzero is evidence, zero is not a clean bill. The interval passes
    the balance's kernel like every other torque.

    Args:
        prepared: the log.
        balance: torque balance of its judged joints before friction.
        inputs: friction laws, joints that contradict the model.
        config: speed beyond which friction is not known; whether its level is followed.
    """
    series = prepared.judged_series
    names = series.joint_names
    n, count = series.position_rad.shape
    state = np.full((n, count), State.JUDGED, dtype=np.int8, order="F")
    usable = balance.total_nm is not None
    known = [j for j, joint in enumerate(names) if usable and joint in inputs.laws]
    missing = [j for j in range(count) if j not in known]
    state[:, missing] = State.NO_FRICTION if usable else State.NO_MODEL
    torque, uncertainty = (np.empty((n, count), order="F") for _ in range(2))
    torque[:, missing], uncertainty[:, missing] = np.nan, 0.0

    least, most, hidden = (np.zeros((n, count), order="F") for _ in range(3))  # most of it stays untouched
    effort = series.effort if known or inputs.quiet else None
    made = Residual(
        torque,
        effort,
        state,
        uncertainty,
        np.zeros((n, count), order="F"),
        {},
        {},
        balance,
        hidden,
        (least, most),
        frozenset(inputs.quiet),
    )

    def fill_joint(j: int) -> tuple[LevelFacts, ZeroFacts | None, float]:
        law = inputs.laws[names[j]]
        seen = inputs.covered.get(names[j])
        fastest = 0.0 if seen is None or seen.fastest_rad_s is None else seen.fastest_rad_s
        bound = inputs.zero_bound_nm.get(names[j], 0.0)
        return _fill_joint(made, j, series, law, config, carried_load(prepared, names[j], law), fastest, bound)

    for j, (level, zero, ripple_nm) in zip(known, ordered_map(fill_joint, known), strict=True):
        made.levels[names[j]] = level
        if zero is not None:
            made.zeros[names[j]] = zero
        if ripple_nm > 0:
            made.ripple_not_shown_nm[names[j]] = ripple_nm
            if names[j] not in inputs.covered:
                uncertainty[:, j] += ripple_nm
    if usable:
        _fill_changes(prepared, made, inputs)
        for j in missing:
            hidden[state[:, j] == State.FRICTION_INTERVAL, j] = np.inf
    for joint in inputs.not_judged & set(names):
        state[:, names.index(joint)] = State.UNUSABLE
    mark_reasons(state, torque, series, balance)
    if prepared.calibration.coupled and known:
        # what the torque of coupled axes, taken off the effort, may be wrong by; 0 where nothing is known
        doubt = coupled_doubt(prepared.series, prepared.calibration.coupled)
        own = doubt[:, prepared.columns()]
        uncertainty += np.nan_to_num(balance.kernel.apply(own, series.segments, series.period_s))
    for j in known:
        if seen := inputs.covered.get(names[j]):
            np.maximum(uncertainty[:, j] - seen.covered_nm, 0.0, out=uncertainty[:, j])
    if not balance.kernel.causal:  # causally no model torque is filtered apart from the effort
        for quiet in prepared.quiet:
            if quiet.joint in names:
                uncertainty[:, names.index(quiet.joint)] += quiet.lacking_nm(balance.kernel, series)
    return made


def _fill_joint(
    made: Residual,
    j: int,
    series: UniformSeries,
    law: FrictionModel,
    config: DetectConfig,
    load_nm: FloatArray | None,
    fastest_rad_s: float,
    zero_bound_nm: float,
) -> tuple[LevelFacts, ZeroFacts | None, float]:
    """Fill the columns of one joint with a friction law; its threshold covers errors up to a speed.

    Returns:
        The level of its friction, the zero of its torque where that is followed, and the amplitude of a ripple of the
        friction file that the log does not show at its place, else 0.
    """
    balance = made.balance
    torque, state, uncertainty = made.torque_nm[:, j], made.state[:, j], made.uncertainty_nm[:, j]
    assert balance.total_nm is not None and made.hidden_nm is not None and made.span_nm is not None
    velocity = np.ascontiguousarray(balance.velocity_rad_s[:, j])
    band = friction_bounds(series, j, velocity, law, load_nm)
    total = balance.total_nm[:, j]  # ripple is taken off it, for whoever looks at it later
    undecided = balance.kernel.reach(~band.steady[:, None], series.segments, series.period_s)[:, 0]
    beyond = np.abs(velocity) > BEYOND_RANGE * law.speed_range[1]
    friction = balance.kernel.apply(band.sliding_nm[:, None], series.segments, series.period_s)[:, 0]
    usable = ~(undecided | beyond | series.edge | balance.unsettled | series.saturated[:, j])
    ripple, ripple_doubt_nm = known_ripple(series, j, velocity, law, balance.kernel, total - friction, usable)
    total -= ripple
    sd = float(np.hypot(FRICTION_LEVEL_SD, band.level_sd))
    excess = total - friction
    excess -= balanced_zero(excess, velocity, usable, series.period_s, config.causal)
    level = follow_level(excess, friction, usable, series.period_s, sd, config.causal)
    made.followed_nm[:, j] = friction * level.deviation
    steady_nm = friction + made.followed_nm[:, j]
    zero = None
    if zero_bound_nm > 0.0:
        zero = follow_zero(total - steady_nm, usable, series.period_s, zero_bound_nm, config.causal)
    if zero is not None:
        total -= zero.offset_nm
        made.followed_nm[:, j] += zero.offset_nm
    torque[:] = total - steady_nm
    doubt_of_level = np.abs(friction) * (SIGMAS * level.sd)
    uncertainty[:] = np.where(np.isfinite(doubt_of_level), doubt_of_level, 0.0)
    rows = np.flatnonzero(undecided)
    uncertainty[rows] = 0.0
    least, most = (end[rows] for end in _span(total, band, level, balance.kernel, series))
    made.span_nm[0][rows, j], made.span_nm[1][rows, j], made.hidden_nm[rows, j] = least, most, most - least
    # An external torque as large as the width can leave the distance zero: friction at one end, the torque against it.
    torque[rows] = np.maximum(least, 0.0) + np.minimum(most, 0.0)
    state[rows] = State.FRICTION_INTERVAL
    doubt: FloatArray | None = None
    if (np.abs(velocity) > law.speed_range[1]).any():
        seen = ~(undecided | series.edge | balance.unsettled | series.saturated[:, j])
        shown = scatter_beyond(law, velocity, torque, seen, series.period_s)
        doubt = np.minimum(extrapolation_doubt(law, velocity), shown)
        state[beyond & ~(doubt <= MOST_DOUBT * np.abs(band.sliding_nm))] = State.TOO_FAST
        covered = extrapolation_doubt(law, np.clip(velocity, -fastest_rad_s, fastest_rad_s))
        doubt = np.maximum(doubt - covered, 0.0)
    if law.load is not None and load_nm is not None:
        carried = load_doubt(law.load, load_nm, velocity)
        doubt = carried if doubt is None else doubt + carried
    if doubt is not None and doubt.any():
        smoothed = balance.kernel.apply(np.nan_to_num(doubt)[:, None], series.segments, series.period_s)
        uncertainty += np.nan_to_num(smoothed[:, 0])
    facts = level.facts, None if zero is None else zero.facts
    if isinstance(ripple, float):
        return *facts, ripple_doubt_nm
    uncertainty += ripple_doubt_nm
    return *facts, 0.0


def _span(
    total: FloatArray, band: FrictionBounds, level: FrictionLevel, kernel: Kernel, series: UniformSeries
) -> tuple[FloatArray, FloatArray]:
    """Least and greatest external torque (n,) that the friction interval, widened by its level's error, leaves open."""
    scale = 1.0 + level.deviation
    slack = SIGMAS * level.sd * np.maximum(np.abs(band.low_nm), np.abs(band.high_nm))
    ends = np.stack([scale * band.high_nm + slack, scale * band.low_nm - slack], axis=1)
    highest, lowest = kernel.apply(ends, series.segments, series.period_s).T
    return total - highest, total - lowest


def mark_reasons(state: NDArray[np.int8], torque: FloatArray, series: UniformSeries, balance: Balance) -> None:
    """Put the reasons that hold for any joint on top of the others (the larger code wins)."""
    lost = ~covered(series.segments, state.shape[0])
    edge = series.edge | balance.unsettled
    saturated = balance.kernel.reach(np.asarray(series.saturated), series.segments, series.period_s)
    idle = None
    if series.not_driven is not None:
        idle = balance.kernel.reach(series.not_driven[:, None], series.segments, series.period_s)[:, 0]

    def mark_joint(j: int) -> None:
        column = state[:, j]

        def raise_to(where: BoolArray, code: State) -> None:
            np.maximum(column, where.view(np.int8) * np.int8(code), out=column)

        raise_to(edge, State.EDGE)
        if balance.total_nm is not None:
            raise_to(~np.isfinite(torque[:, j]) & (column < State.NO_FRICTION), State.NOT_A_NUMBER)
        raise_to(saturated[:, j], State.SATURATED)
        if idle is not None and balance.total_nm is not None:  # without a torque that is the reason all the time
            raise_to(idle, State.NOT_DRIVEN)
        column[lost] = State.GAP

    each(mark_joint, range(state.shape[1]))


def _fill_changes(prepared: Prepared, made: Residual, inputs: ResidualInputs) -> None:
    """Fill the columns of still joints: the residual is the change of their torque against its quiet level.

    Behind the gear every change of torque shows: those samples are judged. Before it friction holds what it can: a
    change is evidence of contact, no change is not evidence of absence. Where a joint has a law, torque beyond what
    friction can hold counts as well, a load that never changes among it: of both the one that stands further above
    its threshold is the residual, and the threshold in force is raised where that is the larger one.

    Args:
        prepared: the log.
        made: torque before friction through the detector's kernel, and what there is beyond friction; to be filled.
        inputs: levels of the still joints, laws.
    """
    series, balance = prepared.judged_series, made.balance
    assert balance.total_nm is not None
    for j, joint in enumerate(series.joint_names):
        quiet = inputs.quiet.get(joint)
        if quiet is None:
            continue
        level = balance.kernel.apply(quiet.level_nm[:, None], series.segments, series.period_s)[:, 0]
        change, torque = balance.total_nm[:, j] - level, made.torque_nm[:, j]
        held = State.JUDGED if prepared.effort_source == "joint" else State.FRICTION_INTERVAL
        if joint not in inputs.laws:
            torque[:], made.state[:, j] = change, held
            continue
        beyond = np.abs(torque) / quiet.beyond_nm > np.abs(change) / quiet.gamma_nm
        made.uncertainty_nm[:, j] = np.where(beyond, max(quiet.beyond_nm - quiet.gamma_nm, 0.0), 0.0)
        torque[:] = np.where(beyond, torque, change)
        np.minimum(made.state[:, j], held, out=made.state[:, j])
