"""Hand guiding in a log: its stretches are neither judged nor fitted, and said; and how far efforts are smoothed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from collaudit.core.arm_states.arm_states import without_states
from collaudit.core.arm_states.hand_guiding import Friction, Gravity, HandGuiding, hand_guiding
from collaudit.core.config.schema import Config
from collaudit.core.config.schema_policy import PUSH_S
from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.runs import covered
from collaudit.core.numeric.stats import median_of, quantile_of
from collaudit.core.prepare.effort.effort_smoothing import effort_smoothing, smoothing_words
from collaudit.core.prepare.preparation import without_effort
from collaudit.core.prepare.prepared import Prepared

#: Stretches of motion whose mean tells friction, s; fewest of them; quantile of friction over them.
_STRETCH_S, _FEWEST, _QUANTILE = 0.25, 12, 0.7
#: Half of the means lie so close to the line, as a share of it: else errors of the model are taken for friction. On
#: simulated arms, a third of whose motion is guided, they lie within 0.1; behind joint-side sensors beyond 0.5.
_CLOSE = 0.3


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
    mask = covered((one.span for one in found), series.time_s.size)
    if series.not_driven is not None:
        mask |= series.not_driven
    findings = tuple(_finding("arm-guided", series, one, "judged") for one in found)
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
    known = _known(prepared, friction)
    if known is None:
        return prepared
    series, drive, rigid, _, laws = known
    if contact is not None:
        drive = np.where(contact[:, None], np.nan, drive)
    found = {series.joint_names[j]: one for j, one in effort_smoothing(series, drive, rigid, laws).items()}
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
    findings = tuple(_finding("fit-left-out", prepared.series, one, "fitted") for one in found)
    left_out = covered((one.span for one in found), prepared.series.time_s.size)
    return without_effort(prepared, left_out, config), findings


def rough_friction(prepared: Prepared) -> dict[str, Friction]:
    """Sliding friction F sgn v + D v by joint, from means over short stretches of motion one way.

    The line through |v| below which most of the means lie, through the slowest and the fastest third (resistant line:
    Tukey, Exploratory Data Analysis, 1977, ch. 5): in up to half of the motion the drives may supply less, as under a
    hand. Joints that hardly move, or whose effort does not go with their motion, have none.
    """
    series, rigid = prepared.series, prepared.rigid_nm
    if rigid is None or series.effort is None:
        return {}
    effort, contact = series.effort, prepared.contact_nm
    # counted by the stretches that were recorded: a gap may be of years
    _, stretch = np.unique(np.floor((series.time_s - series.time_s[0]) / _STRETCH_S), return_inverse=True)

    def of_joint(joint: str) -> tuple[float, float] | None:
        j = series.column(joint)
        rest = effort[:, j] - rigid[:, j]
        return _line(stretch, series.velocity_rad_s[:, j], rest if contact is None else rest - contact[:, j])

    lines = by_name(of_joint, prepared.judged)
    return {joint: partial(_sliding, *line) for joint, line in lines.items() if line is not None}


def _line(stretch: IntArray, velocity: FloatArray, rest: FloatArray) -> tuple[float, float] | None:
    """F in N·m and D in N·m·s/rad, both at least 0; None where there is no friction to be seen."""
    use = np.isfinite(rest) & (np.abs(velocity) >= MOVING_RAD_S)
    size, stretch, velocity, rest = int(stretch[-1]) + 1, stretch[use], velocity[use], rest[use]
    count, one_way = (np.bincount(stretch, weight, size) for weight in (np.ones(stretch.size), np.sign(velocity)))
    whole = (count > 0.5 * np.median(count[count > 0]) if count.any() else count > 0) & (np.abs(one_way) == count)
    if np.count_nonzero(whole) < _FEWEST:
        return None
    speed = np.bincount(stretch, np.abs(velocity), size)[whole] / count[whole]
    level = np.bincount(stretch, np.sign(velocity) * rest, size)[whole] / count[whole]
    slow, fast = speed <= quantile_of(speed, 1.0 / 3.0), speed >= quantile_of(speed, 2.0 / 3.0)
    ends = [(median_of(speed[third]), quantile_of(level[third], _QUANTILE)) for third in (slow, fast)]
    apart = np.diff(ends, axis=0)[0]
    viscous = max(float(apart[1] / apart[0]), 0.0) if apart[0] > 0 else 0.0
    coulomb = max(quantile_of(level - viscous * speed, _QUANTILE), 0.0)
    line = coulomb + viscous * speed
    return (coulomb, viscous) if median_of(np.abs(level - line) - _CLOSE * line) < 0 else None


def _sliding(coulomb_nm: float, viscous_nm_s_per_rad: float, velocity: FloatArray) -> FloatArray:
    return np.asarray(coulomb_nm * np.tanh(velocity / (0.5 * MOVING_RAD_S)) + viscous_nm_s_per_rad * velocity)


def _found(prepared: Prepared, friction: Mapping[str, Friction], config: Config) -> list[HandGuiding]:
    known = None if config.detect.hand_guiding == "off" else _known(prepared, friction)
    return [] if known is None else hand_guiding(*known)


def _known(
    prepared: Prepared, friction: Mapping[str, Friction]
) -> tuple[UniformSeries, FloatArray, FloatArray, Gravity, dict[int, Friction]] | None:
    """Series, drives' torque, rigid-body torque, gravity and friction by column; None without an effort in N·m."""
    series, rigid = prepared.series, prepared.rigid_nm
    if rigid is None or series.effort is None or series.effort_unit != "Nm":
        return None
    contact = prepared.contact_nm
    drive = series.effort if contact is None else series.effort - contact
    by_column = {series.column(joint): law for joint, law in friction.items()}
    return series, drive, rigid, prepared.robot.gravity_torque, by_column


def _finding(code: str, series: UniformSeries, found: HandGuiding, what: str) -> Finding:
    """That a hand guided the arm in a stretch, which is not ``what``."""
    start, end = (float(series.time_s[k]) for k in (found.span.start, found.span.stop - 1))
    joints = ", ".join(series.joint_names[j] for j in found.joints)
    supplied = 100 * max(found.share, 0.0)
    text = (
        f"From {start:.4g} to {end:.4g} s the arm moves and its drives do not move it: on {joints} their efforts hold "
        f"gravity and supply {supplied:.0f} % of what friction and inertia take; {found.work_j:.3g} J come from "
        f"outside. It looks guided by hand (freedrive) without a flag that says so; not {what} there."
    )
    return Finding(code, "warning", text, start_s=start, end_s=end)
