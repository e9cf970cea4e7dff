"""Whether subtracting the model makes the torque any smaller, and where not, what is the likely cause."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.data.signals import State
from collaudit.core.data.uniform_series import MOVING_RAD_S
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.filters import differentiate, low_pass
from collaudit.core.numeric.parallel import by_name
from collaudit.core.prepare.prepared import Prepared

#: A model that leaves this share of the torque's spread explains nothing.
_NO_GAIN = 0.9
_LEAST_S = 5.0
_MOST_SAMPLES = 5000
#: Share of the residual's spread in the model's fast part above which that is the cause.
_FAST_SHARE = 0.5
#: A part of the model whose fitted factor lies outside of these is off.
_RIGHT = (0.7, 1.4)
#: Share of the residual's power that a shift in time has to explain.
_DELAY_SHARE = 0.2


def model_worth_findings(prepared: Prepared, run: DetectorRun, inputs: DetectionInputs) -> list[Finding]:
    """Watched joints whose residual in motion spreads as much as their measured torque does.

    Args:
        prepared: the log and its model.
        run: what the detector made of it.
        inputs: which joints are watched.
    """
    series, residual = prepared.judged_series, run.residual
    if residual.effort_nm is None or prepared.rigid_nm is None or not residual.isolation.isolates:
        return []

    def of_joint(joint: str) -> Finding | None:
        j = series.column(joint)
        assert residual.effort_nm is not None
        moving = np.abs(series.velocity_rad_s[:, j]) > MOVING_RAD_S
        good = (run.detected.state[:, j] == State.JUDGED) & moving & np.isfinite(residual.effort_nm[:, j])
        if np.count_nonzero(good) * series.period_s < _LEAST_S:
            return None
        effort = residual.effort_nm[:, j]
        after = float(np.std(residual.torque_nm[:, j][good]))
        before = float(np.std(_smoothed(run, effort, prepared)[good]))
        if after <= _NO_GAIN * before:
            return None
        rows = np.flatnonzero(good)
        text = (
            f"Subtracting model and friction does not reduce the torque of joint '{joint}': in motion the "
            f"residual spreads by {after:.3g} N·m (standard deviation), the measured torque by {before:.3g} N·m. "
            f"Likely cause: {_cause(prepared, run, joint, j, rows)}."
        )
        return Finding("model-no-gain", "warning", text, joint=joint)

    found = by_name(
        of_joint, [name for name in series.joint_names if inputs.watch[name].watched and name in inputs.laws]
    )
    return [finding for finding in found.values() if finding is not None]


def _smoothed(run: DetectorRun, x: FloatArray, prepared: Prepared) -> FloatArray:
    """(n,) through the kernel that the residual has passed."""
    series = prepared.judged_series
    return run.residual.balance.kernel.apply(x[:, None], series.segments, series.period_s)[:, 0]


@dataclass(frozen=True, slots=True)
class _Parts:
    """Torques of one joint at some samples, N·m: measured, gravity, the rest of the rigid-body torque, what is left."""

    measured: FloatArray
    gravity: FloatArray
    inertial: FloatArray
    left: FloatArray


def _cause(prepared: Prepared, run: DetectorRun, joint: str, j: int, rows: IntArray) -> str:
    """The first cause that the parts of the model show, in words."""
    smoothing = prepared.effort_smoothing.get(joint)
    if smoothing is not None and smoothing.shown:
        return f"the effort is smoothed over {smoothing.low_s:.2g} s or more on its way into the log"
    series, column = prepared.series, prepared.series.column(joint)
    assert prepared.rigid_nm is not None
    rigid = _smoothed(run, prepared.rigid_nm[:, column], prepared)
    left = run.residual.torque_nm[:, j]
    slow = low_pass(rigid[:, None], series.segments, series.period_s, 0.25 * series.bandwidth_hz)[:, 0]
    fast = float(np.nanstd((rigid - slow)[rows]))
    if fast > _FAST_SHARE * float(np.std(left[rows])):
        return (
            f"noise of the acceleration ({fast:.2g} N·m of the model's torque are faster than "
            f"{0.25 * series.bandwidth_hz:.2g} Hz); a lower [conditioning] bandwidth_hz, or a detector without "
            "acceleration, helps"
        )
    rate = differentiate(rigid[:, None], series.segments, series.period_s)[:, 0]
    late_s = _delay(left[rows], rate[rows])
    if late_s is not None:
        return f"the effort is {abs(1e3 * late_s):.2g} ms {'late' if late_s > 0 else 'early'} against the motion"
    picked = rows[:: max(1, rows.size // _MOST_SAMPLES)]
    gravity = prepared.robot.gravity_torque(series.position_rad[picked])[:, column]
    assert run.residual.effort_nm is not None
    measured = _smoothed(run, run.residual.effort_nm[:, j], prepared)[picked]
    friction = measured - rigid[picked] - left[picked]
    return _wrong_part(_Parts(measured, gravity, rigid[picked] - gravity, left[picked]), friction)


def _delay(left: FloatArray, rate: FloatArray) -> float | None:
    """Shift in time that explains the residual, s: measured(t) = model(t - d) leaves -d times the model's rate."""
    known = np.isfinite(left) & np.isfinite(rate)
    r, x = rate[known] - rate[known].mean(), left[known] - left[known].mean()
    power, total = float(r @ r), float(x @ x)
    if power <= 0 or total <= 0 or float(r @ x) ** 2 < _DELAY_SHARE * power * total:
        return None
    return -float(r @ x) / power


def _wrong_part(parts: _Parts, friction: FloatArray) -> str:
    """The part of the model whose factor in the measured torque is furthest from one."""
    names = ("gravity", "inertia", "friction")
    columns = np.column_stack([parts.gravity, parts.inertial, friction])
    spread = columns.std(axis=0)
    known = np.flatnonzero(spread > 0.2 * float(np.std(parts.left)))
    if known.size == 0:
        return "the model's torque is too small on this joint to matter; what is left is noise of the effort"
    design = np.column_stack([columns[:, known], np.ones(columns.shape[0])])
    factor = np.linalg.lstsq(design, parts.measured, rcond=None)[0][: known.size]
    worst = int(np.argmax(spread[known] * np.abs(factor - 1.0)))
    name, value = names[int(known[worst])], float(factor[worst])
    if value < 0:
        return f"an inverted sign: {name} is in the measured torque with the factor {value:.2g}"
    if not _RIGHT[0] < value < _RIGHT[1]:
        what = "the effort's gain, or the inertials" if name != "friction" else "friction of another arm or warmth"
        return f"{what}: {name} is in the measured torque with the factor {value:.2g}"
    return "none of the known ones; noise of the effort, or a torque that is not modelled"
