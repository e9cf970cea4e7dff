"""The residual of the logs that friction was fitted on, each stretch judged with laws fitted without it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import Config
from collaudit.core.data.friction_correction import FrictionCorrection
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.identification_result import FrictionVariation
from collaudit.core.data.signals import State
from collaudit.core.dataclass import dataclass
from collaudit.core.findings import joints_not_judged
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.gear.corrected_laws import corrected_laws
from collaudit.core.friction.held_out_laws import fold_of_sample, held_out_laws
from collaudit.core.friction.joint_fits import friction_models
from collaudit.core.friction.temperature_laws import laws_at_temperature
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stage_progress import Progress, stage
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.recommend.fold_residual import FoldResidual, fold_residual
from collaudit.core.residual.balance import Balance
from collaudit.core.residual.detector import detector_named
from collaudit.core.residual.residual import ResidualInputs


@dataclass(frozen=True, slots=True, eq=False)
class Folds:
    """What held-out residuals are made of, whatever is corrected.

    Attributes:
        laws: by joint, without each fold of the time in turn.
        balances: of each log that has a residual, where the detector works joint by joint; None where it does not.
    """

    laws: Sequence[Mapping[str, FrictionModel]]
    balances: Sequence[Balance | None]


@dataclass(frozen=True, slots=True, eq=False)
class HeldOutResidual:
    """Residual of one log.

    Attributes:
        log: its name.
        time_s: (n,).
        touched: whether its fit left something out.
        joint_names: the judged joints.
        torque_nm: (n, j) residual.
        evidence: (n, j) samples on which the rule could fire.
        judged: (n, j) those of them at which friction is a value.
        held_out: (n, j) those whose law was fitted without them.
        velocity_rad_s: (n, j) of the joint.
        effort_nm: (n, j) measured torque; None without.
        temperature_c: (n, j), or None.
        period_s: sample period, s.
    """

    log: str
    time_s: FloatArray
    touched: bool
    joint_names: tuple[str, ...]
    torque_nm: FloatArray
    evidence: BoolArray
    judged: BoolArray
    held_out: BoolArray
    velocity_rad_s: FloatArray
    effort_nm: FloatArray | None
    temperature_c: FloatArray | None
    period_s: float

    def model_nm(self, rows: BoolArray, j: int) -> FloatArray:
        """(k,) modelled torque of a joint at (n,) rows; NaN where nothing was compared."""
        if self.effort_nm is None:
            return np.full(np.count_nonzero(rows), np.nan)
        return np.asarray(self.effort_nm[rows, j] - self.torque_nm[rows, j])


def held_out_residuals(
    prepared: Sequence[Prepared],
    fits: Mapping[str, FrictionFit],
    variation: Mapping[str, FrictionVariation],
    corrections: Mapping[str, FrictionCorrection],
    config: Config,
    folds: Folds | None = None,
    progress: Progress | None = None,
) -> list[HeldOutResidual]:
    """Residuals of logs whose effort is in N·m and whose robot has inertials; the others have none.

    Args:
        prepared: the logs as they were fitted.
        fits: friction of all of them together, where a stretch cannot be held out.
        variation, corrections: what friction goes with besides speed, as an audit would use it.
        config: detector and rule.
        folds: of :func:`folds_of`, where they are at hand.
        progress: called with steps done and in all.
    """
    known = folds_of(prepared, fits, config) if folds is None else folds
    out: list[HeldOutResidual] = []
    usable = _usable(prepared)
    for log, balance in zip(usable, known.balances, strict=True):
        part = stage(progress, len(out) / len(usable), (len(out) + 1) / len(usable))
        out.append(_of_log(log, _laws(log, fits, variation, corrections, known), balance, config, part))
    return out


def folds_of(
    prepared: Sequence[Prepared], fits: Mapping[str, FrictionFit], config: Config, progress: Progress | None = None
) -> Folds:
    """Laws without each fold in turn, of the logs that have residuals, and their balances; none where no log has.

    Args:
        prepared, fits, config, progress: as of :func:`held_out_residuals`.
    """
    usable = _usable(prepared)
    if not usable:
        return Folds((), ())
    make = detector_named(config.detect.detector).balance
    balances = [None if make is None else make(log, config.detect) for log in usable]
    return Folds(held_out_laws(usable, fits, config, progress), balances)


def joint_by_joint(config: Config) -> bool:
    """Whether the residual of a joint is the same whatever laws other joints have."""
    return detector_named(config.detect.detector).balance is not None


def _usable(prepared: Sequence[Prepared]) -> list[Prepared]:
    return [log for log in prepared if log.rigid_nm is not None and log.series.effort_unit == "Nm"]


@dataclass(frozen=True, slots=True, eq=False)
class _Laws:
    """Laws of one log in each fold, corrected, and by fold the joints whose law was fitted without it."""

    by_fold: Sequence[Mapping[str, FrictionModel]]
    held_out: Sequence[Collection[str]]


def _laws(
    log: Prepared,
    fits: Mapping[str, FrictionFit],
    variation: Mapping[str, FrictionVariation],
    corrections: Mapping[str, FrictionCorrection],
    folds: Folds,
) -> _Laws:
    series = log.judged_series
    whole, _ = friction_models(fits, series)
    by_fold = []
    for found in folds.laws:
        laws = corrected_laws({joint: found.get(joint, law) for joint, law in whole.items()}, corrections)
        by_fold.append(laws_at_temperature(laws, variation, series)[0])
    return _Laws(by_fold, [found.keys() for found in folds.laws])


def _of_log(
    log: Prepared, laws: _Laws, balance: Balance | None, config: Config, progress: Progress | None = None
) -> HeldOutResidual:
    series = log.judged_series
    fold = fold_of_sample(series, len(laws.by_fold))
    barred = joints_not_judged(log.findings, log.judged)
    if balance is None or balance.total_nm is None:
        found = _fold_by_fold(log, laws, fold, barred, config)
    else:
        each = [[found.get(joint) for found in laws.by_fold] for joint in series.joint_names]
        found = fold_residual(log, balance, each, fold, barred, config.detect, progress)
    held = np.array([[joint in known for joint in series.joint_names] for known in laws.held_out])
    return HeldOutResidual(
        series.source.name,
        series.time_s,
        log.start.series.effort is not None and bool(np.isnan(log.start.series.effort).any()),
        series.joint_names,
        found.torque_nm,
        found.evidence,
        found.judged,
        held[fold],
        series.velocity_rad_s,
        series.effort,
        series.temperature_c,
        series.period_s,
    )


def _fold_by_fold(
    log: Prepared, laws: _Laws, fold: NDArray[np.int16], barred: frozenset[str], config: Config
) -> FoldResidual:
    """As :func:`fold_residual`, of any detector: the whole residual once for every fold."""
    series = log.judged_series
    torque = np.full(series.position_rad.shape, np.nan)
    state = np.full(torque.shape, State.NO_FRICTION, dtype=np.int8)
    for k, found in enumerate(laws.by_fold):
        inputs = ResidualInputs(found, barred)
        residual = detector_named(config.detect.detector).residual(log, inputs, config.detect)
        rows = fold == k
        torque[rows], state[rows] = residual.torque_nm[rows], residual.state[rows]
    usable = np.isfinite(torque) & ~series.saturated
    evidence: BoolArray = np.asarray((state <= State.FRICTION_INTERVAL) & usable)
    return FoldResidual(torque, evidence, np.asarray((state == State.JUDGED) & usable))
