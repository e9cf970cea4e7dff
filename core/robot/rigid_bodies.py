"""Pinocchio's models behind plain arrays: building, constants for the recursions, regressors, forward dynamics."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from collaudit.core.config.schema import DhRow
from collaudit.core.errors import RobotError
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot import newton_euler
from collaudit.core.robot import reference_dynamics as reference
from collaudit.core.robot.forward_dynamics import ForwardModel
from collaudit.core.robot.link_constants import Link, Place
from collaudit.core.robot.sample_batches import Batched, OneByOne, checked


def urdf_model(xml: str, where: str) -> RigidBodies:
    """Build from a normalised URDF.

    Raises:
        RobotError: Pinocchio refuses it.
    """
    try:
        return RigidBodies(pin.buildModelFromXML(xml))
    except ValueError as error:
        raise RobotError("the robot description cannot be used", where=where, found=str(error)) from error


def dh_model(rows: Sequence[DhRow], names: Sequence[str], convention: str) -> RigidBodies:
    """Build from Denavit-Hartenberg rows.

    Standard: T_i = Rz(θ) Tz(d) Tx(a) Rx(α). Modified (Craig): T_i = Rx(α) Tx(a) Rz(θ) Tz(d), with a and α in the
    row of the joint they precede. Link frames are called ``link1`` …, the base ``base``, the last link also ``tool0``.

    Args:
        rows: base to tip; inertia about the centre of mass along the link frame's axes, as matrix elements
            (a product is xy = -∫xy dm, as in URDF).
        names: joint names.
        convention: ``standard`` or ``modified``.
    """
    model = pin.Model()
    model.addFrame(pin.Frame("base", 0, 0, pin.SE3.Identity(), pin.FrameType.FIXED_JOINT))
    parent, before = 0, pin.SE3.Identity()
    for i, (row, name) in enumerate(zip(rows, names, strict=True), 1):
        twist = _pose(x=row.a, about_x=row.alpha)
        turn = _pose(z=row.d, about_z=row.theta_offset)
        placement, link = (before, turn * twist) if convention == "standard" else (before * twist, turn)
        joint = pin.JointModelRZ() if row.joint == "revolute" else pin.JointModelPZ()
        parent = model.addJoint(parent, joint, placement, name)
        model.addJointFrame(parent)
        model.addBodyFrame(f"link{i}", parent, link, model.nframes - 1)
        if row.mass_kg:
            com = np.array(row.com_m or (0.0, 0.0, 0.0))
            inertia = _symmetric(row.inertia_kg_m2 or (0.0,) * 6)
            model.appendBodyToJoint(parent, pin.Inertia(row.mass_kg, com, inertia), link)
        before = link
    model.addFrame(pin.Frame("tool0", parent, model.nframes - 1, before, pin.FrameType.OP_FRAME))
    return RigidBodies(model)


class RigidBodies:
    """A Pinocchio model behind plain arrays. Columns follow :attr:`joint_names`; frames go by name."""

    def __init__(self, model: Any) -> None:
        self._model = model
        self._programs: dict[object, Batched] = {}

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints in the model's own order."""
        return tuple(self._model.names)[1:]

    @property
    def frame_names(self) -> tuple[str, ...]:
        """Every frame's name."""
        return tuple(frame.name for frame in self._model.frames)

    def locked(self, positions: Mapping[str, float]) -> RigidBodies:
        """A model in which the named joints are fixed at the given positions (rad or m)."""
        reference = pin.neutral(self._model)
        ids = [self._model.getJointId(name) for name in positions]
        for joint, value in zip(ids, positions.values(), strict=True):
            reference[self._model.joints[joint].idx_q] = value
        return RigidBodies(pin.buildReducedModel(self._model, ids, reference) if ids else self._model.copy())

    def set_gravity(self, gravity_m_s2: FloatArray) -> None:
        """Gravity in base axes, (3,) m/s²."""
        self._model.gravity.linear = gravity_m_s2
        self._programs.clear()

    def between(self, names: Sequence[str], kept: Sequence[str]) -> list[str]:
        """Those of ``names`` that have one of ``kept`` nearer to the base and one further out on their chain."""
        moved = {self._model.getJointId(name) for name in kept}
        out = []
        for name in names:
            joint = self._model.getJointId(name)
            inside, outside = set(self._model.supports[joint]), set(self._model.subtrees[joint])
            if moved & inside and moved & outside:
                out.append(name)
        return out

    def set_armature(self, armature: FloatArray) -> None:
        """Reflected rotor inertia (j,), kg·m² or kg; Pinocchio adds it to the diagonal of the mass matrix."""
        self._model.armature = armature
        self._programs.clear()

    def add_body(self, frame: str, mass_kg: float, com_m: Sequence[float]) -> None:
        """Fix a point mass at ``com_m`` of a frame."""
        at = self._frame(frame)
        body = pin.Inertia(mass_kg, np.array(com_m, dtype=float), np.zeros((3, 3)))
        self._model.appendBodyToJoint(at.parentJoint, body, at.placement)
        self._programs.clear()

    def bodies(self) -> list[tuple[str, float, FloatArray]]:
        """Per joint: its name, the mass (kg) it moves directly, the (3, 3) inertia about that mass's centre."""
        parts = list(self._model.inertias)[1:]
        return [(n, float(b.mass), np.array(b.inertia)) for n, b in zip(self.joint_names, parts, strict=True)]

    def frame_joint(self, frame: str) -> str | None:
        """The joint that moves a frame; None for the base."""
        joint = self._frame(frame).parentJoint
        return None if joint == 0 else str(self._model.names[joint])

    def inverse_dynamics(self) -> Batched:
        """From q, v, a to the joint torques M(q) a + C(q, v) v + G(q), rotor inertia included."""
        return self._program(
            "inverse dynamics",
            lambda: newton_euler.inverse_dynamics_program(self._links(), self._model.gravity.linear),
            lambda: reference.inverse_dynamics(self._model),
        )

    def momentum(self) -> Batched:
        """From q, v to M(q) v, then C(q, v)^T v - G(q)."""
        return self._program(
            "momentum",
            lambda: newton_euler.momentum_program(self._links(), self._model.gravity.linear),
            lambda: reference.momentum(self._model),
        )

    def force(self, frame: str, carried: tuple[str, float, FloatArray] | None = None) -> Batched:
        """From q (with ``carried`` also v and a) and a wrench in a frame to J^T F, less what the body carried takes.

        ``carried``: frame, mass in kg and (3,) centre of a point mass that is accelerated, without weight.
        """
        body = None if carried is None else (self.place(carried[0]), carried[1], np.asarray(carried[2]))
        return self._program(
            ("force", frame, None if carried is None else (*carried[:2], *map(float, carried[2]))),
            lambda: newton_euler.force_program(self._links(), self.place(frame), body),
            lambda: reference.force(self._model, frame, carried),
        )

    def torques(self, frame: str, carried: tuple[str, float, FloatArray] | None = None) -> Batched:
        """From q, v, a and what a sensor in a frame reads to :meth:`inverse_dynamics`, then the reading at the joints.

        Last, the square of the force. ``carried`` as for :meth:`force`, on the sensor's link, is taken out of the
        reading with its weight, which is the force on the environment.
        """
        body = None if carried is None else (self.place(carried[0]), carried[1], np.asarray(carried[2]))
        return self._program(
            ("torques", frame, None if carried is None else (*carried[:2], *map(float, carried[2]))),
            lambda: newton_euler.torques_program(self._links(), self._model.gravity.linear, self.place(frame), body),
            lambda: reference.torques(self._model, frame, carried),
        )

    def weight(self, frame: str, mass_kg: float, com_m: FloatArray, gravity_m_s2: FloatArray) -> Batched:
        """From q to the weight (6,) of a point mass in a frame's axes at its origin."""
        return self._program(
            ("weight", frame, mass_kg, *map(float, com_m), *map(float, gravity_m_s2)),
            lambda: newton_euler.weight_program(self._links(), self.place(frame), mass_kg, com_m, gravity_m_s2),
            lambda: reference.weight(self._model, frame, mass_kg, com_m, gravity_m_s2),
        )

    def _program(self, key: object, record: Callable[[], Batched], slow: Callable[[], OneByOne]) -> Batched:
        """A program, recorded when it is first asked for, and Pinocchio in its place if the two should not agree."""
        if key not in self._programs:
            self._programs[key] = checked(record(), slow())
        return self._programs[key]

    def rotation(self, q: FloatArray, frame: str) -> FloatArray:
        """(3, 3) axes of a frame in the base at one position (j,)."""
        return reference.rotation(self._model, self._model.createData(), q, frame)

    def torque_regressor(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """(n, j, 10 j) derivative of the joint torques by the inertial parameters; rotor inertia is not in it.

        Parameters of each joint's moving body in turn: mass, mass times centre (x, y, z), inertia about the joint's
        origin (xx, xy, yy, xz, yz, zz); all (n, j) inputs without NaN.
        """
        data = self._model.createData()
        out = np.empty((q.shape[0], self._model.nv, 10 * self._model.nv))
        for k in range(q.shape[0]):
            out[k] = pin.computeJointTorqueRegressor(self._model, data, q[k], v[k], a[k])
        return out

    def inertial_parameters(self) -> FloatArray:
        """(10 j,) parameters in the order of :meth:`torque_regressor`, tool included."""
        return np.concatenate([body.toDynamicParameters() for body in list(self._model.inertias)[1:]])

    @property
    def armature(self) -> FloatArray:
        """(j,) reflected rotor inertia."""
        return np.array(self._model.armature, dtype=float)

    def with_parameters(self, parameters: FloatArray, armature: FloatArray) -> RigidBodies:
        """A copy with other inertial parameters (10 j,) and rotor inertias (j,)."""
        model = self._model.copy()
        for k, ten in enumerate(parameters.reshape(-1, 10), 1):
            if not np.array_equal(ten, model.inertias[k].toDynamicParameters()):
                model.inertias[k] = pin.Inertia.FromDynamicParameters(ten)
        model.armature = np.asarray(armature, dtype=float)
        return RigidBodies(model)

    def frame_in_joint(self, frame: str) -> tuple[FloatArray, FloatArray, int]:
        """Rotation, position (m) of a frame in the joint that moves it, and that joint's number from 0."""
        at = self._frame(frame)
        return at.placement.rotation.copy(), at.placement.translation.copy(), int(at.parentJoint) - 1

    def place(self, frame: str) -> Place:
        """Where a frame is, for the recursions."""
        at = self._frame(frame)
        pose = self._aligned()[at.parentJoint].inverse() * at.placement
        return Place(int(at.parentJoint) - 1, pose.rotation.copy(), pose.translation.copy())

    def _links(self) -> list[Link]:
        """The recursions' constants."""
        model, aligned, out = self._model, self._aligned(), []
        for k in range(1, model.njoints):
            pose = aligned[model.parents[k]].inverse() * model.jointPlacements[k] * aligned[k]
            mass, *rest = aligned[k].actInv(model.inertias[k]).toDynamicParameters()
            xx, xy, yy, xz, yz, zz = rest[3:]
            inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            out.append(Link(model.parents[k] - 1, self._prismatic(k), pose.rotation.copy(), pose.translation.copy(),
                            float(mass), np.array(rest[:3]), inertia, float(model.armature[k - 1])))  # fmt: skip
        return out

    def _axis(self, joint: int) -> FloatArray:
        """(6,) motion of a joint per its speed, in its own axes."""
        data = self._model.createData()
        pin.computeJointJacobians(self._model, data, pin.neutral(self._model))
        jacobian = np.reshape(pin.getJointJacobian(self._model, data, joint, pin.LOCAL), (6, -1))
        return np.asarray(jacobian[:, self._model.joints[joint].idx_v])  # a single joint's Jacobian comes back flat

    def _prismatic(self, joint: int) -> bool:
        return bool(np.linalg.norm(self._axis(joint)[3:]) < 0.5)

    def _aligned(self) -> list[Any]:
        """Of the base and of every joint, a rotation of its axes that puts z along its motion."""
        out = [pin.SE3.Identity()]
        for k in range(1, self._model.njoints):
            axis = self._axis(k)
            out.append(pin.SE3(_z_onto(axis[:3] if self._prismatic(k) else axis[3:]), np.zeros(3)))
        return out

    def frame_offset(self, of: str, relative_to: str) -> tuple[FloatArray, FloatArray] | None:
        """Constant pose (rotation, translation) of one frame in another; None when a joint lies between."""
        of_frame, to_frame = self._frame(of), self._frame(relative_to)
        if of_frame.parentJoint != to_frame.parentJoint:
            return None
        pose = to_frame.placement.inverse() * of_frame.placement
        return pose.rotation.copy(), pose.translation.copy()

    def beyond(self, frame: str) -> tuple[float, FloatArray]:
        """Mass (kg) and first moments (3,) kg·m, in its joint, of the links that the description fixes to a frame."""
        frames, own = self._model.frames, self._model.getFrameId(frame)
        mass, first, outside = 0.0, np.zeros(3), {own}
        for number in range(own + 1, len(frames)):
            part = frames[number]
            if part.parentFrame in outside and part.parentJoint == frames[own].parentJoint:
                outside.add(number)
                mass += float(part.inertia.mass)
                first += part.inertia.mass * (part.placement * part.inertia.lever)
        return mass, first

    def forward(self) -> ForwardModel:
        """Forward dynamics of this model, for simulation."""
        return ForwardModel(self._model.copy())

    def _frame(self, name: str) -> Any:
        return self._model.frames[self._model.getFrameId(name)]


def _pose(*, x: float = 0.0, z: float = 0.0, about_x: float = 0.0, about_z: float = 0.0) -> Any:
    rotation = pin.utils.rotate("z", about_z) @ pin.utils.rotate("x", about_x)
    return pin.SE3(rotation, np.array([x, 0.0, z]))


def _symmetric(six: Sequence[float]) -> FloatArray:
    xx, yy, zz, xy, yz, xz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _z_onto(axis: FloatArray) -> FloatArray:
    """A rotation that takes e_z onto the unit vector ``axis``."""
    z = axis / np.linalg.norm(axis)
    if z[2] > 1.0 - 1e-12:
        return np.eye(3)
    helper = np.array([1.0, 0.0, 0.0]) if abs(z[0]) < math.sqrt(0.5) else np.array([0.0, 1.0, 0.0])
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
