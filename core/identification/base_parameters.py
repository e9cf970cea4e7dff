"""Base inertial parameters: the combinations that joint torques depend on, by a rank-revealing QR decomposition.

Gautier, "Numerical calculation of the base inertial parameters of robots", J. Robotic Systems 8, 1991.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.robot_model import RobotModel

_SYMBOLS = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
_RANK = 1e-9
_NEGLIGIBLE = 1e-8
_SHOWN_TERMS = 6


@dataclass(frozen=True, slots=True, eq=False)
class BaseMap:
    """base = matrix @ parameters; ``names`` say which combinations these are.

    Attributes:
        matrix: (b, p).
        names: b texts.
    """

    matrix: FloatArray
    names: tuple[str, ...]


def base_map(robot: RobotModel, labels: tuple[str, ...], seed: int = 0) -> BaseMap:
    """Base parameters of an arm, from its regressor at random motions.

    Args:
        robot: the arm.
        labels: names of its moving bodies, ten parameters each.
        seed: of the random motions; the combinations do not depend on it.
    """
    from scipy.linalg import qr

    rng = np.random.default_rng(seed)
    joints = len(robot.joint_names)
    motion = [rng.uniform(-np.pi, np.pi, (60, joints)) for _ in range(3)]
    stacked = robot.torque_regressor(*motion).reshape(60 * joints, -1)
    _, r, order = qr(stacked, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(r))
    rank = int(np.count_nonzero(diagonal > _RANK * diagonal[0]))
    dependent = np.linalg.solve(r[:rank, :rank], r[:rank, rank:])
    matrix = np.zeros((rank, stacked.shape[1]))
    matrix[np.arange(rank), order[:rank]] = 1.0
    dependent[np.abs(dependent) < _NEGLIGIBLE] = 0.0
    matrix[:, order[rank:]] = dependent
    symbols = [f"{s}({label})" for label in labels for s in _SYMBOLS]
    return BaseMap(matrix, tuple(_name(row, int(k), symbols) for row, k in zip(matrix, order[:rank], strict=True)))


def _name(row: FloatArray, first: int, symbols: list[str]) -> str:
    terms = [symbols[first]]
    others = [int(k) for k in np.flatnonzero(row) if k != first]
    for k in others[:_SHOWN_TERMS]:
        sign, size = ("+", row[k]) if row[k] > 0 else ("-", -row[k])
        factor = "" if abs(size - 1.0) < 1e-6 else f"{size:.3g}·"
        terms.append(f"{sign} {factor}{symbols[k]}")
    if len(others) > _SHOWN_TERMS:
        terms.append(f"+ {len(others) - _SHOWN_TERMS} more")
    return " ".join(terms)
