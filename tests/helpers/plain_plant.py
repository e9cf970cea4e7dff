"""The plant and its contact as their equations say, in plain Python: what the compiled loop is compared with."""

from __future__ import annotations

from math import exp
from typing import Protocol

import numpy as np
import pinocchio as pin

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.pinocchio_model import PinocchioModel, Workspace
from collaudit.fixtures.lugre import LuGre
from collaudit.fixtures.plant import SAMPLE_S, STEPS, Reference, Servo, Trace
from collaudit.fixtures.polishing import CONTROL, FAR, Polishing


class Contact(Protocol):
    """A force-controlled contact. Both calls return None while the tool is far from the surface."""

    def adjust(self, sample: int, position: FloatArray) -> FloatArray | None:
        """Once a sample: (2, j) correction of the reference's position and velocity."""

    def torque(self, q: FloatArray, v: FloatArray) -> FloatArray | None:
        """Every plant step: (j,) joint torque J^T F the contact asks of the drives."""

    def wrench(self) -> FloatArray:
        """(6,) wrench at the sensor frame in its axes that the tool does to the surface now."""


class Plant:
    """One arm with its servo and friction."""

    def __init__(self, model: PinocchioModel, servo: Servo, friction: tuple[LuGre, ...]) -> None:
        self._arm, self._model = model, model.workspace()
        self._joints = [_Joint.of(f, servo, i) for i, f in enumerate(friction)]

    def run(
        self,
        reference: Reference,
        polishing: Polishing | None = None,
        progress: object = None,
    ) -> Trace:
        """Follow a reference from standstill at its first position, with a surface and its force control, if any."""
        contact = None if polishing is None else PlainContact(self._arm, polishing)
        n, count = reference.position.shape
        trace = Trace(np.empty((n, count)), np.empty((n, count)), np.empty((n, count)), np.zeros((n, 6)))
        q, v = reference.position[0].copy(), np.zeros(count)
        for joint in self._joints:
            joint.z = 0.0
        goal = np.stack([reference.position[0], np.zeros(count)])
        for k in range(n):
            ahead = np.stack([reference.position[min(k + 1, n - 1)], reference.velocity[min(k + 1, n - 1)]])
            if contact is not None:
                correction = contact.adjust(k, ahead[0])
                if correction is not None:
                    ahead = ahead + correction
            trace.position[k], trace.velocity[k] = q, v
            if contact is not None:
                trace.wrench[k] = contact.wrench()
            known = (reference.feedforward_nm[k], reference.push_nm[k])
            self._sample(q, v, goal, ahead, known, contact, trace.drive_nm[k])
            goal = ahead
        return trace

    def _sample(
        self,
        q: FloatArray,
        v: FloatArray,
        goal: FloatArray,
        ahead: FloatArray,
        known: tuple[FloatArray, FloatArray],
        contact: Contact | None,
        drive: FloatArray,
    ) -> None:
        """Integrate one sample in place; the reference (2, j) runs straight from ``goal`` to ``ahead``."""
        h, model, joints = SAMPLE_S / STEPS, self._model, self._joints
        feedforward, push = known[0].tolist(), known[1].tolist()
        positions, velocities = q.tolist(), v.tolist()
        torque, extra = np.empty_like(q), np.empty_like(q)
        for step in range(STEPS):
            outside = contact.torque(q, v) if contact is not None else None
            targets, rates = (goal + step / STEPS * (ahead - goal)).tolist()
            drives, nets, implicit, betas = [], [], [], []
            for joint, position, velocity, target, rate, ahead_nm, push_nm in zip(
                joints, positions, velocities, targets, rates, feedforward, push, strict=True
            ):
                tau = ahead_nm + joint.kp * (target - position) + joint.kd * (rate - velocity)
                limit = joint.limit
                tau = limit if tau > limit else -limit if tau < -limit else tau
                beta, friction, slope_nm = joint.friction(velocity, h)
                drives.append(tau)
                nets.append(tau - friction - push_nm)
                implicit.append(h * slope_nm)
                betas.append(beta)
            if step == 0:
                drive[:] = drives
            torque[:], extra[:] = nets, implicit
            if outside is not None:
                torque -= outside
            v += h * acceleration(model, q, v, torque, extra)
            q += h * v
            positions, velocities = q.tolist(), v.tolist()
            for joint, beta, velocity in zip(joints, betas, velocities, strict=True):
                joint.z = beta * (joint.z + h * velocity)


class _Joint:
    """Servo gains, friction constants and bristle state of one joint, as plain numbers for the inner loop."""

    __slots__ = ("_backward", "_forward", "_s0", "_s1", "_square", "kd", "kp", "limit", "z")

    def __init__(self, friction: LuGre, kp: float, kd: float, limit: float) -> None:
        self.kp, self.kd, self.limit, self.z = kp, kd, limit, 0.0
        self._s0, self._s1 = friction.bristle_nm_per_rad, friction.bristle_nm_s_per_rad
        self._square = friction.exponent == 2
        self._forward, self._backward = (
            (s.coulomb_nm, s.stiction_nm - s.coulomb_nm, 1.0 / s.stribeck_rad_s, s.viscous_nm_s_per_rad)
            for s in (friction.forward, friction.backward)
        )

    @classmethod
    def of(cls, friction: LuGre, servo: Servo, index: int) -> _Joint:
        return cls(friction, float(servo.kp[index]), float(servo.kd[index]), float(servo.limit_nm[index]))

    def friction(self, v: float, h: float) -> tuple[float, float, float]:
        """beta, friction if the velocity stayed, and its derivative by the velocity after the step."""
        coulomb, rise, inverse, viscous = self._forward if v >= 0.0 else self._backward
        speed = v if v >= 0.0 else -v
        ratio = speed * inverse
        g = coulomb + rise * exp(-ratio * ratio if self._square else -ratio)
        s0, s1, z = self._s0, self._s1, self.z
        beta = 1.0 / (1.0 + h * s0 * speed / g)
        force = (s0 + s1 / h) * beta * (z + h * v) - s1 * z / h + viscous * v
        return beta, force, beta * (s0 * h + s1) + viscous


def acceleration(model: Workspace, q: FloatArray, v: FloatArray, torque: FloatArray, extra: FloatArray) -> FloatArray:
    """(j,) by the articulated-body algorithm, with ``extra`` (j,) on the mass matrix's diagonal."""
    inner = model._model
    rotor = np.array(inner.armature)
    inner.armature = rotor + extra
    out: FloatArray = np.array(pin.aba(inner, model._data, q, v, torque))
    inner.armature = rotor
    return out


class PlainContact:
    """Force control along the base's z, position control in x and y."""

    def __init__(self, model: PinocchioModel, polishing: Polishing) -> None:
        self.tip_m, self.surface, self.control = polishing.tip_m, polishing.surface, polishing.control
        self.plan = polishing.plan
        self._model, self._number = model.workspace(), model.frame_number(polishing.frame)
        self._velocity = self._integral = self._seen = 0.0
        self._correction: FloatArray | None = None
        self._wrench, self._normal, self._active = np.zeros(6), 0.0, False

    def adjust(self, sample: int, position: FloatArray) -> FloatArray | None:
        """Correction (2, j) of the reference's position and velocity."""
        mode = self.plan.mode[sample]
        self._active = bool(mode != FAR)
        if not self._active:
            self._wrench = np.zeros(6)
            return None
        if self._correction is None:
            self._correction = np.zeros_like(position)
        if mode == CONTROL:
            rate = self._joint_rate(position + self._correction, self._tool_speed(sample))
            self._correction = self._correction + SAMPLE_S * rate
            return np.stack([self._correction, rate])
        return np.stack([self.plan.share[sample] * self._correction, np.zeros_like(position)])

    def torque(self, q: FloatArray, v: FloatArray) -> FloatArray | None:
        """J^T F of the force the tool does to the surface."""
        if not self._active:
            return None
        self._model.update(q)
        rotation, origin = self._model.pose(self._number)
        arm = rotation @ self.tip_m
        x, y, z = (origin + arm).tolist()
        depth = self.surface.height(x, y) - z
        if depth <= 0.0:
            self._wrench, self._normal = np.zeros(6), 0.0
            return None
        jacobian = self._model.jacobian(self._number, self.tip_m)[:3]
        speed = jacobian @ v
        surface = self.surface
        normal = max(0.0, surface.stiffness_n_per_m * depth - surface.damping_n_s_per_m * speed[2])
        drag = surface.friction * normal / np.hypot(np.hypot(speed[0], speed[1]), 0.005)
        force = np.array([drag * speed[0], drag * speed[1], -normal])
        self._normal = normal
        self._wrench = np.concatenate([rotation.T @ force, rotation.T @ np.cross(arm, force)])
        out: FloatArray = jacobian.T @ force
        return out

    def wrench(self) -> FloatArray:
        """(6,) at the sensor frame, which is the tool's."""
        return self._wrench

    def _tool_speed(self, sample: int) -> float:
        """Downward tool speed, m/s, from the force error."""
        control = self.control
        measured = self._normal + float(self.plan.noise_n[sample])
        self._seen += 0.25 * (measured - self._seen)
        error = float(self.plan.desired_n[sample]) - self._seen
        self._integral += SAMPLE_S * error
        virtual = control.proportional * error + control.integral_per_s * self._integral
        decay = SAMPLE_S * control.damping_n_s_per_m / control.mass_kg
        self._velocity = (self._velocity + SAMPLE_S * virtual / control.mass_kg) / (1.0 + decay)
        return self._velocity

    def _joint_rate(self, q: FloatArray, down_m_s: float) -> FloatArray:
        """Joint velocity for a tool velocity along -z without turning (damped least squares)."""
        self._model.update(q)
        jacobian = self._model.jacobian(self._number, self.tip_m)
        wanted = np.array([0.0, 0.0, -down_m_s, 0.0, 0.0, 0.0])
        damped = jacobian @ jacobian.T + 1e-6 * np.eye(6)
        out: FloatArray = jacobian.T @ np.linalg.solve(damped, wanted)
        return out
