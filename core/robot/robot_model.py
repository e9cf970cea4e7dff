"""The robot model the rest of the program sees: torques from motion, in the log's joints."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from collaudit.core.data.joint_log import JointType
from collaudit.core.errors import NotJudgedError, RobotError
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import by_samples
from collaudit.core.robot.pinocchio_model import PinocchioModel, PointMass
from collaudit.core.robot.robot_description import unknown_name

_ORIGIN = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class RobotModel:
    """A rigid-body model in the joints of a log.

    Attributes:
        joint_names: j joints in model order.
        joint_types: their kinds.
        effort_limit_nm: (j,) N·m, or N for prismatic joints; NaN = none.
        position_limits: (j, 2) rad or m; NaN = none.
        speed_limits: (j,) rad/s or m/s; NaN = none.
        has_inertials: whether torques can be computed.
        sha256: hash of the description and of the settings that change it, free of paths.
        findings: what building the model showed.
        gravity_base_m_s2: (3,) in the base's axes.
        tool: the tool that is part of the model, or None.
        bodies: the rigid bodies, None without a description.
        expansion: (k, j) model joint positions = expansion @ positions + offset (order, mimicking joints).
        offset: (k,) rad or m.
        weightless: of links without a mass, by the joint that moves one: all that carry it, itself included.
        tool_frame: where a tool is mounted: as stated, else the last link; empty without a description.
    """

    joint_names: tuple[str, ...]
    joint_types: tuple[JointType, ...]
    effort_limit_nm: FloatArray
    position_limits: FloatArray
    speed_limits: FloatArray
    has_inertials: bool
    sha256: str
    findings: tuple[Finding, ...]
    gravity_base_m_s2: FloatArray
    tool: PointMass | None
    bodies: PinocchioModel | None
    expansion: FloatArray
    offset: FloatArray
    weightless: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    tool_frame: str = ""

    @property
    def frame_names(self) -> tuple[str, ...]:
        """Frames a wrench or a tool can be given in."""
        return self.bodies.frame_names if self.bodies else ()

    @property
    def sliding(self) -> tuple[str, ...]:
        """Prismatic joints: forces in N, ways in m."""
        kinds = zip(self.joint_names, self.joint_types, strict=True)
        return tuple(name for name, kind in kinds if kind == "prismatic")

    def inverse_dynamics(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """Torque M(q) a + C(q, v) v + G(q) of eq. (4), with rotor inertia and tool.

        Args:
            q, v, a: (n, j) rad, rad/s, rad/s² (m … for prismatic joints); NaN where unknown.

        Returns:
            (n, j) N·m (N); NaN in rows with any NaN.

        Raises:
            NotJudgedError: the model has no inertials.
        """
        return self._torques(self.inertial_bodies().inverse_dynamics, (q, v, a))

    def momentum(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Momentum M(q) v, and C(q, v)^T v - G(q), with rotor inertia and tool.

        Args:
            q, v: as for :meth:`inverse_dynamics`.

        Returns:
            two (n, j): N·m·s and N·m (N·s and N); NaN in rows with any NaN.

        Raises:
            NotJudgedError: the model has no inertials.
        """
        count = len(self.joint_names)
        both = self._torques(self.inertial_bodies().momentum, (q, v), parts=2)
        return both[:, :count], both[:, count:]

    def _torques(self, compute: Callable[..., FloatArray], motion: Sequence[FloatArray], parts: int = 1) -> FloatArray:
        """(n, j · parts) of a computation in the model's joints, from motion (n, j)."""

        def of_rows(*rows: FloatArray) -> FloatArray:
            return np.concatenate([self.expansion.T @ x for x in np.split(compute(*self._moving(rows)), parts)])

        return by_samples(of_rows, self._checked(motion), parts * len(self.joint_names))

    def _moving(self, rows: Sequence[FloatArray]) -> list[FloatArray]:
        """Positions (k, m) of every joint of the model, their speeds, …, from those (j, m) of the log's."""
        return [self.expansion @ x + (0.0 if k else self.offset[:, None]) for k, x in enumerate(rows)]

    def gravity_torque(self, q: FloatArray) -> FloatArray:
        """Torque that holds the arm against gravity, (n, j) N·m; see :meth:`inverse_dynamics`."""
        return self.inverse_dynamics(q, still := np.zeros_like(q), still)

    def gravity_regressor(self, q: FloatArray) -> FloatArray:
        """(n, j, 3) derivative of :meth:`gravity_torque` by gravity in base axes, N·m for a m/s²."""
        return np.stack([self.under_gravity(axis).gravity_torque(q) for axis in np.eye(3)], axis=2)

    def torque_regressor(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """Derivative of the joint torques by the inertial parameters of :attr:`inertial_parameters`.

        Args:
            q, v, a: (n, j) without NaN.

        Returns:
            (n, j, p): torque = regressor @ parameters + rotor inertia * a.

        Raises:
            NotJudgedError: the model has no inertials.
        """
        bodies = self.inertial_bodies()
        moving = self._expand(q), v @ self.expansion.T, a @ self.expansion.T
        return bodies.torque_regressor(*moving, self.expansion)

    @property
    def inertial_parameters(self) -> FloatArray:
        """(p,) ten for each moving body: mass, first moments, inertia about the joint's origin."""
        return self.inertial_bodies().inertial_parameters()

    @property
    def armature(self) -> FloatArray:
        """(k,) rotor inertia of every joint of the model, kg·m² or kg."""
        return self.inertial_bodies().armature

    def with_inertials(self, parameters: FloatArray, armature: FloatArray) -> RobotModel:
        """The same arm with other inertial parameters (p,) and rotor inertias (k,)."""
        return replace(self, bodies=self.inertial_bodies().with_parameters(parameters, armature))

    def under_gravity(self, gravity_base_m_s2: FloatArray) -> RobotModel:
        """The same arm on another base: gravity (3,) in base axes."""
        bodies = self.inertial_bodies().under_gravity(gravity_base_m_s2)
        return replace(self, bodies=bodies, gravity_base_m_s2=gravity_base_m_s2)

    def without_gravity(self) -> RobotModel:
        """The same arm whose joint torques hold no gravity; what a sensor or a tool weighs stays as it is."""
        return self if self.bodies is None else replace(self, bodies=self.bodies.under_gravity(np.zeros(3)))

    def wrench_torque(self, q: FloatArray, wrench: FloatArray, frame: str) -> FloatArray:
        """Joint torque J(q)^T F of a wrench, eq. (2).

        Args:
            q: (n, j) positions.
            wrench: (n, 6) force N and torque N·m at the frame's origin in the frame's axes.
            frame: a frame of the model.

        Returns:
            (n, j) N·m; NaN in rows with any NaN.

        Raises:
            RobotError: no such frame. NotJudgedError: there is no robot description.
        """
        bodies = self._with_frame(frame)

        def of_rows(rows: FloatArray, forces: FloatArray) -> FloatArray:
            torque: FloatArray = self.expansion.T @ bodies.wrench_torque(self._moving([rows])[0], forces, frame)
            return torque

        return by_samples(of_rows, self._checked([q]) + self._checked([wrench], 6), len(self.joint_names))

    def torque_per_newton(self, q: FloatArray, frame: str) -> FloatArray:
        """(n, j, 3) torque of each joint, N·m (N), for a newton along each axis of a frame at (n, j): J_v^T."""
        unit = np.hstack([np.eye(3), np.zeros((3, 3))])
        columns = [self.wrench_torque(q, np.tile(axis, (len(q), 1)), frame) for axis in unit]
        return np.stack(columns, axis=2)

    def base_torque_per_newton(self, q: FloatArray, frame: str) -> FloatArray:
        """(n, j, 3) as :meth:`torque_per_newton`, for a newton along each axis of the base."""
        units = [self.weight_in(q, PointMass(frame, 1.0, _ORIGIN), axis) for axis in np.eye(3)]
        return np.stack([self.wrench_torque(q, unit, frame) for unit in units], axis=2)

    def contact_torque(
        self, q: FloatArray, v: FloatArray, a: FloatArray, wrench: FloatArray, frame: str, carried: PointMass
    ) -> FloatArray:
        """:meth:`wrench_torque` less what it takes to accelerate a body between the sensor and what it touches.

        A wrist sensor feels that, and it is no force on the environment.

        Args:
            q, v, a: (n, j) motion.
            wrench, frame: as for :meth:`wrench_torque`, the body's weight taken out.
            carried: the body.
        """
        return self.wrench_torque(q, wrench, frame) - self.without_gravity().load_torque(q, v, a, carried)

    def tool_wrench(self, q: FloatArray, frame: str) -> FloatArray:
        """Static wrench of the tool's weight on a sensor: the force the tool exerts on it.

        Args:
            q: (n, j) positions.
            frame: the sensor's frame; no joint may lie between it and the tool's frame.

        Returns:
            (n, 6) N and N·m in the frame's axes; zero when the model has no tool.

        Raises:
            RobotError: no such frame, or the tool moves against it.
        """
        self._with_frame(frame)
        if self.tool is None:
            return np.zeros((q.shape[0], 6))
        return self.weight_in(q, self.tool_in(frame))

    def tool_in(self, frame: str) -> PointMass:
        """The tool, which there must be, as a body on another frame; errors as of :meth:`tool_wrench`."""
        assert self.tool is not None
        pose = self._with_frame(frame).frame_offset(self.tool.frame, frame)
        if pose is None:
            raise RobotError(
                "the tool's weight cannot be felt in this frame: a joint lies between them",
                where="log.wrench_frame",
                found=f"sensor {frame}, tool {self.tool.frame}",
                hint="give both in frames of the same link",
            )
        x, y, z = (pose[0] @ np.array(self.tool.com_m) + pose[1]).tolist()
        return PointMass(frame, self.tool.mass_kg, (x, y, z))

    def weight_in(self, q: FloatArray, body: PointMass, gravity_m_s2: FloatArray | None = None) -> FloatArray:
        """(n, 6) N and N·m: weight of a point mass at its frame's origin, in its axes.

        Args:
            q: (n, j) positions.
            body: the point mass.
            gravity_m_s2: (3,) in base axes; None: the arm's.
        """
        bodies = self._with_frame(body.frame)
        pull = body.mass_kg * (self.gravity_base_m_s2 if gravity_m_s2 is None else gravity_m_s2)

        def of_rows(rows: FloatArray) -> FloatArray:
            force = bodies.base_direction(self._moving([rows])[0], body.frame, pull)
            return np.concatenate([force, np.cross(body.com_m, force, axisb=0, axisc=0)])

        return by_samples(of_rows, self._checked([q]), 6)

    def holding_torque(self, q: FloatArray, body: PointMass) -> FloatArray:
        """(n, j) torque that holds a point mass against gravity, N·m (N), at positions (n, j)."""
        return -self.wrench_torque(q, self.weight_in(q, body), body.frame)

    def load_torque(self, q: FloatArray, v: FloatArray, a: FloatArray, body: PointMass) -> FloatArray:
        """(n, j) what :meth:`inverse_dynamics` gives more where the arm carries a point mass, of any sign."""
        return self._torques(self._with_frame(body.frame).carrying(body).inverse_dynamics, (q, v, a))

    def moving_force(self, q: FloatArray, v: FloatArray, a: FloatArray, body: PointMass) -> FloatArray:
        """(n, 6) N and N·m: what accelerates and holds a point mass, at its frame's origin, in its axes."""
        bodies = self._with_frame(body.frame)
        return by_samples(lambda *rows: bodies.moving_force(body, *self._moving(rows)), self._checked([q, v, a]), 6)

    def _frames_of(self, joint: str) -> list[str]:
        """Frames that a joint moves and no joint after it; none without a description."""
        bodies = self.bodies
        return [] if bodies is None else [f for f in bodies.frame_names if bodies.frame_joint(f) == joint]

    def link_of(self, joint: str) -> str | None:
        """A frame of the link that a joint moves, or None without a description."""
        return next((frame for frame in self._frames_of(joint) if frame != joint), None)

    def frame_at(self, joint: str) -> str | None:
        """The frame of a joint, or else of the link that it moves; None without a description."""
        return joint if joint in self.frame_names else self.link_of(joint)

    def outer_frame(self, joint: str) -> str | None:
        """The frame of the link that a joint moves which is furthest from it: where a hand or tool is, of the last."""
        return max(self._frames_of(joint), key=self.distance_in_joint, default=None)

    def in_joint(self, frame: str | None) -> tuple[FloatArray, FloatArray, int]:
        """Rotation and position (m) of a frame, None for the tool's, in the joint that moves it; that body's number."""
        return self.inertial_bodies().frame_in_joint(frame or self.tool_frame)

    def distance_in_joint(self, frame: str) -> float:
        """From the joint that moves a frame to the frame, m; 0 without a description."""
        return 0.0 if self.bodies is None else float(np.linalg.norm(self.bodies.frame_in_joint(frame)[1]))

    def frame_rotation(self, q: FloatArray, frame: str) -> FloatArray:
        """(3, 3) axes of a frame in the base at one position (j,).

        Raises:
            RobotError: no such frame. NotJudgedError: there is no robot description.
        """
        return self._with_frame(frame).frame_poses(self._expand(q), [frame])[0][0]

    def frame_positions(self, q: FloatArray, frames: Sequence[str]) -> FloatArray:
        """(k, 3) origins of frames in the base at one position (j,), m.

        Raises:
            RobotError: no such frame. NotJudgedError: there is no robot description.
        """
        poses = self._with_frame(*frames).frame_poses(self._expand(q), frames)
        return np.array([origin for _, origin in poses]).reshape(-1, 3)

    def gravity_in(self, q: FloatArray, frame: str) -> FloatArray:
        """(n, 3) gravity in a frame's axes, m/s², at positions (n, j)."""
        return np.ascontiguousarray(self.weight_in(q, PointMass(frame, 1.0, _ORIGIN))[:, :3])

    def _with_frame(self, *frames: str) -> PinocchioModel:
        if self.bodies is None:
            raise NotJudgedError(
                "forces at the tool cannot be turned into joint torques without a robot description",
                hint="give [robot] urdf or dh rows",
            )
        known = self.bodies.frame_names
        if unknown := [frame for frame in frames if frame not in known]:
            raise unknown_name("the robot has no such frame", "log.wrench_frame", unknown[0], known)
        return self.bodies

    def inertial_bodies(self) -> PinocchioModel:
        """The rigid bodies; NotJudgedError without their inertials."""
        if self.bodies is None or not self.has_inertials:
            raise NotJudgedError(
                "no model torque can be computed: the robot has no inertials",
                hint="give a URDF with <inertial> elements, or masses in the [[robot.dh]] rows",
            )
        return self.bodies

    def _expand(self, q: FloatArray) -> FloatArray:
        """(…, k) positions of every joint of the model."""
        return np.asarray(q @ self.expansion.T + self.offset)

    def _checked(self, signals: Sequence[FloatArray], columns: int | None = None) -> list[FloatArray]:
        """The signals; ValueError where one is not (n, columns), by default of the log's joints."""
        wide = columns or len(self.joint_names)
        for array in signals:
            if array.ndim != 2 or array.shape[1] != wide:
                raise ValueError(f"a signal has shape {array.shape}, expected (n, {wide})")
        return list(signals)
