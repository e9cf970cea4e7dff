"""Friction laws fitted without a part of the time, to judge that part with: blocks of time held out in turn."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import Config
from collaudit.core.data.friction_result import FrictionFit, FrictionPoint
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.dataclass import dataclass
from collaudit.core.friction.friction_fitting import fit_friction
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.friction_points import friction_points
from collaudit.core.friction.motion_points import motion_samples, points_of_samples
from collaudit.core.friction.parameter_units import FrictionUnits
from collaudit.core.friction.sections import SectionSet, find_sections
from collaudit.core.numeric.parallel import by_name, ordered_map
from collaudit.core.numeric.stage_progress import Progress
from collaudit.core.prepare.prepared import Prepared

#: A law that lacks more than this of the speeds of the whole fit would judge beyond what it was fitted on.
_LEAST_RANGE = 0.8
#: Blocks of time a fold at least, so that no fold is one kind of motion only.
_BLOCKS_A_FOLD = 3
_LONGEST_BLOCK_S = 10.0


def fold_of_sample(series: UniformSeries, folds: int) -> NDArray[np.int16]:
    """(n,) fold of each sample: blocks of time dealt out in turn, so that each fold has a part of every kind of motion.

    Args:
        series: the log.
        folds: how many there are.
    """
    duration_s = float(series.time_s[-1] - series.time_s[0]) + series.period_s
    block_s = min(_LONGEST_BLOCK_S, duration_s / (folds * _BLOCKS_A_FOLD))
    return np.asarray(np.floor((series.time_s - series.time_s[0]) / block_s).astype(np.int64) % folds, dtype=np.int16)


def held_out_laws(
    prepared: Sequence[Prepared], fits: Mapping[str, FrictionFit], config: Config, progress: Progress | None = None
) -> list[dict[str, FrictionModel]]:
    """For each fold the laws of all joints fitted without it; a joint is left out where the rest cannot carry it.

    The kind of law is that of the whole fit: only its parameters are held out.

    Args:
        prepared: the logs, effort in N·m.
        fits: friction of the whole logs.
        config: how friction is fitted, and the number of folds, ``[fit] blocks``.
        progress: called with joints done and in all.
    """
    fitted = {joint: fit for joint, fit in fits.items() if fit.model is not None and fit.effort_unit != "raw"}
    logs = [_FoldedLog.of(log, fitted.values(), config) for log in prepared]

    def points_of(joint: str) -> list[list[Sequence[FrictionPoint]]]:
        return [log.points(joint, fitted[joint], config) for log in logs if joint in log.prepared.judged]

    def laws_of(joint: str, parts: Sequence[Sequence[Sequence[FrictionPoint]]]) -> list[FrictionModel | None]:
        units = _units(prepared, joint)
        return [
            _law([point for part in parts for point in part[k]], units, fitted[joint], config)
            for k in range(config.fit.blocks)
        ]

    laws = {joint: laws_of(joint, parts) for joint, parts in by_name(points_of, fitted, progress).items()}
    return [{joint: law for joint in fitted if (law := laws[joint][k]) is not None} for k in range(config.fit.blocks)]


@dataclass(frozen=True, slots=True, eq=False)
class _FoldedLog:
    """A log with the fold of each sample (n,), and the sections of all of it where a fit is made of sections."""

    prepared: Prepared
    fold: NDArray[np.int16]
    sections: SectionSet

    @classmethod
    def of(cls, log: Prepared, fits: Iterable[FrictionFit], config: Config) -> _FoldedLog:
        none = SectionSet((), ())
        sections = find_sections(log.series, config.sections) if any(map(_of_sections, fits)) else none
        return cls(log, fold_of_sample(log.series, config.fit.blocks), sections)

    def points(self, joint: str, fit: FrictionFit, config: Config) -> list[Sequence[FrictionPoint]]:
        """Points of one joint without each fold in turn: none of its samples, and none of the sections it touches.

        What is left out of samples and sections is what :attr:`UniformSeries.saturated` would leave out of them.
        """
        log, folds = self.prepared, range(config.fit.blocks)
        if not _of_sections(fit):
            samples = motion_samples(log, joint)
            if samples is None:
                return [() for _ in folds]
            fold = self.fold[samples.rows]
            return list(ordered_map(lambda k: points_of_samples(samples, fold == k), folds))
        sections = self.sections.of(joint)
        rest = [[s for s in sections if not np.any(self.fold[s.span.slice] == k)] for k in folds]
        return [friction_points(log.series, kept, log.rigid_nm, config.friction) for kept in rest]


def _of_sections(fit: FrictionFit) -> bool:
    return fit.motion == "sections"


def _law(
    points: Sequence[FrictionPoint], units: FrictionUnits, fit: FrictionFit, config: Config
) -> FrictionModel | None:
    """The law of a fit, from these points; None where they do not cover its speeds."""
    assert fit.model is not None
    again = fit_friction(sorted(points, key=lambda p: p.speed_rad_s), units, fit.model, config.friction.robust)
    law = FrictionModel.of(again)
    return law if law is not None and _covers(law, fit) else None


def _units(prepared: Sequence[Prepared], joint: str) -> FrictionUnits:
    log = next(p for p in prepared if joint in p.judged)
    return FrictionUnits.of(log.robot.joint_types[log.robot.joint_names.index(joint)], log.series.effort_unit)


def _covers(law: FrictionModel, fit: FrictionFit) -> bool:
    assert fit.speed_range_rad_s is not None
    low, high = fit.speed_range_rad_s
    return law.speed_range[1] - law.speed_range[0] >= _LEAST_RANGE * (high - low)
