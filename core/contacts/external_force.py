"""The external force at a link from the joints' residuals: least squares with its uncertainty, and what is blind.

A pure force F on the robot at the origin of the isolated link's frame gives residuals tau_e = -J_v(q)^T F (tau_e of
eq. (5) is what the drives bring up against it). With k joints up to that link this is k equations for three
unknowns (:mod:`force_fit`). Directions that no joint sees are named instead of guessed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.contacts.force_fit import Directions, ForceFit
from collaudit.core.contacts.looked_at import LookedAt
from collaudit.core.data.detection_result import ContactForce
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.stats import robust_sd
from collaudit.core.prepare.prepared import Prepared

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
        near_nm: residuals (w, j) around the samples where contacts are looked at.
    """

    noise_nm: FloatArray
    near_nm: Mapping[int, FloatArray]

    @classmethod
    def of(cls, prepared: Prepared, run: DetectorRun, samples: Sequence[int]) -> Unsmoothed:
        """Of a log, with what is needed at these samples: a balance that is computed where it is read is read once."""
        total, joints = run.residual.balance.total_nm, run.detected.state.shape[1]
        windows = {k: _window(prepared, k) for k in samples}
        near = {k: np.empty((len(prepared.series.time_s[w]), joints), order="F") for k, w in windows.items()}

        def of_joint(j: int) -> float:
            residual = _residual_of(prepared, run, j, None if total is None else total[:, j])
            for k, window in windows.items():
                near[k][:, j] = residual(window)
            return _noise(run, j, residual)

        return cls(np.array(list(ordered_map(of_joint, range(joints)))), near)

    def torque_nm(self, sample: int) -> FloatArray:
        """(j,) residual averaged over 20 ms around one of the samples; NaN where it is not known."""
        near = self.near_nm[sample]
        known = ~np.isnan(near)
        with np.errstate(invalid="ignore"):
            return np.asarray(np.where(known, near, 0.0).sum(axis=0) / np.count_nonzero(known, axis=0))


def _residual_of(
    prepared: Prepared, run: DetectorRun, j: int, total: FloatArray | None
) -> Callable[[slice], FloatArray]:
    """The residual of a judged joint at a slice of samples; ``total`` (n,) is its balance through the kernel.

    Friction, which changes slowly, is as it was taken off after the kernel.
    """
    smoothed = run.residual.torque_nm[:, j]
    if prepared.rigid_nm is None or prepared.series.effort is None or total is None:
        return smoothed.__getitem__
    own = prepared.columns()[j]
    effort, rigid = prepared.series.effort[:, own], prepared.rigid_nm[:, own]
    contact = None if prepared.contact_nm is None else prepared.contact_nm[:, own]

    def at(rows: slice) -> FloatArray:
        balance = effort[rows] - rigid[rows]
        if contact is not None:
            balance -= contact[rows]
        balance += smoothed[rows]
        balance -= total[rows]
        return balance

    return at


def estimate_force(
    at: LookedAt, run: DetectorRun, known: Unsmoothed, names: Sequence[str], sample: int
) -> ContactForce | None:
    """External force at the link moved by the outermost of the joints that reacted.

    Args:
        at: the arm where contacts are looked at, at this sample too.
        run: residuals and states.
        known: residuals without the kernel, at this sample too.
        names: joints that alarmed, base to tip.
        sample: where to look; residuals are averaged over 20 ms around it.

    Returns:
        None without a kinematic model, or when no joint up to the link can be used.
    """
    robot = at.robot
    outer = robot.joint_names.index(names[-1])
    frame = at.links[outer]
    if robot.bodies is None or frame is None or not at.position_known(sample):
        return None
    state, judged = run.detected.state[sample], at.judged
    torque = known.torque_nm(sample)
    there = np.isfinite(torque)  # an alarm may reach into time in which its joint's effort is missing
    usable = [j for j, joint in enumerate(judged) if there[j] and (state[j] == State.JUDGED or joint in names)]
    fits: list[ForceFit] = []
    for k, link in enumerate(at.links[outer:], outer):
        used = [j for j in usable if at.columns[j] <= k]
        fit = None if link is None else _at_link(at, link, used, torque[used], known.noise_nm[used], sample)
        if fit is not None:
            fits.append(fit)
    if not fits or fits[0].frame != frame:
        return None
    near = [fit for fit in fits[1:] if fit.misfit <= fits[0].misfit + _CHI2]
    own, *fitting = [fit.described(at.rotation(fit.frame, sample)) for fit in (fits[0], *near)]
    intervals = [own.size_ci95_n, *(force.size_ci95_n for force in fitting)]
    span = (min(i[0] for i in intervals), max(i[1] for i in intervals))
    return replace(own, size_ci95_n=span, may_be_at=tuple(force.frame for force in fitting))


def _at_link(
    at: LookedAt, frame: str, used: Sequence[int], torque: FloatArray, noise: FloatArray, sample: int
) -> ForceFit | None:
    """As if the force acted on a link near its frame; None where no judged joint that counts sees any."""
    arm = np.ascontiguousarray(at.lever_arms(frame, sample)[:, [at.columns[j] for j in used]].T)
    directions = Directions.of(arm)
    if directions is None:
        return None
    size_n = ForceFit.of(frame, arm, directions, torque, noise).size_n
    return ForceFit.of(frame, arm, directions, torque, np.hypot(noise, _OFF_ORIGIN_M * size_n))


def _window(prepared: Prepared, sample: int) -> slice:
    half = max(1, round(0.5 * _AVERAGED_S / prepared.series.period_s))
    return slice(max(0, sample - half), sample + half + 1)


def _noise(run: DetectorRun, j: int, residual: Callable[[slice], FloatArray]) -> float:
    judged = run.detected.state[:, j] == State.JUDGED
    x = residual(slice(None))[judged]
    x = x[~np.isnan(x)]
    return robust_sd(x) if x.size >= _LEAST_CLEAN else _DEFAULT_NOISE_NM
