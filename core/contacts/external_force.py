"""The external force at a link from the joints' residuals: least squares with its uncertainty, and what is blind.

A pure force F on the robot at the origin of the isolated link's frame gives residuals tau_e = -J_v(q)^T F (tau_e of
eq. (5) is what the drives bring up against it). With k joints up to that link this is k equations for three
unknowns. Directions whose singular value is small are not seen by any joint, and are named instead of guessed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.data.detection_result import ContactForce
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.blocks import blocks
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.stats import STANDARD_ERRORS_95, robust_sd
from collaudit.core.prepare.prepared import Prepared

#: Lever arms below this (m) see a force too faintly to say anything.
_BLIND_M = 0.03
#: A contact is somewhere on its link, not at its origin (m, standard deviation of its lever arm about an axis): the
#: torque that this adds is no misfit.
_OFF_ORIGIN_M = 0.05
_AVERAGED_S = 0.02
#: A link further out explains the joints as well if its weighted squared misfit is not larger by this.
_CHI2 = 6.0
#: Residual level assumed where the log has too little clean motion to measure it, N·m.
_DEFAULT_NOISE_NM = 1.0
_LEAST_CLEAN = 100


@dataclass(frozen=True, slots=True, eq=False)
class Unsmoothed:
    """Residuals without the detector's kernel, which lowers the peak of a short push.

    Attributes:
        noise_nm: (j,) robust standard deviation of each joint's judged residual over the log.
        near: torque balance (w, j) that has passed the kernel around the samples where contacts are looked at.
    """

    noise_nm: FloatArray
    near: Mapping[int, FloatArray]

    @classmethod
    def of(cls, prepared: Prepared, run: DetectorRun, samples: Sequence[int]) -> Unsmoothed:
        """Of a log, with what is needed at these samples: a balance that is computed where it is read is read once."""
        total, joints = run.residual.balance.total_nm, run.detected.state.shape[1]
        windows = {} if total is None else {k: _window(prepared, k) for k in samples}
        near = {k: np.empty((len(prepared.series.time_s[w]), joints), order="F") for k, w in windows.items()}

        def of_joint(j: int) -> float:
            column = None if total is None else np.asarray(total[:, j])
            if column is not None:
                for k, window in windows.items():
                    near[k][:, j] = column[window]
            return _noise(prepared, run, j, column)

        return cls(np.array(list(ordered_map(of_joint, range(joints)))), near)


def _unsmoothed(
    prepared: Prepared, run: DetectorRun, rows: slice, columns: Sequence[int], total: FloatArray | None
) -> FloatArray:
    """Residuals of some samples and judged joints, of which ``total`` (w, k) is the balance through the kernel.

    Friction, which changes slowly, is as it was taken off after the kernel.
    """
    residual = run.residual.torque_nm[rows][:, columns]
    effort = prepared.series.effort
    if prepared.rigid_nm is None or effort is None or total is None:
        return residual
    own = [prepared.columns()[j] for j in columns]
    balance = effort[rows][:, own] - prepared.rigid_nm[rows][:, own]
    if prepared.contact_nm is not None:
        balance -= prepared.contact_nm[rows][:, own]
    return np.asarray(balance + residual - total)


def estimate_force(
    prepared: Prepared, run: DetectorRun, known: Unsmoothed, names: Sequence[str], sample: int
) -> ContactForce | None:
    """External force at the link moved by the outermost of the joints that reacted.

    Args:
        prepared: the log and its model.
        run: residuals and states.
        known: residuals without the kernel, at this sample too.
        names: joints that alarmed, base to tip.
        sample: where to look; residuals are averaged over 20 ms around it.

    Returns:
        None without a kinematic model, or when no joint up to the link can be used.
    """
    robot = prepared.robot
    frame = robot.link_of(names[-1])
    if robot.bodies is None or frame is None:
        return None
    q = prepared.series.position_rad[sample]
    if not np.isfinite(q).all():
        return None
    outer = robot.joint_names.index(names[-1])
    solutions = [
        solution
        for k in range(outer, len(robot.joint_names))
        if (solution := _at_link(prepared, run, known, names, k, sample, q)) is not None
    ]
    if not solutions or solutions[0][0].frame != frame:
        return None
    own, misfit = solutions[0]
    fitting = [force for force, worse in solutions[1:] if worse <= misfit + _CHI2]
    intervals = [own.size_ci95_n, *(force.size_ci95_n for force in fitting)]
    span = (min(i[0] for i in intervals), max(i[1] for i in intervals))
    return replace(own, size_ci95_n=span, may_be_at=tuple(force.frame for force in fitting))


def _at_link(
    prepared: Prepared,
    run: DetectorRun,
    known: Unsmoothed,
    names: Sequence[str],
    outer: int,
    sample: int,
    q: FloatArray,
) -> tuple[ContactForce, float] | None:
    """The force as if it acted at the link of one joint, and the weighted squared misfit over its joints."""
    series, robot = prepared.judged_series, prepared.robot
    frame = robot.link_of(robot.joint_names[outer])
    if frame is None:
        return None
    used = [
        j
        for j, joint in enumerate(series.joint_names)
        if robot.joint_names.index(joint) <= outer and (run.detected.state[sample, j] == State.JUDGED or joint in names)
    ]
    torque = averaged_torque(prepared, run, known, used, sample)
    noise = known.noise_nm[used]
    columns = [robot.joint_names.index(series.joint_names[j]) for j in used]
    arm, rotation = _lever_arms(prepared, q, frame, columns)
    force = _solve(arm, torque, noise, rotation, frame)
    if force is None:
        return None
    noise = np.hypot(noise, _OFF_ORIGIN_M * force.size_n)
    force = _solve(arm, torque, noise, rotation, frame) or force
    left = torque + arm @ (rotation.T @ np.array(force.force_n))
    return force, float(np.sum((left / np.maximum(noise, 1e-3)) ** 2))


def averaged_torque(
    prepared: Prepared, run: DetectorRun, known: Unsmoothed, columns: Sequence[int], sample: int
) -> FloatArray:
    """(k,) residual of some judged joints before the kernel, averaged over 20 ms around a sample, N·m."""
    total = known.near[sample][:, columns] if known.near else None
    return np.asarray(np.nanmean(_unsmoothed(prepared, run, _window(prepared, sample), columns, total), axis=0))


def _window(prepared: Prepared, sample: int) -> slice:
    half = max(1, round(0.5 * _AVERAGED_S / prepared.series.period_s))
    return slice(max(0, sample - half), sample + half + 1)


def _lever_arms(prepared: Prepared, q: FloatArray, frame: str, columns: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """(k, 3) torque of each joint per newton along the frame's axes, and the frame's (3, 3) rotation in the base."""
    robot = prepared.robot
    unit = np.hstack([np.eye(3), np.zeros((3, 3))])
    jt = robot.wrench_torque(np.repeat(q[None, :], 3, axis=0), unit, frame)
    return np.ascontiguousarray(jt[:, list(columns)].T), robot.frame_rotation(q, frame)


def _noise(prepared: Prepared, run: DetectorRun, j: int, total: FloatArray | None) -> float:
    judged = run.detected.state[:, j] == State.JUDGED
    if np.count_nonzero(judged) < _LEAST_CLEAN:
        return _DEFAULT_NOISE_NM

    def part(block: slice) -> FloatArray:
        here = None if total is None else total[block, None]
        return np.asarray(_unsmoothed(prepared, run, block, [j], here)[judged[block], 0])

    x = np.concatenate([part(block) for block in blocks(judged.size)])
    return robust_sd(x[~np.isnan(x)])


def _solve(
    arm: FloatArray, torque: FloatArray, noise: FloatArray, rotation: FloatArray, frame: str
) -> ContactForce | None:
    """Weighted least squares over the directions that are seen."""
    weight = 1.0 / np.maximum(noise, 1e-3)
    lengths = np.linalg.svd(arm, compute_uv=False)
    if lengths.size == 0 or lengths[0] < _BLIND_M:
        return None
    _, _, directions = np.linalg.svd(arm)
    size = np.concatenate([lengths, np.zeros(3 - lengths.size)])
    seen = directions[size >= _BLIND_M]
    reduced = (arm @ seen.T) * weight[:, None]
    inverse = np.linalg.pinv(reduced)
    # tau_e is what the drives bring up: the force on the robot is its negative.
    amount = -(inverse @ (torque * weight))
    force = seen.T @ amount
    misfit = torque + arm @ force
    spare = torque.size - seen.shape[0]
    inflate = max(1.0, float(np.sqrt(np.sum((misfit * weight) ** 2) / spare))) if spare > 0 else 1.0
    covariance = inflate**2 * (inverse @ inverse.T)
    in_base = rotation @ force
    spread = rotation @ seen.T @ covariance @ seen @ rotation.T
    blind = [rotation @ d for d in directions[size < _BLIND_M]]
    total = float(np.linalg.norm(force))
    along = amount / total if total > 0 else np.ones_like(amount) / np.sqrt(amount.size)
    width = STANDARD_ERRORS_95 * float(np.sqrt(along @ covariance @ along))
    hidden = [any(abs(b[axis]) > 0.5 for b in blind) for axis in range(3)]
    half = [None if hidden[i] else STANDARD_ERRORS_95 * float(np.sqrt(spread[i, i])) for i in range(3)]
    return ContactForce(
        frame=frame,
        force_n=(float(in_base[0]), float(in_base[1]), float(in_base[2])),
        ci95_n=(half[0], half[1], half[2]),
        size_n=total,
        size_ci95_n=(max(0.0, total - width), total + width),
        blind=tuple((float(b[0]), float(b[1]), float(b[2])) for b in blind),
        misfit_nm=float(np.sqrt(np.mean(misfit**2))),
    )
