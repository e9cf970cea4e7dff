"""The one module that imports Pinocchio: building a model, batched inverse dynamics, forward dynamics."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from collaudit.core.config.schema import DhRow
from collaudit.core.errors import RobotError
from collaudit.core.robot.statics import Chain, ChainJoint
from collaudit.core.series import FloatArray

#: Two threads were measured to be enough (1.1-1.3 µs a sample with seven joints), and leave a machine usable.
THREADS = 2


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
        self._pool: Any = None

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

    def weightless(self) -> RigidBodies:
        """A copy without gravity."""
        model = self._model.copy()
        model.gravity.linear = np.zeros(3)
        return RigidBodies(model)

    def set_armature(self, armature: FloatArray) -> None:
        """Reflected rotor inertia (j,), kg·m² or kg; Pinocchio adds it to the diagonal of the mass matrix."""
        self._model.armature = armature

    def add_body(self, frame: str, mass_kg: float, com_m: Sequence[float]) -> None:
        """Fix a point mass at ``com_m`` of a frame."""
        at = self._frame(frame)
        body = pin.Inertia(mass_kg, np.array(com_m, dtype=float), np.zeros((3, 3)))
        self._model.appendBodyToJoint(at.parentJoint, body, at.placement)

    def bodies(self) -> list[tuple[str, float, FloatArray]]:
        """Per joint: its name, the mass (kg) it moves directly, the (3, 3) inertia about that mass's centre."""
        parts = list(self._model.inertias)[1:]
        return [(n, float(b.mass), np.array(b.inertia)) for n, b in zip(self.joint_names, parts, strict=True)]

    def frame_joint(self, frame: str) -> str | None:
        """The joint that moves a frame; None for the base."""
        joint = self._frame(frame).parentJoint
        return None if joint == 0 else str(self._model.names[joint])

    def inverse_dynamics(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """Joint torques M(q) a + C(q, v) v + G(q), rotor inertia included; all (n, j), no NaN."""
        if not hasattr(pin, "rneaInParallel"):  # a build without OpenMP
            return self._one_by_one(q, v, a)
        if self._pool is None:
            self._pool = pin.ModelPool(self._model, THREADS)
        columns = [np.ascontiguousarray(x).T for x in (q, v, a)]
        torque = pin.rneaInParallel(THREADS, self._pool, *columns)
        return np.ascontiguousarray(torque.reshape(columns[0].shape).T)  # one row or column comes back flat

    def _one_by_one(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        data, out = self._model.createData(), np.empty_like(v)
        for k in range(q.shape[0]):
            out[k] = pin.rnea(self._model, data, q[k], v[k], a[k])
        return out

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

    def chain(self, frame: str) -> Chain:
        """The joints from a frame to the base, with the constants :mod:`statics` needs."""
        at = self._frame(frame)
        data = self._model.createData()
        pin.computeJointJacobians(self._model, data, pin.neutral(self._model))
        joint, pose, steps = at.parentJoint, at.placement, []
        while joint != 0:
            column = self._model.joints[joint].idx_v
            jacobian = pin.getJointJacobian(self._model, data, joint, pin.LOCAL)
            axis = np.reshape(jacobian, (6, -1))[:, column]  # the Jacobian of a single joint comes back flat
            prismatic = bool(np.linalg.norm(axis[3:]) < 0.5)
            align = pin.SE3(_z_onto(axis[:3] if prismatic else axis[3:]), np.zeros(3))
            step = align.inverse() * pose
            steps.append(ChainJoint(column, prismatic, step.rotation.copy(), step.translation.copy()))
            pose, joint = self._model.jointPlacements[joint] * align, self._model.parents[joint]
        return Chain(tuple(steps), pose.rotation.copy())

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


class ForwardModel:
    """Forward dynamics and kinematics one sample at a time, through preallocated data.

    Arrays handed in must be (j,) float64; those handed out are the library's own memory, valid until the next call.
    """

    def __init__(self, model: Any) -> None:
        self._model, self._data = model, model.createData()
        self._rotor: FloatArray = np.array(model.armature, dtype=float)

    def acceleration(self, q: FloatArray, v: FloatArray, torque: FloatArray, extra: FloatArray) -> FloatArray:
        """Articulated-body algorithm: (j,) acceleration.

        Args:
            q, v, torque: position, velocity, joint torque.
            extra: (j,) added to the mass matrix's diagonal for this call, kg·m²: what a linearly implicit
                integrator needs.
        """
        self._model.armature = self._rotor + extra
        out: FloatArray = pin.aba(self._model, self._data, q, v, torque)
        return out

    def gravity_torque(self, q: FloatArray) -> FloatArray:
        """(j,) torque that holds the arm against gravity, N·m."""
        out: FloatArray = pin.computeGeneralizedGravity(self._model, self._data, q)
        return out

    def frame_id(self, name: str) -> int:
        """Number of a frame."""
        if not self._model.existFrame(name):
            raise RobotError("the model has no such frame", found=name)
        return int(self._model.getFrameId(name))

    def update(self, q: FloatArray) -> None:
        """Compute joint Jacobians and frame poses at ``q`` for the calls below."""
        pin.computeJointJacobians(self._model, self._data, q)
        pin.updateFramePlacements(self._model, self._data)

    def pose(self, frame: int) -> tuple[FloatArray, FloatArray]:
        """(3, 3) rotation and (3,) position of a frame in the base, after :meth:`update`."""
        place = self._data.oMf[frame]
        return place.rotation, place.translation

    def jacobian(self, frame: int, point_m: FloatArray | None = None) -> FloatArray:
        """(6, j) Jacobian in base axes at the frame's origin, or at a point (3,) of the frame; linear rows first."""
        out: FloatArray = pin.getFrameJacobian(self._model, self._data, frame, pin.LOCAL_WORLD_ALIGNED)
        if point_m is not None:
            arm = self._data.oMf[frame].rotation @ point_m
            out[:3] -= pin.skew(arm) @ out[3:]
        return out


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
