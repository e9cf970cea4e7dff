"""The fit of an arm: drives and inertials, axes that turn with several joints, then the friction of every joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.identification_result import CoupledFriction, Identified
from collaudit.core.findings import Finding
from collaudit.core.friction.joint_fits import fit_joints, refit_joints, sections_of
from collaudit.core.friction.sections import SectionSet
from collaudit.core.identification.coupled_axes import fit_coupled
from collaudit.core.identification.identification import identify
from collaudit.core.identification.motion_sums import MotionSums, collect
from collaudit.core.identification.solved_problem import Candidate
from collaudit.core.numeric.arrays import BoolArray
from collaudit.core.numeric.parallel import Progress, stage
from collaudit.core.prepare.preparation import calibrated, recalibrated
from collaudit.core.prepare.prepared import Prepared


@dataclass(frozen=True, slots=True, eq=False)
class ArmFit:
    """What a fit finds of an arm.

    Attributes:
        logs: calibrated with it, whole.
        identified: drives, inertials, tool; None where only friction was fitted.
        coupled: friction of axes that turn with several joints.
        fits: friction by joint.
        findings: on the coupled axes.
        sections: of each log, its constant speeds.
        sums: of what drives, inertials and tool were identified from, for fits without a part of it; None where only
            friction was fitted.
    """

    logs: tuple[Prepared, ...]
    identified: Identified | None
    coupled: Mapping[str, CoupledFriction]
    fits: Mapping[str, FrictionFit]
    findings: tuple[Finding, ...]
    sections: tuple[SectionSet, ...]
    sums: MotionSums | None


def fit_arm(
    logs: Sequence[Prepared],
    taken: Candidate,
    config: Config,
    left_out: Sequence[BoolArray] | None = None,
    known: ArmFit | None = None,
    sums: MotionSums | None = None,
    progress: Progress | None = None,
) -> ArmFit:
    """Fit an arm from its logs.

    Args:
        logs: calibrated with what is known of the sensor, cleaned of contact.
        taken: what is identified beside friction.
        config: how.
        left_out: of each log the samples (n,) that are not to be fitted; None for none.
        known: the fit of the whole logs: only the values of its laws are found again, without intervals; None chooses
            each law.
        sums: of what is to be fitted; None to gather them here.
        progress: called with steps done and in all.
    """

    def seen(some: Sequence[Prepared]) -> list[Prepared]:
        masks = left_out if left_out is not None else [None] * len(some)
        return [log if mask is None else without_samples(log, mask) for log, mask in zip(some, masks, strict=True)]

    whole = list(logs)
    again = calibrated if known is None else recalibrated
    if known is None:
        sums = (sums or collect(seen(whole), config.fit.blocks)) if taken.estimate else None
    else:
        sums = known.sums if known.sums is None or left_out is None else known.sums.without(left_out)
    identified = None if sums is None else identify(whole, config, taken, sums, only_values=known is not None)
    if identified is not None:
        starts = whole if known is None else known.logs
        drives = [replace(log.calibration, identified=identified, coupled={}) for log in starts]
        whole = [again(log, drive, config) for log, drive in zip(starts, drives, strict=True)]
    coupled, findings = fit_coupled(seen(whole), config, "inertials" in taken.estimate)
    if coupled:
        whole = [again(log, replace(log.calibration, coupled=coupled), config) for log in whole]
    if known is None:
        sections = sections_of(seen(whole), config, stage(progress, 0.0, 0.35))
        fits = fit_joints(seen(whole), config, stage(progress, 0.35, 1.0), sections)
        silent = [j for j, fit in fits.items() if fit.model is None and _has_no_gain(j, logs, identified)]
        if silent:  # their friction is known in the log's own unit
            fits |= {j: fit for j, fit in fit_joints(seen(logs), config).items() if j in silent}
    else:
        sections = list(known.sections)
        fits = refit_joints(seen(whole), known.fits, sections, config)
    return ArmFit(tuple(whole), identified, coupled, fits, tuple(findings), tuple(sections), sums)


def _has_no_gain(joint: str, logs: Sequence[Prepared], identified: Identified | None) -> bool:
    return logs[0].series.effort_unit == "raw" and identified is not None and identified.joints[joint].gain is None


def without_samples(prepared: Prepared, left_out: BoolArray) -> Prepared:
    """The same log with the effort of some samples (n,) unknown; its model torque and findings stay as they are."""
    effort = prepared.series.effort
    if effort is None:
        return prepared
    known = effort.copy(order="K")
    known[left_out] = np.nan
    return replace(prepared, series=replace(prepared.series, effort=known))
