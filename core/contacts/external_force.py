"""The external force at a link from the joints' residuals: least squares with its uncertainty, and what is blind.

A pure force F on the robot at the origin of the isolated link's frame gives residuals tau_e = -J_v(q)^T F (tau_e of
eq. (5) is what the drives bring up against it). With k joints up to that link this is k equations for three
unknowns. Directions whose singular value is small are seen by no joint: they are left out and named, not guessed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.contacts.contact_scene import ArmAtSamples
from collaudit.core.data.detection_result import ContactForce
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.stats import STANDARD_ERRORS_95, robust_sd
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
#: Lever arms below this (m) see a force too faintly to say anything.
_BLIND_M = 0.03


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
        """Of a log, with what is needed at these samples."""
        joints = run.detected.state.shape[1]
        windows = {k: _window(prepared, k) for k in samples}
        near = {k: np.empty((len(prepared.series.time_s[w]), joints), order="F") for k, w in windows.items()}

        def of_joint(j: int) -> float:
            residual = _residual_of(prepared, run, j)
            for k, window in windows.items():
                near[k][:, j] = residual[window]
            return _noise(residual[run.detected.state[:, j] == State.JUDGED])

        return cls(np.array(list(ordered_map(of_joint, range(joints)))), near)

    def torque_nm(self, sample: int) -> FloatArray:
        """(j,) residual averaged over 20 ms around one of the samples; NaN where it is not known."""
        near = self.near_nm[sample]
        known = ~np.isnan(near)
        with np.errstate(invalid="ignore"):
            return np.asarray(np.where(known, near, 0.0).sum(axis=0) / np.count_nonzero(known, axis=0))


def _residual_of(prepared: Prepared, run: DetectorRun, j: int) -> FloatArray:
    """(n,) residual of a judged joint without the kernel; friction, which changes slowly, is as it was taken off."""
    smoothed, total = run.residual.torque_nm[:, j], run.residual.balance.total_nm
    if prepared.rigid_nm is None or prepared.series.effort is None or total is None:
        return smoothed
    own = prepared.columns()[j]
    balance = prepared.series.effort[:, own] - prepared.rigid_nm[:, own]
    if prepared.contact_nm is not None:
        balance -= prepared.contact_nm[:, own]
    return np.asarray(balance + smoothed - total[:, j])


def estimate_force(
    at: ArmAtSamples, run: DetectorRun, known: Unsmoothed, names: Sequence[str], sample: int
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
    fits: list[_ForceFit] = []
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
    at: ArmAtSamples, frame: str, used: Sequence[int], torque: FloatArray, noise: FloatArray, sample: int
) -> _ForceFit | None:
    """As if the force acted on a link near its frame; None where no judged joint that counts sees any."""
    arm = np.ascontiguousarray(at.lever_arms(frame, sample)[:, [at.columns[j] for j in used]].T)
    directions = _Directions.of(arm)
    if directions is None:
        return None
    size_n = _ForceFit.of(frame, arm, directions, torque, noise).size_n
    return _ForceFit.of(frame, arm, directions, torque, np.hypot(noise, _OFF_ORIGIN_M * size_n))


def _window(prepared: Prepared, sample: int) -> slice:
    half = max(1, round(0.5 * _AVERAGED_S / prepared.series.period_s))
    return slice(max(0, sample - half), sample + half + 1)


def _noise(judged_nm: FloatArray) -> float:
    x = judged_nm[~np.isnan(judged_nm)]
    return robust_sd(x) if x.size >= _LEAST_CLEAN else _DEFAULT_NOISE_NM


@dataclass(frozen=True, slots=True, eq=False)
class _Directions:
    """Directions of a force in a frame's axes: (k, 3) those that some joint sees, and (3 - k, 3) the others."""

    seen: FloatArray
    blind: FloatArray

    @classmethod
    def of(cls, arm: FloatArray) -> _Directions | None:
        """Of lever arms (joints, 3); None where nothing is seen."""
        if arm.size == 0:
            return None
        _, lengths, directions = np.linalg.svd(arm)
        if lengths[0] < _BLIND_M:
            return None
        size = np.concatenate([lengths, np.zeros(3 - lengths.size)])
        return cls(directions[size >= _BLIND_M], directions[size < _BLIND_M])


@dataclass(frozen=True, slots=True, eq=False)
class _ForceFit:
    """A force at a frame by weighted least squares of its torques, over the directions that are seen.

    Attributes:
        frame: of the link.
        arm: (k, 3) lever arms of the joints that count.
        directions: of the force.
        torque: (k,) of the joints, N·m.
        weight: (k,) 1 / N·m.
        inverse: (d, k) pseudoinverse of the weighted lever arms along the directions that are seen.
        amount: (d,) of the force along them, N.
    """

    frame: str
    arm: FloatArray
    directions: _Directions
    torque: FloatArray
    weight: FloatArray
    inverse: FloatArray
    amount: FloatArray

    @classmethod
    def of(
        cls, frame: str, arm: FloatArray, directions: _Directions, torque: FloatArray, noise: FloatArray
    ) -> _ForceFit:
        """With the standard deviations (k,) of the torques, N·m."""
        weight = 1.0 / np.maximum(noise, 1e-3)
        inverse: FloatArray = np.asarray(np.linalg.pinv((arm @ directions.seen.T) * weight[:, None]), dtype=np.float64)
        # tau_e is what the drives bring up: the force on the robot is its negative.
        return cls(frame, arm, directions, torque, weight, inverse, -(inverse @ (torque * weight)))

    @property
    def force_n(self) -> FloatArray:
        """(3,) in the frame's axes."""
        return np.asarray(self.directions.seen.T @ self.amount)

    @property
    def size_n(self) -> float:
        """Of the force."""
        return float(np.linalg.norm(self.force_n))

    @property
    def misfit(self) -> float:
        """Weighted, squared, of all joints."""
        return float(np.sum(((self.torque + self.arm @ self.force_n) * self.weight) ** 2))

    def described(self, rotation: FloatArray) -> ContactForce:
        """The force with its uncertainty; ``rotation`` (3, 3) turns the frame's axes to those of the base."""
        force, seen, amount = self.force_n, self.directions.seen, self.amount
        misfit = self.torque + self.arm @ force
        spare = self.torque.size - seen.shape[0]
        inflate = max(1.0, float(np.sqrt(np.sum((misfit * self.weight) ** 2) / spare))) if spare > 0 else 1.0
        covariance = inflate**2 * (self.inverse @ self.inverse.T)
        in_base = rotation @ force
        spread = rotation @ seen.T @ covariance @ seen @ rotation.T
        blind = [rotation @ d for d in self.directions.blind]
        total = self.size_n
        along = amount / total if total > 0 else np.ones_like(amount) / np.sqrt(amount.size)
        width = STANDARD_ERRORS_95 * float(np.sqrt(along @ covariance @ along))
        hidden = [any(abs(b[axis]) > 0.5 for b in blind) for axis in range(3)]
        half = [None if hidden[i] else STANDARD_ERRORS_95 * float(np.sqrt(spread[i, i])) for i in range(3)]
        return ContactForce(
            frame=self.frame,
            force_n=(float(in_base[0]), float(in_base[1]), float(in_base[2])),
            ci95_n=(half[0], half[1], half[2]),
            size_n=total,
            size_ci95_n=(max(0.0, total - width), total + width),
            blind=tuple((float(b[0]), float(b[1]), float(b[2])) for b in blind),
            misfit_nm=float(np.sqrt(np.mean(misfit**2))),
        )
