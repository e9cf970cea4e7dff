"""The external force at a link from the joints' residuals: least squares with its uncertainty, and what is blind.

A pure force F on the robot at a point of a link gives residuals tau_e = -J_v(q)^T F (tau_e of
eq. (5) is what the drives bring up against it). With k joints up to that link this is k equations for three
unknowns. Directions whose singular value is small are seen by no joint: they are left out and named, not guessed.

A force at a point turns a joint by at most its size times the point's distance from the joint's axis. Whatever the
direction, and wherever on the links that the joint moves, the least force is therefore torque / longest distance. That
holds where too few joints react to tell a direction, and needs no assumption about the place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.contacts.contact_scene import ArmAtSamples
from collaudit.core.data.detection_result import ContactForce, LeastForce, LinkForce
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.stats import STANDARD_ERRORS_95, robust_sd
from collaudit.core.prepare.prepared import Prepared

#: A contact is on the surface of its link, not on the line between its joints (m, standard deviation of its lever arm
#: about an axis): the torque that this adds is no misfit.
_OFF_POINT_M = 0.05
_AVERAGED_S = 0.02
#: A place explains the joints as well as the best one if its weighted squared misfit is not larger by this.
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
        half = max(1, round(0.5 * _AVERAGED_S / prepared.series.period_s))
        windows = {k: slice(max(0, k - half), k + half + 1) for k in samples}
        near = {k: np.empty((len(prepared.series.time_s[w]), joints), order="F") for k, w in windows.items()}

        def of_joint(j: int) -> float:
            residual = _residual_of(prepared, run, j)
            for k, window in windows.items():
                near[k][:, j] = residual[window]
            clean = residual[(run.detected.state[:, j] == State.JUDGED) & ~np.isnan(residual)]
            return robust_sd(clean) if clean.size >= _LEAST_CLEAN else _DEFAULT_NOISE_NM

        return cls(np.array(list(ordered_map(of_joint, range(joints)))), near)

    def torque_nm(self, sample: int) -> FloatArray:
        """(j,) residual averaged over 20 ms around one of the samples; NaN where it is not known."""
        near = self.near_nm[sample]
        known = ~np.isnan(near)
        with np.errstate(invalid="ignore"):
            return np.asarray(np.where(known, near, 0.0).sum(axis=0) / np.count_nonzero(known, axis=0))


def _residual_of(prepared: Prepared, run: DetectorRun, j: int) -> FloatArray:
    """(n,) residual of a judged joint without the kernel; friction, which changes slowly, is as it was taken off.

    Where the same place of other cycles tells more, what those leave is taken off as well.
    """
    (smoothed, _), total = run.strongest(j), run.residual.balance.total_nm
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
    """External force on the links on which the contact can be: of the outermost joint that reacted, and further out.

    A force is tried at points along each of them, and what explains the joints as well as the best one is possible.

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
    places: list[_Place] = []
    for k in range(outer, len(at.links)):
        inner = [j for j in usable if at.columns[j] <= k]
        beyond = [j for j in usable if at.columns[j] > k]  # a force on this link turns none of these
        left = float(np.sum((torque[beyond] / known.noise_nm[beyond]) ** 2))
        for point in at.points_of_link(k, sample):
            arm = np.ascontiguousarray(point[:, [at.columns[j] for j in inner]].T)
            fit = _ForceFit.near(arm, torque[inner], known.noise_nm[inner])
            places.append(_Place(k, left if fit is None else left + fit.misfit, fit))
    if not any(place.fit for place in places):
        return None
    most = min(place.misfit for place in places if place.fit) + _CHI2
    possible = [place for place in places if place.misfit <= most]
    forces = {k: [place for place in possible if place.link == k] for k in dict.fromkeys(p.link for p in possible)}
    links = tuple(
        LinkForce(at.links[k] or frame, robot.joint_names[k], *_hull([place.size_ci95_n for place in of_link]))
        for k, of_link in forces.items()
    )
    seen = ((place, place.fit) for place in possible if place.fit)
    best, fit = min(seen, key=lambda one: (round(one[0].misfit, 3), one[0].link))  # where links meet, the inner one
    own = fit.described(at.links[best.link] or frame)
    return replace(own, size_ci95_n=_hull([(link.low_n, link.high_n) for link in links]), links=links)


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """A point of a link on which a contact may be.

    Attributes:
        link: its number.
        misfit: weighted squared torque that a force there leaves unexplained, of joints further out too.
        fit: the force; None where the point is on the axes of all joints that count, which only the surface turns.
    """

    link: int
    misfit: float
    fit: _ForceFit | None

    @property
    def size_ci95_n(self) -> tuple[float, float | None]:
        return (0.0, None) if self.fit is None else self.fit.described("").size_ci95_n


def _hull(intervals: Sequence[tuple[float, float | None]]) -> tuple[float, float | None]:
    highs = [high for _, high in intervals if high is not None]
    return min(low for low, _ in intervals), max(highs) if len(highs) == len(intervals) else None


def without_guess(force: ContactForce | None) -> ContactForce | None:
    """The force without direction and size where it may have a part in a direction that no joint sees."""
    return force if force is None or not force.blind else replace(force, force_n=None, size_n=None)


@dataclass(frozen=True, slots=True, eq=False)
class _ForceFit:
    """A force at a frame by weighted least squares of its torques, over the directions that are seen.

    Attributes:
        arm: (k, 3) lever arms of the joints that count, along the axes of the base.
        seen, blind: (d, 3) directions of a force in base axes that some joint sees, and (3 - d, 3) the others.
        torque: (k,) of the joints, N·m.
        weight: (k,) 1 / N·m.
        inverse: (d, k) pseudoinverse of the weighted lever arms along the directions that are seen.
        amount: (d,) of the force along them, N.
    """

    arm: FloatArray
    seen: FloatArray
    blind: FloatArray
    torque: FloatArray
    weight: FloatArray
    inverse: FloatArray
    amount: FloatArray

    @classmethod
    def near(cls, arm: FloatArray, torque: FloatArray, noise: FloatArray) -> _ForceFit | None:
        """As if the force acted near a point with these lever arms; None where no joint that counts sees any."""
        if arm.size == 0:
            return None
        _, lengths, directions = np.linalg.svd(arm)
        sees = np.append(lengths, np.zeros(3 - lengths.size)) >= _BLIND_M
        if not sees.any():
            return None
        size_n = cls.of(arm, directions, sees, torque, noise).size_n
        return cls.of(arm, directions, sees, torque, np.hypot(noise, _OFF_POINT_M * size_n))

    @classmethod
    def of(
        cls, arm: FloatArray, directions: FloatArray, sees: BoolArray, torque: FloatArray, noise: FloatArray
    ) -> _ForceFit:
        """Of three directions (3, 3), which of them (3,) are seen, and the torques' standard deviations (k,), N·m."""
        weight, seen = 1.0 / np.maximum(noise, 1e-3), directions[sees]
        inverse: FloatArray = np.asarray(np.linalg.pinv((arm @ seen.T) * weight[:, None]), dtype=np.float64)
        # tau_e is what the drives bring up: the force on the robot is its negative.
        return cls(arm, seen, directions[~sees], torque, weight, inverse, -(inverse @ (torque * weight)))

    @property
    def force_n(self) -> FloatArray:
        """(3,) in base axes."""
        return np.asarray(self.seen.T @ self.amount)

    @property
    def size_n(self) -> float:
        """Of the force."""
        return float(np.linalg.norm(self.force_n))

    @property
    def misfit(self) -> float:
        """Weighted, squared, of all joints."""
        return float(np.sum(((self.torque + self.arm @ self.force_n) * self.weight) ** 2))

    def described(self, frame: str) -> ContactForce:
        """The force with its uncertainty."""
        force, seen, blind, amount, total = self.force_n, self.seen, self.blind, self.amount, self.size_n
        misfit = self.torque + self.arm @ force
        spare = self.torque.size - seen.shape[0]
        inflate = max(1.0, float(np.sqrt(np.sum((misfit * self.weight) ** 2) / spare))) if spare > 0 else 1.0
        covariance = inflate**2 * (self.inverse @ self.inverse.T)
        spread = seen.T @ covariance @ seen
        along = amount / total if total > 0 else np.ones_like(amount) / np.sqrt(amount.size)
        width = STANDARD_ERRORS_95 * float(np.sqrt(along @ covariance @ along))
        hidden = [any(abs(b[axis]) > 0.5 for b in blind) for axis in range(3)]
        half = [None if hidden[i] else STANDARD_ERRORS_95 * float(np.sqrt(spread[i, i])) for i in range(3)]
        return ContactForce(
            frame=frame,
            force_n=(float(force[0]), float(force[1]), float(force[2])),
            ci95_n=(half[0], half[1], half[2]),
            size_n=total,
            size_ci95_n=(max(0.0, total - width), None if len(blind) else total + width),
            blind=tuple((float(b[0]), float(b[1]), float(b[2])) for b in blind),
            misfit_nm=float(np.sqrt(np.mean(misfit**2))),
        )


#: Links are thicker than their frames and reach beyond them: the surface is taken to end this far from them, m.
SURFACE_M = 0.1
#: One-sided 95 % point of the normal distribution, in standard deviations.
_ONE_SIDED = 1.645
#: A joint whose longest lever is shorter tells nothing, m.
_SHORTEST_M = 0.03


def least_force(
    at: ArmAtSamples, joints: Sequence[str], torque_nm: FloatArray, sd_nm: FloatArray, sample: int
) -> LeastForce | None:
    """The largest of the lower bounds that the joints of a contact give.

    Args:
        at: the arm where contacts are looked at, at this sample too.
        joints: those that reacted.
        torque_nm: (k,) their external torque; where friction is only a range, what lies beyond it.
        sd_nm: (k,) its standard deviation.
        sample: of the log, for the pose.

    Returns:
        None without a kinematic model or a pose, or where no torque stands out of its own error.
    """
    robot = at.robot
    if robot.bodies is None or not at.position_known(sample):
        return None
    levers = longest_levers(at, sample)
    bounds = []
    for joint, torque, sd in zip(joints, torque_nm, sd_nm, strict=True):
        lever = levers[robot.joint_names.index(joint)]
        sure = abs(float(torque)) - _ONE_SIDED * float(sd)
        if lever >= _SHORTEST_M and sure > 0.0:
            bounds.append(LeastForce(float(sure / lever), joint, float(lever)))
    return max(bounds, key=lambda bound: bound.force_n, default=None)


def with_least(force: ContactForce | None, least: LeastForce | None) -> ContactForce | None:
    """The force with an interval that begins no lower than the least force; None where it would end below it.

    Then the force does not act as it is taken to, a pure one near a frame, and only its lower bound holds.
    """
    if force is None or least is None:
        return force
    high = force.size_ci95_n[1]
    if high is not None and least.force_n > high:
        return None
    links = tuple(
        replace(link, low_n=max(link.low_n, least.force_n))
        for link in force.links
        if link.high_n is None or least.force_n <= link.high_n
    )
    return replace(force, size_ci95_n=(max(force.size_ci95_n[0], least.force_n), high), links=links)


def longest_levers(at: ArmAtSamples, sample: int) -> FloatArray:
    """(j,) longest distance from each joint's axis to the surface of what it moves, m; 1 for prismatic joints.

    Args:
        at: an arm with a kinematic model.
        sample: at which its position is known.
    """
    robot = at.robot
    turning = np.array([kind != "prismatic" for kind in robot.joint_types])
    out = np.zeros(len(robot.joint_names))
    for frame in at.link_frames:  # a joint beyond the frame feels nothing: its lever there is 0
        out = np.maximum(out, np.linalg.norm(at.lever_arms(frame, sample), axis=0))
    return np.where(turning, out + SURFACE_M, np.minimum(out, 1.0))
