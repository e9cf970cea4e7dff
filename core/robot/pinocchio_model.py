"""Pinocchio behind plain arrays: the only file that imports it.

:class:`PinocchioModel` builds and describes an arm, :class:`ForwardModel` moves it in simulation. Both hand out arrays
and numbers only, so that everything else in this room can be read, and tested, without the library.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from collaudit.core.config.schema import DhRow
from collaudit.core.data.signals import ArmLink
from collaudit.core.errors import RobotError
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import threads
from collaudit.core.robot.chain_forces import LinkPlace, base_direction, torque_of_wrench


def urdf_model(xml: str, where: str) -> PinocchioModel:
    """Build from a normalised URDF.

    Raises:
        RobotError: Pinocchio refuses it.
    """
    try:
        return PinocchioModel(pin.buildModelFromXML(xml))
    except ValueError as error:
        raise RobotError("the robot description cannot be used", where=where, found=str(error)) from error


def mjcf_model(path: Path) -> PinocchioModel:
    """Build from a MJCF file; Pinocchio reads no gravity from it."""
    return PinocchioModel(pin.buildModelFromMJCF(str(path)))


def frame_id(model: Any, name: str) -> int:
    """Number of a frame: of the link of that name, where a fixed joint has the same."""
    link = model.existFrame(name, pin.FrameType.BODY)
    return int(model.getFrameId(name, pin.FrameType.BODY) if link else model.getFrameId(name))


def dh_model(rows: Sequence[DhRow], names: Sequence[str], convention: str) -> PinocchioModel:
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
    return PinocchioModel(model)


def point_mass_parameters(mass_kg: float, first_kg_m: FloatArray) -> FloatArray:
    """(10,) inertial parameters of a point mass, in the order of :meth:`PinocchioModel.torque_regressor`.

    Args:
        mass_kg: zero or less stands for no mass, all parameters zero.
        first_kg_m: (3,) mass times position.
    """
    if mass_kg <= 0:
        return np.zeros(10)
    return np.array(pin.Inertia(mass_kg, first_kg_m / mass_kg, np.zeros((3, 3))).toDynamicParameters())


def about_centre(parameters: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Mass, centre (3,), and inertia (3, 3) about it, of a body with ten parameters about another origin."""
    body = pin.Inertia.FromDynamicParameters(parameters)
    return float(body.mass), np.array(body.lever), np.array(body.inertia)


def rotation_rpy(rpy_deg: Sequence[float]) -> FloatArray:
    """(3, 3) rotation Rz(yaw) Ry(pitch) Rx(roll), angles in degrees: base axes in the world."""
    return np.asarray(pin.rpy.rpyToMatrix(*np.radians(rpy_deg)))


@dataclass(frozen=True, slots=True)
class PointMass:
    """What an arm carries: a point mass at ``com_m`` (3,) m of ``frame``."""

    frame: str
    mass_kg: float
    com_m: tuple[float, float, float]


_Z = np.array([0.0, 0.0, 1.0])
#: Of so few samples the library's threads take longer to meet than to work.
_FEW = 2_000
#: Way of all joints together in a step of a difference along the motion, rad (m).
_STEP = 1e-3


class PinocchioModel:
    """An arm while it is built, and what is asked of it. Columns follow :attr:`joint_names`; frames go by name."""

    def __init__(self, model: Any) -> None:
        """``model``: a ``pinocchio.Model`` whose joints have one position each."""
        self._model = model

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints in the model's own order."""
        return tuple(self._model.names)[1:]

    @property
    def frame_names(self) -> tuple[str, ...]:
        """Every frame's name."""
        return tuple(frame.name for frame in self._model.frames)

    @property
    def armature(self) -> FloatArray:
        """(j,) reflected rotor inertia, kg·m² or kg."""
        return np.array(self._model.armature, dtype=float)

    def library_model(self) -> Any:
        """A copy of the ``pinocchio.Model``."""
        return self._model.copy()

    def locked(self, positions: Mapping[str, float]) -> PinocchioModel:
        """A model in which the named joints are fixed at the given positions (rad or m)."""
        at = pin.neutral(self._model)
        ids = [self._model.getJointId(name) for name in positions]
        for joint, value in zip(ids, positions.values(), strict=True):
            at[self._model.joints[joint].idx_q] = value
        return PinocchioModel(pin.buildReducedModel(self._model, ids, at) if ids else self.library_model())

    @property
    def mass_kg(self) -> float:
        """Of all links."""
        return float(sum(body.mass for body in self._model.inertias))

    def add_point_mass(self, mass: PointMass) -> None:
        """Fix a point mass to its frame."""
        at = self._frame(mass.frame)
        body = pin.Inertia(mass.mass_kg, np.array(mass.com_m), np.zeros((3, 3)))
        self._model.appendBodyToJoint(at.parentJoint, body, at.placement)

    def path(self, name: str) -> list[str]:
        """The joints from the base to one, itself included."""
        return [self._model.names[number] for number in self._model.supports[self._model.getJointId(name)] if number]

    def on_chain(self, names: Sequence[str], kept: Sequence[str]) -> list[str]:
        """Those of ``names`` that have one of ``kept`` nearer to the base or one further out on their chain."""
        return [name for name in names if any(self.sides(name, kept))]

    def sides(self, name: str, kept: Sequence[str]) -> tuple[bool, bool]:
        """Whether one of ``kept`` lies nearer to the base than a joint, and whether one lies further out."""
        joint, others = self._model.getJointId(name), {self._model.getJointId(other) for other in kept}
        return bool(others & set(self._model.supports[joint])), bool(others & set(self._model.subtrees[joint]))

    def bodies(self) -> list[tuple[str, float, FloatArray]]:
        """Per joint: its name, the mass (kg) it moves directly, the (3, 3) inertia about that mass's centre."""
        parts = list(self._model.inertias)[1:]
        return [(n, float(b.mass), np.array(b.inertia)) for n, b in zip(self.joint_names, parts, strict=True)]

    def inertial_parameters(self) -> FloatArray:
        """(10 j,) parameters in the order of :meth:`torque_regressor`, tool included."""
        return np.concatenate([body.toDynamicParameters() for body in list(self._model.inertias)[1:]])

    def with_parameters(self, parameters: FloatArray, armature: FloatArray) -> PinocchioModel:
        """The arm with other inertial parameters (10 j,) and rotor inertias (j,)."""
        out = PinocchioModel(self.library_model())
        out._model.armature = np.asarray(armature, dtype=float)
        for k, ten in enumerate(parameters.reshape(-1, 10), 1):
            if not np.array_equal(ten, self._model.inertias[k].toDynamicParameters()):
                out._model.inertias[k] = pin.Inertia.FromDynamicParameters(ten)
        return out

    def under_gravity(self, gravity_m_s2: FloatArray) -> PinocchioModel:
        """The arm under another gravity, (3,) m/s² in base axes."""
        out = PinocchioModel(self.library_model())
        out._model.gravity.linear = gravity_m_s2
        return out

    def frame_number(self, frame: str) -> int:
        """Number of a frame for :class:`ForwardModel`.

        Raises:
            RobotError: there is no such frame.
        """
        if not self._model.existFrame(frame):
            raise RobotError("the model has no such frame", found=frame)
        return frame_id(self._model, frame)

    def frame_joint(self, frame: str) -> str | None:
        """The joint that moves a frame; None for the base."""
        joint = self._frame(frame).parentJoint
        return None if joint == 0 else str(self._model.names[joint])

    def frame_in_joint(self, frame: str) -> tuple[FloatArray, FloatArray, int]:
        """Rotation, position (m) of a frame in the joint that moves it, and that joint's number from 0."""
        at = self._frame(frame)
        return at.placement.rotation.copy(), at.placement.translation.copy(), int(at.parentJoint) - 1

    def frame_offset(self, of: str, relative_to: str) -> tuple[FloatArray, FloatArray] | None:
        """Constant pose (rotation, translation) of one frame in another; None when a joint lies between."""
        of_frame, to_frame = self._frame(of), self._frame(relative_to)
        if of_frame.parentJoint != to_frame.parentJoint:
            return None
        pose = to_frame.placement.inverse() * of_frame.placement
        return pose.rotation.copy(), pose.translation.copy()

    def beyond(self, frame: str) -> tuple[float, FloatArray]:
        """Mass (kg) and first moments (3,) kg·m, in its joint, of the links that the description fixes to a frame."""
        frames, own = self._model.frames, frame_id(self._model, frame)
        mass, first, outside = 0.0, np.zeros(3), {own}
        for number in range(own + 1, len(frames)):
            part = frames[number]
            if part.parentFrame in outside and part.parentJoint == frames[own].parentJoint:
                outside.add(number)
                mass += float(part.inertia.mass)
                first += part.inertia.mass * (part.placement * part.inertia.lever)
        return mass, first

    def frame_poses(self, q: FloatArray, frames: Sequence[str]) -> list[tuple[FloatArray, FloatArray]]:
        """(3, 3) axes and (3,) origin, m, of each frame in the base at one position (j,)."""
        data = self._model.createData()
        pin.framesForwardKinematics(self._model, data, q)
        places = [data.oMf[self.frame_number(frame)] for frame in frames]
        return [(np.array(place.rotation), np.array(place.translation)) for place in places]

    def inverse_dynamics(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """(j, m) torque of each joint, M(q) a + C(q, v) v + G(q), rotor inertia included; motion (j, m)."""
        return _inverse_dynamics(self._model, q, v, a)

    def momentum(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """(2 j, m) momenta p = M(q) v, then C(q, v)^T v - G(q); motion (j, m).

        As Ṁ = C + C^T, the second is Ṁ v - (C v + G). Ṁ v is the derivative of M(q) v along v: a difference of fourth
        order over steps so short that its error is below 1e-9 of it.
        """
        still, weightless = np.zeros_like(v), self.under_gravity(np.zeros(3))
        step = _STEP / np.maximum(np.abs(v).sum(axis=0), _STEP)

        def at(steps: float) -> FloatArray:
            return weightless.inverse_dynamics(q + steps * step * v, still, v)

        change = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * step)
        return np.concatenate([at(0.0), change - self.inverse_dynamics(q, v, still)])

    def wrench_torque(self, q: FloatArray, wrench: FloatArray, frame: str) -> FloatArray:
        """(j, m) joint torque J(q)^T F of wrenches (6, m) in a frame, at positions (j, m)."""
        return torque_of_wrench(self.links, self.place_on_link(frame), q, wrench)

    def base_direction(self, q: FloatArray, frame: str, vector: Sequence[float] | FloatArray) -> FloatArray:
        """(3, m) a vector (3,) of the base in the axes of a frame, at positions (j, m)."""
        return base_direction(self.links, self.place_on_link(frame), q, np.asarray(vector, dtype=float))

    def carrying(self, body: PointMass) -> PinocchioModel:
        """An arm that moves as this one, without rotors and any other mass than that of a body."""
        out = PinocchioModel(self.library_model())
        out._model.armature = np.zeros(self._model.nv)
        for k in range(self._model.njoints):
            out._model.inertias[k] = pin.Inertia.Zero()
        out.add_point_mass(body)
        return out

    def moving_force(self, body: PointMass, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """(6, m) what accelerates and holds a body, at its frame's origin in its axes; motion (j, m).

        The body hangs on six joints of its own, three along and three about the axes of its frame, which stand still:
        their torques are the force and the moment.
        """
        at, model = self._frame(body.frame), self.library_model()
        number = model.addJoint(at.parentJoint, pin.JointModelFreeFlyer(), at.placement, "body")
        model.inertias[number] = pin.Inertia(body.mass_kg, np.array(body.com_m, dtype=float), np.zeros((3, 3)))
        still = np.zeros((6, q.shape[1]))
        upright = np.concatenate([still, np.ones((1, q.shape[1]))])  # not turned: the unit quaternion
        motion = (np.concatenate(pair) for pair in ((q, upright), (v, still), (a, still)))
        return _inverse_dynamics(model, *motion)[-6:]

    def torque_regressor(self, q: FloatArray, v: FloatArray, a: FloatArray, expansion: FloatArray) -> FloatArray:
        """(n, j, 10 k) derivative of the torques of j joints by the inertial parameters; rotor inertia is not in it.

        Parameters of each joint's moving body in turn: mass, mass times centre (x, y, z), inertia about the joint's
        origin (xx, xy, yy, xz, yz, zz); all (n, k) inputs without NaN.

        Args:
            q, v, a: motion of the k joints of the model.
            expansion: (k, j) their velocities by those of the j joints.
        """
        data, onto = self._model.createData(), expansion.T
        out = np.empty((len(q), len(onto), 10 * self._model.nv))
        for row, motion in zip(out, zip(q, v, a, strict=True), strict=True):  # one after the other: no second table
            own = pin.computeJointTorqueRegressor(self._model, data, *motion)
            row[...] = onto @ np.atleast_2d(own)  # that of a single joint comes as a vector
        return out

    def place_on_link(self, frame: str) -> LinkPlace:
        """Where a frame is on one of :attr:`links`."""
        at = self._frame(frame)
        pose = self._aligned[at.parentJoint].inverse() * at.placement
        return LinkPlace(int(at.parentJoint) - 1, pose.rotation.copy(), pose.translation.copy())

    @cached_property
    def links(self) -> list[ArmLink]:
        """Every joint with its z along its motion; asked for when the model is finished."""
        model, aligned, out = self._model, self._aligned, []
        for k in range(1, model.njoints):
            pose = aligned[model.parents[k]].inverse() * model.jointPlacements[k] * aligned[k]
            turn, (x, y, z) = tuple(pose.rotation.ravel().tolist()), pose.translation.tolist()
            out.append(ArmLink(model.names[k], model.parents[k] - 1, _slides(self._axes[k - 1]), turn, (x, y, z)))
        return out

    def link_inertials(self) -> FloatArray:
        """(j, 10) parameters of each joint's body, as of :meth:`torque_regressor`, in the axes of :attr:`links`."""
        pairs = zip(self._aligned[1:], list(self._model.inertias)[1:], strict=True)
        return np.array([aligned.actInv(body).toDynamicParameters() for aligned, body in pairs])

    def forward(self) -> ForwardModel:
        """Forward dynamics of this model, for simulation."""
        return ForwardModel(self)

    def _frame(self, name: str) -> Any:
        return self._model.frames[frame_id(self._model, name)]

    @cached_property  # nothing adds or moves a joint of a model that is there
    def _axes(self) -> list[FloatArray]:
        """(6,) motion of every joint per its speed, in its own axes."""
        return [np.array(joint.createData().S).ravel() for joint in list(self._model.joints)[1:]]

    @cached_property
    def _aligned(self) -> list[Any]:
        """Of the base and of every joint, a rotation of its axes that puts z along its motion."""
        turns = [pin.Quaternion.FromTwoVectors(_Z, axis[:3] if _slides(axis) else axis[3:]) for axis in self._axes]
        return [pin.SE3.Identity(), *(pin.SE3(turn.matrix(), np.zeros(3)) for turn in turns)]


class ForwardModel:
    """Forward dynamics and kinematics one sample at a time, for simulation; a copy of the model is worked on.

    Arrays handed in must be (j,) float64; those handed out may be memory that is valid until the next call only.
    """

    def __init__(self, arm: PinocchioModel) -> None:
        """``arm``: as it is; its constants and frames."""
        self.arm, self._rotor, self._model = arm, arm.armature, arm.library_model()
        self._data = self._model.createData()

    def acceleration(self, q: FloatArray, v: FloatArray, torque: FloatArray, extra: FloatArray) -> FloatArray:
        """(j,) acceleration (articulated-body algorithm).

        Args:
            q, v, torque: position, velocity, joint torque.
            extra: (j,) added to the mass matrix's diagonal for this call, kg·m²: what a linearly implicit
                integrator needs.
        """
        self._model.armature = self._rotor + extra
        out: FloatArray = pin.aba(self._model, self._data, q, v, torque)
        return out

    def at(self, frame: int, q: FloatArray, point_m: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A point of a frame at ``q``, in base axes.

        Args:
            frame: its number.
            q: (j,) position.
            point_m: (3,) in the axes of the frame.

        Returns:
            (3, 3) rotation of the frame, (3,) where the point is, and its (6, j) Jacobian, linear rows first.
        """
        out: FloatArray = pin.computeFrameJacobian(self._model, self._data, q, frame, pin.LOCAL_WORLD_ALIGNED)
        place = self._data.oMf[frame]
        arm = place.rotation @ point_m
        out[:3] -= pin.skew(arm) @ out[3:]
        return place.rotation, place.translation + arm, out


def _inverse_dynamics(model: Any, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
    out = np.empty(v.shape, order="F")
    count = threads() if v.shape[1] > _FEW else 1
    pin.rneaInParallel(count, pin.ModelPool(model, count), *map(np.asfortranarray, (q, v, a)), out)
    return out


def _pose(*, x: float = 0.0, z: float = 0.0, about_x: float = 0.0, about_z: float = 0.0) -> Any:
    rotation = pin.utils.rotate("z", about_z) @ pin.utils.rotate("x", about_x)
    return pin.SE3(rotation, np.array([x, 0.0, z]))


def _symmetric(six: Sequence[float]) -> FloatArray:
    xx, yy, zz, xy, yz, xz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _slides(axis: FloatArray) -> bool:
    """Whether a joint with this motion (6,) slides; else it turns."""
    return not axis[3:].any()
