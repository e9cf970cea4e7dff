"""Hand guiding in a log: its stretches are neither judged nor fitted, and said; and how far efforts are smoothed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from collaudit.core.arm_states.arm_states import without_states
from collaudit.core.config.schema import Config
from collaudit.core.config.schema_judging import PUSH_S
from collaudit.core.data.joint_log import MOVING_RAD_S, UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.prepare.effort_smoothing import Friction, effort_smoothing, smoothing_words
from collaudit.core.prepare.hand_guiding import HandGuiding, hand_guiding
from collaudit.core.prepare.preparation import without_effort
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.torque_table.thinned_log import TorqueTable, thinned

#: Of friction's line over speed one coefficient beside the other.
_EITHER = ("way", "along"), ("along", "way")


def without_guiding(prepared: Prepared, friction: Mapping[str, Friction], config: Config) -> Prepared:
    """The log with stretches of hand guiding marked as not driven, and a finding for each.

    Args:
        prepared: the log to be judged.
        friction: sliding friction by joint.
        config: ``[detect] hand_guiding``.
    """
    found = _found(prepared, friction, config)
    if not found:
        return prepared
    series = prepared.series
    mask = _covered(series, found)
    if series.not_driven is not None:
        mask |= series.not_driven
    findings = tuple(_finding("arm-guided", one, "judged") for one in found)
    marked = without_states(series, mask)
    return replace(prepared, series=marked, findings=(*prepared.findings, *findings))


def with_effort_smoothing(
    prepared: Prepared, friction: Mapping[str, Friction], contact: BoolArray | None = None
) -> Prepared:
    """The log with how far its efforts are smoothed, and a finding where that is more than a drive does, or unknown.

    Args:
        prepared: the log to be judged.
        friction: sliding friction by joint.
        contact: (n,) samples that are not looked at.
    """
    table = _table(prepared)
    if table is None:
        return prepared
    if contact is not None:
        touched = thinned(contact[:, None].astype(np.float64), round(table.period_s / prepared.series.period_s))
        table = replace(table, effort=np.where(touched > 0.0, np.nan, table.effort))
    found = effort_smoothing(table, friction)
    shown = {joint: one for joint, one in found.items() if one.shown}
    findings = prepared.findings
    if shown:
        text = smoothing_words(shown, PUSH_S)
        findings = (*findings, Finding("effort-filtered", "warning", text))
    if unknown := [joint for joint, one in found.items() if not (one.bounded or one.shown)]:
        text = (
            f"How far the efforts of {', '.join(unknown)} are smoothed on their way into the log is not known: the "
            "motion is too slow to show it. No push there counts as noticed. Faster motion in the log shows it."
        )
        findings = (*findings, Finding("effort-filtered", "warning", text))
    return replace(prepared, findings=findings, effort_smoothing=found)


def fitted_without_guiding(prepared: Prepared, config: Config) -> tuple[Prepared, tuple[Finding, ...]]:
    """A log that is to be fitted, with the effort unknown where a hand guided the arm, and a finding for each stretch.

    Friction is not known yet: :func:`rough_friction` of the log itself stands for it.
    """
    found = _found(prepared, rough_friction(prepared), config)
    if not found:
        return prepared, ()
    findings = tuple(_finding("fit-left-out", one, "fitted") for one in found)
    return without_effort(prepared, _covered(prepared.series, found), config), findings


def rough_friction(prepared: Prepared) -> dict[str, Friction]:
    """Sliding friction F sgn v + D v by joint, of motion one way, as most of its seconds have it.

    In some of the motion the drives may supply less, as under a hand. Joints that hardly move, or whose effort does not
    go with their motion, have none.
    """
    table, found = _table(prepared), dict[str, Friction]()
    if table is None:
        return {}
    # counted by the rows that were recorded: a gap may be of years
    recorded = replace(table, time_s=np.arange(table.time_s.size) * np.float64(table.period_s))
    along = table.way * np.abs(table.motion[1])
    for joint, sums in recorded.sums(rest=table.effort - table.model, along=along).items():
        level = sums.slope("rest", "way", "beyond", "one")
        coulomb, viscous = (sums.slope("rest", *two, "one", least_own=0.0) for two in _EITHER)
        if joint in prepared.judged and level is not None and level.positive and coulomb and viscous:
            found[joint] = partial(_sliding, max(coulomb.value, 0.0), max(viscous.value, 0.0))
    return found


def _sliding(coulomb_nm: float, viscous_nm_s_per_rad: float, velocity: FloatArray) -> FloatArray:
    return np.asarray(coulomb_nm * np.tanh(velocity / (0.5 * MOVING_RAD_S)) + viscous_nm_s_per_rad * velocity)


def _found(prepared: Prepared, friction: Mapping[str, Friction], config: Config) -> list[HandGuiding]:
    table = None if config.detect.hand_guiding == "off" else _table(prepared)
    return [] if table is None else hand_guiding(table, prepared.robot.gravity_torque, friction)


def _table(prepared: Prepared) -> TorqueTable | None:
    """What the drives exert beside the tool's commanded force, and the rigid bodies' torque; None where unknown."""
    series, rigid, start = prepared.series, prepared.rigid_nm, prepared.start.table
    if rigid is None or start is None or series.effort is None or series.effort_unit != "Nm":
        return None
    contact = prepared.contact_nm
    driven = series if contact is None else replace(series, effort=series.effort - contact)
    return start.seen(driven, rigid)


def _covered(series: UniformSeries, found: Sequence[HandGuiding]) -> BoolArray:
    """(n,) samples in one of the stretches."""
    out = np.zeros(series.time_s.size, dtype=np.bool_)
    for one in found:
        out |= (series.time_s >= one.start_s) & (series.time_s < one.end_s)
    return out


def _finding(code: str, found: HandGuiding, what: str) -> Finding:
    """That a hand guided the arm in a stretch, which is not ``what``."""
    text = (
        f"From {found.start_s:.4g} to {found.end_s:.4g} s the arm moves and its drives do not move it: on "
        f"{', '.join(found.joints)} their efforts hold gravity and supply {100 * max(found.share, 0.0):.0f} % of what "
        f"friction and inertia take; {found.work_j:.3g} J come from outside. It looks guided by hand (freedrive) "
        f"without a flag that says so; not {what} there."
    )
    return Finding(code, "warning", text, start_s=found.start_s, end_s=found.end_s)
