"""An arm's dynamics for many samples at once: recorded programs, with Pinocchio as their reference and in their stead.

A model is built first (:mod:`pinocchio_model`); nothing changes it once it is here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot import newton_euler, reference_dynamics
from collaudit.core.robot.forward_dynamics import ForwardModel
from collaudit.core.robot.link_constants import FramePlacement, Link
from collaudit.core.robot.pinocchio_model import PinocchioModel
from collaudit.core.robot.sample_batches import Batched, OneByOne, checked

#: Programs that are kept of one model.
_PROGRAMS = 128


class RigidBodies:
    """Dynamics of a finished model. Columns follow :attr:`joint_names`; frames go by name."""

    def __init__(self, model: PinocchioModel) -> None:
        """``model``: with gravity, rotor inertia and tool; a copy of it is kept."""
        self._model = model.copy()
        self._programs: dict[object, Batched] = {}

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
        return self._program(
            "inverse dynamics",
            lambda: newton_euler.inverse_dynamics_program(self._links, self._model.gravity_m_s2),
            lambda: reference_dynamics.inverse_dynamics(self._model),
        )

    def momentum(self) -> Batched:
        """From q, v to M(q) v, then C(q, v)^T v - G(q)."""
        return self._program(
            "momentum",
            lambda: newton_euler.momentum_program(self._links, self._model.gravity_m_s2),
            lambda: reference_dynamics.momentum(self._model),
        )

    def force(self, frame: str, carried: tuple[str, float, FloatArray] | None = None) -> Batched:
        """From q (with ``carried`` also v and a) and a wrench in a frame to J^T F, less what the body carried takes.

        ``carried``: frame, mass in kg and (3,) centre of a point mass that is accelerated, without weight.
        """
        return self._program(
            ("force", frame, _key(carried)),
            lambda: newton_euler.force_program(self._links, self._place(frame), self._body(carried)),
            lambda: reference_dynamics.force(self._model, frame, carried),
        )

    def torques(self, frame: str, carried: tuple[str, float, FloatArray] | None = None) -> Batched:
        """From q, v, a and what a sensor in a frame reads to :meth:`inverse_dynamics`, then the reading at the joints.

        Last, the square of the force. ``carried`` as for :meth:`force`, on the sensor's link, is taken out of the
        reading with its weight, which is the force on the environment.
        """
        return self._program(
            ("torques", frame, _key(carried)),
            lambda: newton_euler.torques_program(
                self._links, self._model.gravity_m_s2, self._place(frame), self._body(carried)
            ),
            lambda: reference_dynamics.torques(self._model, frame, carried),
        )

    def weight(self, frame: str, mass_kg: float, com_m: FloatArray, gravity_m_s2: FloatArray) -> Batched:
        """From q to the weight (6,) of a point mass in a frame's axes at its origin."""
        return self._program(
            ("weight", frame, mass_kg, *map(float, com_m), *map(float, gravity_m_s2)),
            lambda: newton_euler.weight_program(self._links, self._place(frame), mass_kg, com_m, gravity_m_s2),
            lambda: reference_dynamics.weight(self._model, frame, mass_kg, com_m, gravity_m_s2),
        )

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
    def _links(self) -> list[Link]:
        """What the recursions know of the model, which nothing changes any more."""
        return self._model.links()

    def _place(self, frame: str) -> FramePlacement:
        return self._model.frame_placement(frame)

    def _body(self, carried: tuple[str, float, FloatArray] | None) -> tuple[FramePlacement, float, FloatArray] | None:
        """A point mass that is carried, its frame as the recursions want it."""
        return None if carried is None else (self._place(carried[0]), carried[1], np.asarray(carried[2]))

    def _program(self, key: object, record: Callable[[], Batched], slow: Callable[[], OneByOne]) -> Batched:
        """A program, recorded when it is first asked for, and Pinocchio in its place if the two should not agree."""
        found = self._programs.get(key)
        if found is None:
            found = self._programs[key] = checked(record(), slow())
            while len(self._programs) > _PROGRAMS:  # a model serves many logs, and each may carry another load
                self._programs.pop(next(iter(self._programs)), None)
        return found


def _key(carried: tuple[str, float, FloatArray] | None) -> object:
    return None if carried is None else (*carried[:2], *map(float, carried[2]))
