"""Forward dynamics, for simulation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from collaudit.core.errors import RobotError
from collaudit.core.numeric.arrays import FloatArray


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
