"""Which way gravity lies in the base's axes, by the effort: before a sign or a scale is doubted.

An arm on its side has gravity torques of the wrong joints and signs; with the mounting as it is, signs and scales are
right. Friction takes power, and inertia has one sign: they tell an inverted effort from an arm that hangs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.data.joint_log import LEAST_EFFORT_CHANGE
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.robot.pinocchio_model import point_mass_parameters
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.block_sums import Estimate, estimate, products_of
from collaudit.core.torque_table.log_samples import TorqueTable

#: Samples that are looked at, at most, and the length of a block, whose samples share their errors, s.
_MOST_ROWS, _BLOCK_S = 1000, 1.0
#: Prior widths: of gravity's change, m/s²; of a tool that is not described, kg and kg·m; of the rest, none.
_WIDTH = (10.0, 10.0, 10.0, 3.0, 0.5, 0.5, 0.5)
#: Gravity of another size than the Earth's, by these shares, is that of wrong masses or of another unit.
_SIZE = (0.75, 1.33)
#: Nothing is said of a direction that is known no better than this, of a smaller tilt, and signs are not told beyond.
_SURE_DEG, _LEAST_DEG, _FAR_DEG = 5.0, 1.0, 10.0
#: Rounds at most, until gravity moves by less than this, m/s².
_ROUNDS, _STILL_M_S2 = 15, 0.02
#: Unit of a steady force beside one of m/s² of gravity, N.
_NEWTONS = 30.0
#: Someone who leans on the tool pulls along one direction, too: gravity must leave less than this share of what that
#: force leaves.
_CLEARLY = 0.97
#: Half width of an interval in standard errors: friction tells a sign with 99.9 % confidence.
_SIGMAS = 3.3


@dataclass(frozen=True, slots=True, eq=False)
class Mounting:
    """Gravity as the effort has it.

    Attributes:
        gravity_m_s2: (3,) in the base's axes.
        tilt_deg: angle from what is stated.
        half_deg: half of its 95 % interval.
    """

    gravity_m_s2: FloatArray
    tilt_deg: float
    half_deg: float

    @property
    def far(self) -> bool:
        """Whether nothing can be judged with the mounting as stated."""
        return self.tilt_deg > _FAR_DEG

    def base_rpy_deg(self, yaw_deg: float) -> str:
        """The value of ``[robot] base_rpy_deg`` with this gravity; yaw turns about gravity and is kept."""
        x, y, z = -self.gravity_m_s2 / np.linalg.norm(self.gravity_m_s2)  # the world's z: the last row of Rz Ry Rx
        pitch, roll = np.degrees(np.arcsin(np.clip(-x, -1.0, 1.0))), np.degrees(np.arctan2(y, z))
        return f"[{round(roll, 1) + 0.0:.1f}, {round(pitch, 1) + 0.0:.1f}, {yaw_deg:g}]"  # -0.0 is 0.0


def mounting(log: TorqueTable | None, robot: RobotModel) -> Mounting | None:
    """Where gravity lies elsewhere than stated, by efforts in N·m; None where it does not, or cannot be told.

    One regression over all joints: three columns of gravity, a tool and rotors that no description states, and each
    joint's friction and offset. The torque of a tool goes with gravity, so it is solved in rounds.

    Args:
        log: all joints in model order, efforts in N·m; None where they are not.
        robot: as described.
    """
    if log is None or not robot.has_inertials:
        return None
    table = _Columns.of(log, robot) if log.time_s.size else None
    if table is None or not table.known.any():
        return None
    sign = table.friction_signs(robot.gravity_base_m_s2)
    told = sign != 0.0
    if not told.any() or (sign[told] > 0.0).all():  # where nothing is inverted, what friction does not tell counts too
        sign = np.where(told, sign, 1.0)
    gravity = stated = robot.gravity_base_m_s2
    for _ in range(_ROUNDS):
        found = table.solved(gravity, sign, table.gravity)
        gravity = gravity + found.value[:3]
        if np.linalg.norm(found.value[:3]) < _STILL_M_S2:
            break
    size, stated_size = float(np.linalg.norm(gravity)), float(np.linalg.norm(stated))
    across = np.eye(3) - np.outer(gravity, gravity) / size**2
    spread = (found.covariance + np.linalg.inv(found.products))[:3, :3]  # and what motion leaves open
    error = float(np.linalg.eigvalsh(across @ spread @ across)[-1]) ** 0.5 / size
    half = float(np.degrees(STANDARD_ERRORS_95 * error))
    tilt = float(np.degrees(np.arccos(np.clip(gravity @ stated / size / stated_size, -1.0, 1.0))))
    lean = table.solved(stated, sign, table.force)
    likely = found.left < _CLEARLY * lean.left and _SIZE[0] < size / stated_size < _SIZE[1] and half < _SURE_DEG
    if not likely or tilt - half < _LEAST_DEG or (tilt > 90.0 and not told.any()):
        return None
    return Mounting(gravity * stated_size / size, tilt, half)


def mounting_findings(found: Mounting | None, yaw_deg: float) -> list[Finding]:
    """What is to be stated of the base."""
    if found is None:
        return []
    axes = ", ".join(f"{x + 0.0:.1f}" for x in found.gravity_m_s2)
    text = (
        f"By the efforts gravity lies along ({axes}) m/s² in base axes, {found.tilt_deg:.3g}° (95 %: ± "
        f"{max(found.half_deg, 0.1):.2g}°) from what [robot] states. If the arm is mounted so, state [robot] "
        f"base_rpy_deg = {found.base_rpy_deg(yaw_deg)}."
    )
    if not found.far:
        return [Finding("base-mounting", "warning", f"{text} It was judged as stated.")]
    return [Finding("base-mounting", "error", f"{text} Signs and scales of efforts were looked at with that gravity.")]


@dataclass(frozen=True, slots=True, eq=False)
class _Columns:
    """What the efforts are regressed on, (m, j, …) each, zero where a joint does not slide one way.

    Attributes:
        effort, moving: (m, j) effort, and torque of the described bodies without gravity.
        beside: (m, j, 4) direction, speed that way, one, acceleration: friction, offset and rotor.
        gravity: (m, j, 3) derivative by gravity.
        force: (m, j, 3) derivative by a steady force on the tool, in base axes and ``_NEWTONS``.
        tool: (4, m, j, 4) columns of a kg at the tool and of its way from there, kg·m: without gravity, and what each
            axis of gravity adds.
        known: (m, j) samples that count.
        block: (m,) number of the second of each.
    """

    effort: FloatArray
    moving: FloatArray
    beside: FloatArray
    gravity: FloatArray
    force: FloatArray
    tool: FloatArray
    known: BoolArray
    block: IntArray

    @classmethod
    def of(cls, table: TorqueTable, robot: RobotModel) -> _Columns:
        """Of some rows of a log."""
        rows = slice(None, None, max(1, len(table.time_s) // _MOST_ROWS))
        motion = [x[rows] for x in table.motion]
        q, v, a = (np.nan_to_num(x) for x in motion)
        way, effort = table.way[rows], table.effort[rows]
        _, place, body = robot.in_joint(None)
        ends = [point_mass_parameters(1.0, place + step) for step in (*np.eye(3), *-np.eye(3))]
        load = np.column_stack([point_mass_parameters(1.0, place), 0.5 * (np.array(ends[:3]) - ends[3:]).T])
        under = [robot.under_gravity(g) for g in (np.zeros(3), *np.eye(3))]
        tool = np.stack([one.torque_regressor(q, v, a)[:, :, 10 * body : 10 * body + 10] @ load for one in under])
        tool[1:] -= tool[0]
        _, block = np.unique(np.floor(table.time_s[rows] / _BLOCK_S), return_inverse=True)
        return cls(
            effort=np.nan_to_num(effort),
            moving=under[0].inverse_dynamics(q, v, a),
            beside=np.stack([way, np.abs(v) * way, np.ones_like(v), a], axis=2),
            gravity=robot.gravity_regressor(q),
            force=_NEWTONS * robot.base_torque_per_newton(q, robot.tool_frame),
            tool=tool,
            known=(np.abs(way) == 1.0)
            & np.isfinite(effort + np.hstack(motion).sum(axis=1, keepdims=True))
            & (np.ptp(np.nan_to_num(effort), axis=0) > LEAST_EFFORT_CHANGE),
            block=block,
        )

    def products(self, gravity: FloatArray, sign: FloatArray, free: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(b, j, 12, 12) products of columns and, last, what is left of the signed effort; (b, j) samples."""
        tool = self.tool[0] + np.tensordot(gravity, self.tool[1:], axes=1)
        left = sign * self.effort - self.moving - self.gravity @ gravity
        known = self.known & (sign != 0.0)
        columns = np.concatenate([free, tool, self.beside, left[:, :, None]], axis=2) * known[:, :, None]
        return products_of(columns, self.block), products_of(known[:, :, None].astype(float), self.block)[:, :, 0, 0]

    def solved(self, gravity: FloatArray, sign: FloatArray, free: FloatArray) -> Estimate:
        """Gravity's change, the tool, and each joint's friction, offset and rotor."""
        joints = self.effort.shape[1]
        place = np.array([[*range(7), *range(7 + 4 * j, 11 + 4 * j)] for j in range(joints)])
        prior = np.concatenate([np.array(_WIDTH) ** -2.0, np.full(4 * joints, 1e-6)])
        return estimate(*self.products(gravity, sign, free), place, prior)

    def friction_signs(self, gravity: FloatArray) -> FloatArray:
        """(j,) 1 where friction takes power with the effort's sign, -1 where it gives power, 0 where it is not told."""
        products, count = self.products(gravity, np.ones(self.effort.shape[1]), self.gravity)
        prior = np.concatenate([np.array(_WIDTH) ** -2.0, np.full(4, 1e-6)])
        out = np.zeros(len(count[0]))
        for j in np.flatnonzero(count.any(axis=0)):
            found = estimate(products[:, j : j + 1], count[:, j : j + 1], np.arange(11)[None], prior)
            value, half = found.value[7], _SIGMAS * found.covariance[7, 7] ** 0.5
            out[j] = np.sign(value) if abs(value) > half else 0.0
        return out
