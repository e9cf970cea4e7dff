"""An arm's dynamics for many samples at once, from the constants that Pinocchio reads of its description.

A model is built first (:mod:`pinocchio_model`); nothing changes it once it is here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot import newton_euler
from collaudit.core.robot.forward_dynamics import ForwardModel
from collaudit.core.robot.link_constants import FramePlacement, Link
from collaudit.core.robot.pinocchio_model import PinocchioModel
from collaudit.core.robot.sample_batches import Batched
from collaudit.core.robot.vectors import Scalar


class RigidBodies:
    """Dynamics of a finished model. Columns follow :attr:`joint_names`; frames go by name."""

    def __init__(self, model: PinocchioModel) -> None:
        """``model``: with gravity, rotor inertia and tool; a copy of it is kept."""
        self._model = model.copy()

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints in the model's own order."""
        return self._model.joint_names

    @property
    def frame_names(self) -> tuple[str, ...]:
        """Every frame's name."""
        return self._model.frame_names

    @property
    def armature(self) -> FloatArray:
        """(j,) reflected rotor inertia, kg·m² or kg."""
        return self._model.armature

    def inertial_parameters(self) -> FloatArray:
        """(10 j,) parameters in the order of :meth:`torque_regressor`, tool included."""
        return self._model.inertial_parameters()

    def with_parameters(self, parameters: FloatArray, armature: FloatArray) -> RigidBodies:
        """The arm with other inertial parameters (10 j,) and rotor inertias (j,)."""
        model = self._model.copy()
        model.set_inertial_parameters(parameters)
        model.set_armature(np.asarray(armature, dtype=float))
        return RigidBodies(model)

    def without_gravity(self) -> RigidBodies:
        """The arm under no gravity."""
        model = self._model.copy()
        model.set_gravity(np.zeros(3))
        return RigidBodies(model)

    def frame_joint(self, frame: str) -> str | None:
        """The joint that moves a frame; None for the base."""
        return self._model.frame_joint(frame)

    def frame_in_joint(self, frame: str) -> tuple[FloatArray, FloatArray, int]:
        """Rotation, position (m) of a frame in the joint that moves it, and that joint's number from 0."""
        return self._model.frame_in_joint(frame)

    def frame_offset(self, of: str, relative_to: str) -> tuple[FloatArray, FloatArray] | None:
        """Constant pose (rotation, translation) of one frame in another; None when a joint lies between."""
        return self._model.frame_offset(of, relative_to)

    def beyond(self, frame: str) -> tuple[float, FloatArray]:
        """Mass (kg) and first moments (3,) kg·m, in its joint, of the links that the description fixes to a frame."""
        return self._model.beyond(frame)

    def inverse_dynamics(self) -> Batched:
        """From q, v, a to the joint torques M(q) a + C(q, v) v + G(q), rotor inertia included."""
        return self._batched(3, self._count, partial(newton_euler.inverse_dynamics, self.links, self._gravity))

    def momentum(self) -> Batched:
        """From q, v to M(q) v, then C(q, v)^T v - G(q)."""
        return self._batched(2, 2 * self._count, partial(newton_euler.momentum, self.links, self._gravity))

    def force(self, frame: str, carried: tuple[str, float, FloatArray] | None = None) -> Batched:
        """From q (with ``carried`` also v and a) and a wrench in a frame to J^T F, less what the body carried takes.

        ``carried``: frame, mass in kg and (3,) centre of a point mass that is accelerated, without weight.
        """
        place, body = self.place(frame), self._body(carried)
        if body is None:
            return self._batched(1, self._count, partial(newton_euler.force, self.links, place), 6)
        return self._batched(3, self._count, partial(newton_euler.force_less_body, self.links, place, body), 6)

    def torques(self, frame: str, carried: tuple[str, float, FloatArray] | None = None) -> Batched:
        """From q, v, a and what a sensor in a frame reads to :meth:`inverse_dynamics`, then the reading at the joints.

        Last, the square of the force. ``carried`` as for :meth:`force`, on the sensor's link, is taken out of the
        reading with its weight, which is the force on the environment.
        """
        known = (self.links, self._gravity, self.place(frame), self._body(carried))
        return self._batched(3, 2 * self._count + 1, partial(newton_euler.torques, *known), 6)

    def weight(self, frame: str, mass_kg: float, com_m: FloatArray, gravity_m_s2: FloatArray) -> Batched:
        """From q to the weight (6,) of a point mass in a frame's axes at its origin."""
        known = (self.links, self.place(frame), mass_kg, com_m, np.asarray(gravity_m_s2))
        return self._batched(1, 6, partial(newton_euler.weight, *known))

    def rotation(self, q: FloatArray, frame: str) -> FloatArray:
        """(3, 3) axes of a frame in the base at one position (j,)."""
        return self._model.workspace().frame_rotation(q, self._model.frame_number(frame))

    def positions(self, q: FloatArray, frames: Sequence[str]) -> FloatArray:
        """(k, 3) origins of frames in the base at one position (j,), m."""
        work = self._model.workspace()
        work.update(q)
        return np.array([work.pose(self._model.frame_number(frame))[1] for frame in frames]).reshape(-1, 3)

    def torque_regressor(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """(n, j, 10 j) derivative of the joint torques by the inertial parameters; rotor inertia is not in it.

        Parameters of each joint's moving body in turn: mass, mass times centre (x, y, z), inertia about the joint's
        origin (xx, xy, yy, xz, yz, zz); all (n, j) inputs without NaN.
        """
        work, count = self._model.workspace(), self._model.joint_count
        out = np.empty((q.shape[0], count, 10 * count))
        for k in range(q.shape[0]):
            out[k] = work.torque_regressor(q[k], v[k], a[k])
        return out

    def library_model(self) -> Any:
        """A copy of the library's own model; see :mod:`collaudit.core.robot.arm_shapes`."""
        return self._model.library_model()

    def forward(self) -> ForwardModel:
        """Forward dynamics of this model, for simulation."""
        return ForwardModel(self._model)

    @cached_property
    def links(self) -> list[Link]:
        """What the recursions know of the model, which nothing changes any more."""
        return self._model.links()

    def place(self, frame: str) -> FramePlacement:
        """Where a frame is in the axes of :attr:`links`."""
        return self._model.frame_placement(frame)

    def _body(self, carried: tuple[str, float, FloatArray] | None) -> tuple[FramePlacement, float, FloatArray] | None:
        """A point mass that is carried, its frame as the recursions want it."""
        return None if carried is None else (self.place(carried[0]), carried[1], np.asarray(carried[2]))

    def _batched(
        self, motions: int, outputs: int, recursion: Callable[..., Sequence[Scalar]], more: int = 0
    ) -> Batched:
        """A recursion on so many of q, v, a, and on so many more rows."""
        edges = [k * self._count for k in range(1, motions + (more > 0))]
        inputs = motions * self._count + more
        return Batched(inputs, outputs, lambda rows: recursion(*np.split(rows, edges)))

    @property
    def _count(self) -> int:
        return self._model.joint_count

    @property
    def _gravity(self) -> FloatArray:
        return self._model.gravity_m_s2
