"""Friction laws fitted without a part of the time, to judge that part with: blocks of time held out in turn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.friction_result import FrictionFit, FrictionPoint
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.friction.friction_fitting import fit_friction
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.friction_points import friction_points
from collaudit.core.friction.motion_points import motion_points
from collaudit.core.friction.parameter_units import FrictionUnits
from collaudit.core.friction.sections import find_sections
from collaudit.core.numeric.arrays import BoolArray, IntArray
from collaudit.core.prepare.prepared import Prepared

#: A law that lacks more than this of the speeds of the whole fit would judge beyond what it was fitted on.
_LEAST_RANGE = 0.8
#: Blocks of time a fold at least, so that no fold is one kind of motion only.
_BLOCKS_A_FOLD = 3
_LONGEST_BLOCK_S = 10.0


def fold_of_sample(series: UniformSeries, folds: int) -> IntArray:
    """(n,) fold of each sample: blocks of time dealt out in turn, so that each fold has a part of every kind of motion.

    Args:
        series: the log.
        folds: how many there are.
    """
    duration_s = float(series.time_s[-1] - series.time_s[0]) + series.period_s
    block_s = min(_LONGEST_BLOCK_S, duration_s / (folds * _BLOCKS_A_FOLD))
    return np.asarray(np.floor((series.time_s - series.time_s[0]) / block_s).astype(np.int64) % folds)


def held_out_laws(
    prepared: Sequence[Prepared], fits: Mapping[str, FrictionFit], config: Config, fold: int
) -> dict[str, FrictionModel]:
    """Laws of all joints fitted without one fold of every log; a joint is left out where the rest cannot carry it.

    The kind of law is that of the whole fit: only its parameters are held out.

    Args:
        prepared: the logs, effort in N·m.
        fits: friction of the whole logs.
        config: how friction is fitted.
        fold: number of the fold, of ``[fit] blocks``.
    """
    rest = [_without(log, fold_of_sample(log.series, config.fit.blocks) == fold) for log in prepared]
    sections = [find_sections(log.series, config.sections) for log in rest]
    laws = {}
    for joint, fit in fits.items():
        if fit.model is None or fit.effort_unit == "raw":
            continue
        points: list[FrictionPoint] = []
        for log, found in zip(rest, sections, strict=True):
            if joint not in log.judged:
                continue
            if fit.motion != "sections":
                points += motion_points(log, joint)
            else:
                points += friction_points(log.series, found.of(joint), log.rigid_nm, config.friction)
        units = _units(prepared, joint)
        again = fit_friction(sorted(points, key=lambda p: p.speed_rad_s), units, fit.model, config.friction.robust)
        law = FrictionModel.of(again)
        if law is not None and _covers(law, fit):
            laws[joint] = law
    return laws


def _without(log: Prepared, held_out: BoolArray) -> Prepared:
    """The log with these samples (n,) marked as the fit marks effort that it must not use."""
    masked: BoolArray = np.asarray(log.series.saturated | held_out[:, None])
    return replace(log, series=replace(log.series, saturated=masked))


def _units(prepared: Sequence[Prepared], joint: str) -> FrictionUnits:
    log = next(p for p in prepared if joint in p.judged)
    return FrictionUnits.of(log.robot.joint_types[log.robot.joint_names.index(joint)], log.series.effort_unit)


def _covers(law: FrictionModel, fit: FrictionFit) -> bool:
    assert fit.speed_range_rad_s is not None
    low, high = fit.speed_range_rad_s
    return law.speed_range[1] - law.speed_range[0] >= _LEAST_RANGE * (high - low)
