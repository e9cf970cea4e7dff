"""The residual of the logs that friction was fitted on, each stretch judged with laws fitted without it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.friction_correction import FrictionCorrection
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.identification_result import FrictionVariation
from collaudit.core.data.signals import State
from collaudit.core.findings import joints_not_judged
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.gear.corrected_laws import corrected_laws
from collaudit.core.friction.held_out_laws import fold_of_sample, held_out_laws
from collaudit.core.friction.joint_fits import friction_models
from collaudit.core.friction.temperature_laws import laws_at_temperature
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.detector import detector_named
from collaudit.core.residual.residual import ResidualInputs

#: Laws by joint without each fold of the time in turn.
Folds = Sequence[Mapping[str, FrictionModel]]


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
        model_nm: (n, j) modelled torque.
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
    model_nm: FloatArray
    temperature_c: FloatArray | None
    period_s: float


def held_out_residuals(
    prepared: Sequence[Prepared],
    fits: Mapping[str, FrictionFit],
    variation: Mapping[str, FrictionVariation],
    corrections: Mapping[str, FrictionCorrection],
    config: Config,
    folds: Folds | None = None,
) -> list[HeldOutResidual]:
    """Residuals of logs whose effort is in N·m and whose robot has inertials; the others have none.

    Args:
        prepared: the logs as they were fitted.
        fits: friction of all of them together, where a stretch cannot be held out.
        variation, corrections: what friction goes with besides speed, as an audit would use it.
        config: detector and rule.
        folds: laws of :func:`laws_of_folds`, where they are at hand; they are the same whatever is corrected.
    """
    laws = laws_of_folds(prepared, fits, config) if folds is None else folds
    return [_of_log(log, fits, variation, corrections, laws, config) for log in _usable(prepared)]


def laws_of_folds(prepared: Sequence[Prepared], fits: Mapping[str, FrictionFit], config: Config) -> Folds:
    """Laws without each fold in turn, of the logs that have residuals; none where no log has.

    Args:
        prepared, fits, config: as of :func:`held_out_residuals`.
    """
    usable = _usable(prepared)
    return held_out_laws(usable, fits, config) if usable else []


def _usable(prepared: Sequence[Prepared]) -> list[Prepared]:
    return [log for log in prepared if log.rigid_nm is not None and log.series.effort_unit == "Nm"]


def _of_log(
    log: Prepared,
    fits: Mapping[str, FrictionFit],
    variation: Mapping[str, FrictionVariation],
    corrections: Mapping[str, FrictionCorrection],
    folds: Folds,
    config: Config,
) -> HeldOutResidual:
    series = log.judged_series
    whole, _ = friction_models(fits, series)
    fold = fold_of_sample(series, len(folds))
    shape = series.position_rad.shape
    torque, model = np.full(shape, np.nan), np.full(shape, np.nan)
    state = np.full(shape, State.NO_FRICTION, dtype=np.int8)
    held_out = np.zeros(shape, dtype=np.bool_)
    detector = detector_named(config.detect.detector)
    barred = joints_not_judged(log.findings, log.judged)
    for k, found in enumerate(folds):
        laws = {joint: found.get(joint, law) for joint, law in whole.items()}
        laws, _ = laws_at_temperature(corrected_laws(laws, corrections), variation, series)
        residual = detector.residual(log, ResidualInputs(laws, barred), config.detect)
        rows = fold == k
        torque[rows], state[rows] = residual.torque_nm[rows], residual.state[rows]
        model[rows] = residual.model_nm[rows]
        for j, joint in enumerate(series.joint_names):
            held_out[rows, j] = joint in found
    usable = np.isfinite(torque) & ~series.saturated
    return HeldOutResidual(
        series.source.name,
        series.time_s,
        log.start.series.effort is not None and bool(np.isnan(log.start.series.effort).any()),
        series.joint_names,
        torque,
        np.asarray((state <= State.FRICTION_INTERVAL) & usable),
        np.asarray((state == State.JUDGED) & usable),
        held_out,
        series.velocity_rad_s,
        model,
        series.temperature_c,
        series.period_s,
    )
