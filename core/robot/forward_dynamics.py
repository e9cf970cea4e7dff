"""Forward dynamics, for simulation."""

from __future__ import annotations

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.link_constants import Link
from collaudit.core.robot.pinocchio_model import PinocchioModel


class ForwardModel:
    """Forward dynamics and kinematics one sample at a time, through preallocated data.

    Arrays handed in must be (j,) float64; those handed out are the library's own memory, valid until the next call.
    """

    def __init__(self, model: PinocchioModel) -> None:
        """``model``: the arm; a copy of it is worked on."""
        self._plain, self._model = model, model.copy()
        self._workspace = self._model.workspace()
        self._rotor = self._model.armature
        #: The calls of :class:`Workspace` that a simulation needs as they are.
        self.gravity_torque = self._workspace.gravity_torque
        self.update, self.pose = self._workspace.update, self._workspace.pose
        self.jacobian = self._workspace.jacobian

    def acceleration(self, q: FloatArray, v: FloatArray, torque: FloatArray, extra: FloatArray) -> FloatArray:
        """(j,) acceleration.

        Args:
            q, v, torque: position, velocity, joint torque.
            extra: (j,) added to the mass matrix's diagonal for this call, kg·m²: what a linearly implicit
                integrator needs.
        """
        self._model.set_armature(self._rotor + extra)
        return self._workspace.forward_dynamics(q, v, torque)

    def links(self) -> list[Link]:
        """The arm's constants, one joint and its body each."""
        return self._plain.links()

    @property
    def gravity_m_s2(self) -> FloatArray:
        """(3,) in base axes."""
        return self._plain.gravity_m_s2

    def frame_id(self, name: str) -> int:
        """Number of a frame.

        Raises:
            RobotError: there is no such frame.
        """
        return self._model.frame_number(name)
