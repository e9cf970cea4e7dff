"""The residual of the logs of a fit, each stretch of time judged by a fit of everything that has not seen it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import Config, DetectConfig
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.identification_result import FrictionVariation
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.data.signals import State
from collaudit.core.findings import joints_not_judged
from collaudit.core.friction.arm_fit import ArmFit, fit_arm
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.friction_variation import laws_at_temperature
from collaudit.core.friction.joint_fits import friction_models
from collaudit.core.identification.solved_problem import Candidate
from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span, run_bounds, widened
from collaudit.core.numeric.parallel import Progress
from collaudit.core.numeric.stats import median_of
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.detector import detector_named
from collaudit.core.residual.residual import Residual, ResidualInputs
from collaudit.core.torque_table.log_samples import fold_count, fold_of_sample

#: The residual of a block is computed with so much of the log on either side: what a joint did before tells where
#: friction is steady, and how its level is.
_AROUND_S = 2.0
#: A law without so much of the speeds of the whole fit would judge beyond what it was fitted on.
_LEAST_RANGE = 0.8


@dataclass(frozen=True, slots=True, eq=False)
class HeldOutResidual:
    """Residual of one log.

    Attributes:
        prepared: the log, as the fit of all of it has it.
        torque_nm: (n, j) residual.
        evidence: (n, j) samples on which the rule could fire.
        judged: (n, j) those of them at which friction is a value.
        held_out: (n, j) those whose law was fitted without them.
        doubt_nm: (k, j) what friction may be wrong by (95 %), its median over the judged samples of each fold; NaN
            without any.
    """

    prepared: Prepared
    torque_nm: FloatArray
    evidence: BoolArray
    judged: BoolArray
    held_out: BoolArray
    doubt_nm: FloatArray

    @property
    def series(self) -> UniformSeries:
        """The judged joints."""
        return self.prepared.judged_series

    def model_nm(self, j: int) -> FloatArray:
        """(n,) modelled torque of a joint; NaN where nothing was compared."""
        effort = self.series.effort
        if effort is None:
            return np.full(self.torque_nm.shape[0], np.nan)
        return np.asarray(effort[:, j] - self.torque_nm[:, j])


def held_out_residuals(
    logs: Sequence[Prepared],
    whole: ArmFit,
    taken: Candidate,
    variation: Mapping[str, FrictionVariation],
    config: Config,
    progress: Progress | None = None,
    left_out: Sequence[BoolArray] | None = None,
) -> list[HeldOutResidual]:
    """Residuals of logs whose effort is in N·m and whose robot has inertials; none where one has neither.

    Args:
        logs: as :func:`fit_arm` was given them.
        whole: the fit of all of them, or of what is not left out.
        taken: what is identified.
        variation: trends of the whole fit.
        config: detector, number of folds.
        progress: called with steps done and in all.
        left_out: of each log the samples (n,) that no fold is fitted on, and that are no evidence; None for none.
    """
    if any(log.rigid_nm is None or log.series.effort_unit != "Nm" for log in whole.logs):
        return []
    count = fold_count([log.series for log in logs], config.fit.blocks)
    folds = [fold_of_sample(log.series, count) for log in logs]
    unseen = left_out or [np.zeros(fold.size, dtype=np.bool_) for fold in folds]
    out = [_Filling.of(log) for log in whole.logs]
    for k in range(count):
        held = [(fold == k) | left for fold, left in zip(folds, unseen, strict=True)]
        rest = fit_arm(logs, taken, config, held, whole)
        for log, fold, filling in zip(rest.logs, folds, out, strict=True):
            filling.fill(log, fold == k, whole, rest, variation, config)
        if progress is not None:
            progress(k + 1, count)
    return [filling.made(log, left) for filling, log, left in zip(out, whole.logs, unseen, strict=True)]


@dataclass(frozen=True, slots=True, eq=False)
class _Filling:
    """The residual of one log on its way, fold by fold; arrays are (n, j)."""

    torque: FloatArray
    state: NDArray[np.int8]
    held_out: BoolArray
    doubts: list[FloatArray]

    @classmethod
    def of(cls, log: Prepared) -> _Filling:
        shape = log.judged_series.position_rad.shape
        torque = np.full(shape, np.nan, order="F")
        state = np.full(shape, State.NO_FRICTION, dtype=np.int8, order="F")
        return cls(torque, state, np.zeros(shape, dtype=np.bool_), [])

    def fill(
        self,
        log: Prepared,
        own_fold: BoolArray,
        whole: ArmFit,
        rest: ArmFit,
        variation: Mapping[str, FrictionVariation],
        config: Config,
    ) -> None:
        """Fill the samples of one fold by the fit without it; joints that it cannot carry keep the law of the whole."""
        if not own_fold.any():  # a log of less than a block
            return
        near = widened(own_fold, round(_AROUND_S / log.series.period_s))
        part = log.part(*(Span(a, b) for a, b in zip(*run_bounds(near), strict=True)))
        rows, inside, series = np.flatnonzero(own_fold), own_fold[near], part.judged_series
        laws, _ = friction_models(whole.fits, series)
        own, _ = friction_models(rest.fits, series)
        kept = {joint: _carries(rest.fits[joint], fit) for joint, fit in whole.fits.items() if joint in own}
        own = {joint: law for joint, law in own.items() if joint in laws and kept[joint]}
        held = np.array([joint in own for joint in series.joint_names])
        laws = laws_at_temperature({**laws, **own}, variation, series)[0]
        found = residual_by(part, laws, config.detect)
        self.torque[rows], self.state[rows], self.held_out[rows] = found.torque_nm[inside], found.state[inside], held
        self.doubts.append(_usual_doubt(found, inside))

    def made(self, log: Prepared, left_out: BoolArray) -> HeldOutResidual:
        """The whole of it."""
        usable = np.isfinite(self.torque) & ~log.judged_series.saturated & ~left_out[:, None]
        evidence, judged = (np.asarray((self.state <= s) & usable) for s in (State.FRICTION_INTERVAL, State.JUDGED))
        return HeldOutResidual(log, self.torque, evidence, judged, self.held_out, np.array(self.doubts))


def _usual_doubt(found: Residual, inside: BoolArray) -> FloatArray:
    """(j,) the median over the judged samples of what friction may be wrong by; NaN without any."""
    judged = inside[:, None] & (found.state == State.JUDGED)
    columns = zip(found.uncertainty_nm.T, judged.T, strict=True)
    return np.array([median_of(doubt[its]) if its.any() else np.nan for doubt, its in columns])


def residual_by(log: Prepared, laws: Mapping[str, FrictionModel], detect: DetectConfig) -> Residual:
    """The residual of a log by friction laws and the configured detector."""
    inputs = ResidualInputs(laws, joints_not_judged(log.findings, log.judged))
    return detector_named(detect.detector).residual(log, inputs, detect)


def _carries(rest: FrictionFit, whole: FrictionFit) -> bool:
    """Whether a part of the points tells the law of all: over most of its speeds, and its rate where that is known.

    Without slow points in one direction a rate has no end, and what fades with it is any number of N·m.
    """
    if rest.speed_range_rad_s is None or whole.speed_range_rad_s is None:
        return False
    (low, high), (least, most) = rest.speed_range_rad_s, whole.speed_range_rad_s
    return high - low >= _LEAST_RANGE * (most - least) and rest.identifiable >= whole.identifiable
