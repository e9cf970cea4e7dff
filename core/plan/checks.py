"""Whether a move keeps within all limits: range, torque with friction, links, table and workspace."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.plan.limits import ArmLimits
from collaudit.core.plan.timing import Motion
from collaudit.core.robot.arm_shapes import ArmShapes, Surroundings
from collaudit.core.robot.robot_model import RobotModel

#: Links are checked with this many clearances, at positions between which no point moves farther than half of one:
#: two points approach each other by half a clearance at most in between.
MARGIN, STEP = 1.5, 0.5
#: Friction of a joint without a law, as a share of its highest torque.
UNKNOWN_FRICTION = 0.2
#: Where torque is looked at: so often where speeds change, so far apart where they do not. It bends little in between,
#: and is kept away from the limit by this share.
_TORQUE_STEP_S, _TORQUE_WAY, _TORQUE_RESERVE = 0.02, 0.05, 0.97


@dataclass(frozen=True, slots=True, eq=False)
class MoveCheck:
    """All limits of an arm.

    Attributes:
        robot: the arm; without inertials no torque is checked.
        limits: hard limits.
        shapes: of links and surroundings, with ``MARGIN`` clearances.
        reach_m: (j,) of the shapes.
        clearance_m: as stated.
        friction: laws by joint.
    """

    robot: RobotModel
    limits: ArmLimits
    shapes: ArmShapes
    reach_m: FloatArray
    clearance_m: float
    friction: Mapping[str, FrictionModel]

    def problem(self, *motions: Motion) -> str | None:
        """What motions from rest to rest violate, in words; None where they keep all limits."""
        if not all(self.limits.inside(motion.q).all() for motion in motions):
            return "a joint's range"
        for joint in self.overloaded(motions):
            if joint is not None:
                return f"the torque of {joint}"
        found = self.shapes.touching(np.concatenate([self._places(motion) for motion in motions]))
        return None if found is None else found[1]

    def torque_nm(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """(n, j) torque of model and friction; friction that is not known, or at rest, in the worse direction."""
        torque = self.robot.inverse_dynamics(q, v, a)
        for j, name in enumerate(self.robot.joint_names):
            law, speed = self.friction.get(name), np.abs(v[:, j])
            worse = np.sign(torque[:, j])
            if law is None:
                torque[:, j] += worse * UNKNOWN_FRICTION * float(self.limits.torque[j])
                continue
            size = np.maximum(np.abs(law.torque(v[:, j])), np.where(speed > law.speed_range[0], 0.0, law.hold))
            torque[:, j] += np.where(speed > 1e-6, np.sign(v[:, j]), worse) * size
        return torque

    def overloaded(self, motions: Sequence[Motion]) -> list[str | None]:
        """Of every motion a joint whose torque exceeds its limit; None where none does, or no model tells."""
        if not self.robot.has_inertials:
            return [None] * len(motions)
        samples = [motion.watched(_TORQUE_STEP_S, _TORQUE_WAY)[1:] for motion in motions]
        torque = self.torque_nm(*(np.concatenate(part) for part in zip(*samples, strict=True)))
        over = np.abs(torque) > _TORQUE_RESERVE * self.limits.torque
        ends = np.cumsum([len(q) for q, _, _ in samples])[:-1]
        each = [part.any(axis=0) for part in np.split(over, ends)]
        return [self.robot.joint_names[int(np.argmax(one))] if one.any() else None for one in each]

    def _places(self, motion: Motion) -> FloatArray:
        """(m, j) positions along a motion, at most half a clearance of any point's way apart."""
        out = [motion.q[:1]]
        for a, b in zip(motion.q, motion.q[1:], strict=False):  # between knots of a straight move
            way = float(np.abs(b - a) @ self.reach_m)
            count = int(np.ceil(way / (STEP * self.clearance_m)))
            out.append(a + np.linspace(0.0, 1.0, count + 1)[1:, None] * (b - a) if count else b[None])
        return np.concatenate(out)


def padded(around: Surroundings) -> Surroundings:
    """Surroundings with the margin that checks at single positions need."""
    return replace(around, clearance_m=MARGIN * around.clearance_m)
