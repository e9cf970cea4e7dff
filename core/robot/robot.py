"""The robot model the rest of the program sees: torques from motion, in the log's joints."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.errors import NotJudgedError, RobotError
from collaudit.core.findings import Finding
from collaudit.core.robot.model import RigidBodies
from collaudit.core.robot.names import unknown_name
from collaudit.core.robot.statics import Chain, chain_gravity, chain_torque, skew
from collaudit.core.series import BoolArray, FloatArray, JointType

#: Samples at a time.
_BLOCK = 8192
_MATRIX_BLOCK = 2048


@dataclass(frozen=True, slots=True)
class Tool:
    """What the arm carries: a point mass at ``com_m`` (m) of ``frame``."""

    frame: str
    mass_kg: float
    com_m: tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class RobotModel:
    """A rigid-body model in the joints of a log.

    Attributes:
        joint_names: j joints in model order.
        joint_types: their kinds.
        effort_limit_nm: (j,) N·m, or N for prismatic joints; NaN = none.
        position_limits: (j, 2) rad or m; NaN = none.
        has_inertials: whether torques can be computed.
        sha256: hash of the description and of the settings that change it, free of paths.
        findings: what building the model showed.
        gravity_m_s2: (3,) in the world.
        gravity_base_m_s2: (3,) the same in the base's axes.
        tool: the tool that is part of the model, or None.
        bodies: the rigid bodies, None without a description.
        expansion: (k, j) model joint positions = expansion @ positions + offset (order, mimicking joints).
        offset: (k,) rad or m.
    """

    joint_names: tuple[str, ...]
    joint_types: tuple[JointType, ...]
    effort_limit_nm: FloatArray
    position_limits: FloatArray
    has_inertials: bool
    sha256: str
    findings: tuple[Finding, ...]
    gravity_m_s2: FloatArray
    gravity_base_m_s2: FloatArray
    tool: Tool | None
    bodies: RigidBodies | None
    expansion: FloatArray
    offset: FloatArray

    @property
    def frame_names(self) -> tuple[str, ...]:
        """Frames a wrench or a tool can be given in."""
        return self.bodies.frame_names if self.bodies else ()

    def inverse_dynamics(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """Torque M(q) a + C(q, v) v + G(q) of eq. (4), with rotor inertia and tool.

        Args:
            q, v, a: (n, j) rad, rad/s, rad/s² (m … for prismatic joints); NaN where unknown.

        Returns:
            (n, j) N·m (N); NaN in rows with any NaN.

        Raises:
            NotJudgedError: the model has no inertials.
        """
        bodies = self._with_inertials()
        for name, array in (("q", q), ("v", v), ("a", a)):
            self._check(array, len(self.joint_names), name)
        out = np.empty((q.shape[0], len(self.joint_names)))
        for start in range(0, q.shape[0], _BLOCK):  # what is needed on the way stays in the cache
            block = slice(start, start + _BLOCK)
            out[block] = self._torque(bodies, q[block], v[block], a[block])
        return out

    def _torque(self, bodies: RigidBodies, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """:meth:`inverse_dynamics` of some samples."""
        complete = all(np.isfinite(x.sum()) for x in (q, v, a))
        unknown: BoolArray | None = None if complete else np.asarray(np.isnan(q + v + a).any(axis=1))
        rows = [x if unknown is None else np.where(unknown[:, None], 0.0, x) for x in (q, v, a)]
        full = (self._expand(rows[0]), _times(rows[1], self.expansion.T), _times(rows[2], self.expansion.T))
        out = _times(bodies.inverse_dynamics(*full), self.expansion)
        if unknown is not None:
            out[unknown] = np.nan
        return out

    def gravity_torque(self, q: FloatArray) -> FloatArray:
        """Torque that holds the arm against gravity, (n, j) N·m; see :meth:`inverse_dynamics`."""
        still = np.zeros_like(q)
        return self.inverse_dynamics(q, still, still)

    def weightless(self) -> RobotModel:
        """The same arm without gravity: its inverse dynamics at rest are M(q) a."""
        return replace(self, bodies=self._with_inertials().weightless())

    def torque_regressor(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """Derivative of the joint torques by the inertial parameters of :attr:`inertial_parameters`.

        Args:
            q, v, a: (n, j) without NaN.

        Returns:
            (n, j, p): torque = regressor @ parameters + rotor inertia * a.

        Raises:
            NotJudgedError: the model has no inertials.
        """
        bodies = self._with_inertials()
        full = bodies.torque_regressor(self._expand(q), v @ self.expansion.T, a @ self.expansion.T)
        return np.asarray(np.einsum("kj,nkp->njp", self.expansion, full))

    @property
    def inertial_parameters(self) -> FloatArray:
        """(p,) ten for each moving body: mass, first moments, inertia about the joint's origin."""
        return self._with_inertials().inertial_parameters()

    @property
    def armature(self) -> FloatArray:
        """(k,) rotor inertia of every joint of the model, kg·m² or kg."""
        return self._with_inertials().armature

    def with_inertials(self, parameters: FloatArray, armature: FloatArray) -> RobotModel:
        """The same arm with other inertial parameters (p,) and rotor inertias (k,)."""
        return replace(self, bodies=self._with_inertials().with_parameters(parameters, armature))

    def wrench_torque(self, q: FloatArray, wrench: FloatArray, frame: str) -> FloatArray:
        """Joint torque J(q)^T F of a wrench, eq. (2).

        Args:
            q: (n, j) positions.
            wrench: (n, 6) force N and torque N·m at the frame's origin in the frame's axes.
            frame: a frame of the model.

        Returns:
            (n, j) N·m; NaN where an input on the way is NaN.

        Raises:
            RobotError: no such frame. NotJudgedError: there is no robot description.
        """
        self._check(q, len(self.joint_names), "q")
        self._check(wrench, 6, "wrench")
        chain = self._chain(frame)
        return _times(chain_torque(chain, self._expand(q), wrench), self.expansion)

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
        self._check(q, len(self.joint_names), "q")
        chain = self._chain(frame)
        if self.tool is None or self.bodies is None:
            return np.zeros((q.shape[0], 6))
        pose = self.bodies.frame_offset(self.tool.frame, frame)
        if pose is None:
            raise RobotError(
                "the tool's weight cannot be felt in this frame: a joint lies between them",
                where="log.wrench_frame",
                found=f"sensor {frame}, tool {self.tool.frame}",
                hint="give both in frames of the same link",
            )
        weight = self.tool.mass_kg * chain_gravity(chain, self._expand(q), self.gravity_base_m_s2)
        com = pose[0] @ np.array(self.tool.com_m) + pose[1]
        return np.hstack([weight, _times(weight, skew(com).T)])

    def link_of(self, joint: str) -> str | None:
        """A frame of the link that a joint moves, or None without a description."""
        if self.bodies is None:
            return None
        frames = [f for f in self.bodies.frame_names if f != joint and self.bodies.frame_joint(f) == joint]
        return frames[0] if frames else None

    def frame_rotation(self, q: FloatArray, frame: str) -> FloatArray:
        """(3, 3) axes of a frame in the base at one position (j,).

        Raises:
            RobotError: no such frame. NotJudgedError: there is no robot description.
        """
        position = self._expand(q[None, :])
        chain = self._chain(frame)
        return np.stack([chain_gravity(chain, position, axis)[0] for axis in np.eye(3)])

    def gravity_in(self, q: FloatArray, frame: str) -> FloatArray:
        """(n, 3) gravity in a frame's axes, m/s², at positions (n, j)."""
        self._check(q, len(self.joint_names), "q")
        return chain_gravity(self._chain(frame), self._expand(q), self.gravity_base_m_s2)

    def _chain(self, frame: str) -> Chain:
        if self.bodies is None:
            raise NotJudgedError(
                "forces at the tool cannot be turned into joint torques without a robot description",
                hint="give [robot] urdf or dh rows",
            )
        if frame not in self.bodies.frame_names:
            raise unknown_name("the robot has no such frame", "log.wrench_frame", frame, self.bodies.frame_names)
        return self.bodies.chain(frame)

    def _with_inertials(self) -> RigidBodies:
        if self.bodies is None or not self.has_inertials:
            raise NotJudgedError(
                "no model torque can be computed: the robot has no inertials",
                hint="give a URDF with <inertial> elements, or masses in the [[robot.dh]] rows",
            )
        return self.bodies

    def _expand(self, q: FloatArray) -> FloatArray:
        out = _times(q, self.expansion.T)
        return out + self.offset if self.offset.any() else out

    def _check(self, array: FloatArray, columns: int, name: str) -> None:
        if array.ndim != 2 or array.shape[1] != columns:
            raise ValueError(f"{name} has shape {array.shape}, expected (n, {columns})")


def _times(x: FloatArray, matrix: FloatArray) -> FloatArray:
    """``x @ matrix`` of a long, narrow x: by blocks, for which the BLAS starts no threads that would only wait."""
    if np.array_equal(matrix, np.eye(*matrix.shape)):
        return x
    out = np.empty((x.shape[0], matrix.shape[1]))
    for start in range(0, x.shape[0], _MATRIX_BLOCK):
        np.matmul(x[start : start + _MATRIX_BLOCK], matrix, out=out[start : start + _MATRIX_BLOCK])
    return out
