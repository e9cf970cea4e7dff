"""The fit of an arm: drives and inertials, axes that turn with several joints, then the friction of every joint.

Friction and drive inertia of a coupled axis are told from what the model leaves on its joints. On joint j with weight w
the motor of the axis leaves w (F_c sgn s + F_v s + I ds/dt), s the axis' speed; beside it stand each joint's own
friction and offset as ``torque_terms.py`` has them, so that what its own speed explains is its own. One solve of sums
over all joints of all axes (core/torque_table). Friction dissipates: what would be negative is held at zero.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.identification_result import CoupledFriction, Coupling, Identified
from collaudit.core.errors import NotJudgedError
from collaudit.core.findings import Finding
from collaudit.core.friction.joint_fits import fit_joints, refit_joints, sections_of
from collaudit.core.friction.sections import SectionSet
from collaudit.core.identification.identification import identify
from collaudit.core.identification.motion_sums import MotionSums, collect
from collaudit.core.identification.solved_problem import Candidate
from collaudit.core.identification.torque_terms import FRICTION_COLUMNS
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.parallel import Progress, stage
from collaudit.core.numeric.stats import NORMAL_QUANTILE_975
from collaudit.core.prepare.preparation import calibrated, recalibrated
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.torque_table.block_sums import estimate, explained

_KEYS = ("coulomb_nm", "viscous_nm_s_per_rad", "inertia_kg_m2")
_LEAST_OWN_SHARE = 1e-3  # of a column's power that the other columns must leave


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


@dataclass(frozen=True, slots=True, eq=False)
class _System:
    """All equations in one, in units of each joint's own error.

    Attributes:
        products: (b, k, c, c) sums over blocks of time, of each coupled joint's columns and, last, its torque.
        count: (b, k) samples.
        place: (k, c - 1) number of the coefficient of each column: those of the axes are the first.
    """

    products: FloatArray
    count: FloatArray
    place: IntArray

    def only(self, use: BoolArray) -> FloatArray:
        """The products with columns that are not used (coefficients,) set to zero."""
        kept = np.column_stack([use[self.place], np.ones(len(self.place))])
        return self.products * kept[:, :, None] * kept[:, None, :]


def fit_coupled(
    prepared: Sequence[Prepared], config: Config, with_inertia: bool
) -> tuple[dict[str, CoupledFriction], list[Finding]]:
    """Fit every coupled axis of an arm; empty without one, or where nothing can be told, which is said.

    Args:
        prepared: logs of the arm, calibrated so far.
        config: into how many parts time is divided.
        with_inertia: whether the drive's inertia on the axis is to be identified, as other inertias are.
    """
    couplings = prepared[0].series.couplings
    if not couplings:
        return {}, []
    if any(p.rigid_nm is None or p.series.effort is None or p.series.effort_unit != "Nm" for p in prepared):
        return {}, [_undetermined(c, "model torque and effort in N·m are needed") for c in couplings]
    try:
        sums = collect(prepared, config.fit.blocks, inertials=False)
    except NotJudgedError as error:
        return {}, [_undetermined(c, error.message) for c in couplings]
    touched = (sums.coupled != 0).any(axis=0) & sums.count.any(axis=0)
    if not touched.any():
        return {}, [_undetermined(c, "its joints do not move") for c in couplings]
    system = _system(sums, np.flatnonzero(touched))
    determined = _determined(system, len(couplings), with_inertia)
    fits: dict[str, CoupledFriction] = {}
    findings = []
    values, spread = _solved(system, determined)
    for c, coupling in enumerate(couplings):
        if not determined[3 * c : 3 * c + 2].all():
            findings.append(_undetermined(coupling, "its motion cannot be separated from that of the joints"))
            continue
        found = values[3 * c : 3 * c + 3], spread[3 * c : 3 * c + 3]
        fits[coupling.joint] = _result(coupling, *found, sums.axis_speeds[c], sums.rows, with_inertia)
    return fits, findings


def _system(sums: MotionSums, touched: IntArray) -> _System:
    axes, law, own = sums.parts["axes"], sums.columns("law"), FRICTION_COLUMNS
    shared = sums.columns("axes").stop - axes
    columns = np.zeros((touched.size, sums.parts["end"], shared + own + 1))
    columns[:, np.arange(axes, axes + shared), np.arange(shared)] = np.repeat(sums.coupled[:, touched].T, 3, axis=1)
    columns[:, law, shared:-1] = np.eye(own)
    columns[:, [sums.parts["effort"], sums.parts["model"]], -1] = 1.0, -1.0
    products = np.swapaxes(columns, 1, 2) @ sums.raw[:, touched] @ columns
    count, alone = sums.count[:, touched], np.arange(shared + own)[None]
    for k in range(touched.size):
        usual = estimate(products[:, k : k + 1], count[:, k : k + 1], alone, np.zeros(alone.size))
        products[:, k] *= usual.count / max(usual.left, 1e-300)
    each = np.arange(own * touched.size).reshape(-1, own) + shared
    return _System(products, count, np.column_stack([np.broadcast_to(np.arange(shared), (len(each), shared)), each]))


def _determined(system: _System, count: int, with_inertia: bool) -> BoolArray:
    """(columns,) which columns are used: shared ones that the others do not explain, and all others."""
    use = np.ones(int(system.place.max()) + 1, dtype=np.bool_)
    if not with_inertia:
        use[2 : 3 * count : 3] = False
    for k in range(3 * count):
        if use[k]:
            gram = estimate(system.only(use), system.count, system.place, np.zeros(use.size)).products
            left = explained(np.delete(np.delete(gram, k, 0), k, 1), np.delete(gram[:, [k]], k, 0), gram[[k], k])[1]
            use[k] = bool(left[0] > _LEAST_OWN_SHARE * gram[k, k])
    return use


def _solved(system: _System, use: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients and half widths of their 95 % intervals, (columns,); zero where a column is not used."""
    shared = np.arange(use.size) < use.size - FRICTION_COLUMNS * len(system.place)
    while True:
        found = estimate(system.only(use), system.count, system.place, np.zeros(use.size))
        negative = shared & use & (found.value < 0)
        if not negative.any():
            return found.value, NORMAL_QUANTILE_975 * np.sqrt(np.maximum(np.diag(found.covariance), 0.0))
        use = use & ~negative


def _result(
    coupling: Coupling, x: FloatArray, half: FloatArray, speeds: FloatArray, rows: int, with_inertia: bool
) -> CoupledFriction:
    keys = _KEYS if with_inertia else _KEYS[:2]
    return CoupledFriction(
        weights=coupling.weights,
        coulomb_nm=float(x[0]),
        viscous_nm_s_per_rad=float(x[1]),
        inertia_kg_m2=float(x[2]) if with_inertia else None,
        ci95={key: (float(v - h), float(v + h)) for key, v, h in zip(keys, x, half, strict=False)},
        speed_range_rad_s=(float(speeds[0]), float(speeds[1])),
        samples=rows,
    )


def _undetermined(coupling: Coupling, why: str) -> Finding:
    text = (
        f"The friction of the coupled axis {coupling.words} could not be determined: {why}. It stays in the "
        "friction of the "
        "single joints."
    )
    return Finding("fit-doubtful", "warning", text, joint=coupling.joint)
