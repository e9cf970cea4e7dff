"""Logs of the motors' side brought to the joints: q_motor = R q, tau_joint = R^T tau_motor, and the zero of the joints.

What a drive measures is a motor's angle and torque. With R the reduction (a matrix where the motors of a wrist turn
several joints), virtual work gives dq_motor = R dq and tau_joint = R^T tau_motor (Siciliano et al., Robotics, 2009,
section 5.1). The robot description may count its angles from another zero than the log.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.conditioning.position_jumps import continued_angles
from collaudit.core.config.schema import RobotConfig
from collaudit.core.data.identification_result import Coupling
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import ConfigError
from collaudit.core.findings import fact
from collaudit.core.numeric.arrays import FloatArray, frozen
from collaudit.core.robot.robot_description import joint_order, joint_values

_WORST_CONDITION = 1e6


def at_joints(log: JointLog, config: RobotConfig, movable: Sequence[str]) -> JointLog:
    """The log with joint angles, velocities and torques in the description's zero; itself where nothing is stated.

    Args:
        log: as recorded, in SI units, under the robot's joint names.
        config: reduction and offsets.
        movable: the robot's joints in model order; empty without a description.

    Raises:
        ConfigError: reduction or offsets do not fit the joints of the log, or couple efforts of unknown units.
    """
    if config.reduction is None and config.joint_offset_rad is None:
        return log
    if config.reduction is not None:
        log = _reduced(log, reduction_matrix(config, log.joint_names, movable), config)
    if config.joint_offset_rad is None:
        return log
    offset = joint_values(config.joint_offset_rad, "joint_offset_rad", config, log.joint_names, movable, 0.0)
    return replace(log, position_rad=frozen(np.asfortranarray(log.position_rad + np.array(offset))))


def reduction_matrix(config: RobotConfig, joints: Sequence[str], movable: Sequence[str]) -> FloatArray:
    """R (j, j) of the joints of a log; q_motor = R q.

    Args:
        config: with a reduction.
        joints: of the log, in its order.
        movable: the robot's joints in model order; empty without a description.

    Raises:
        ConfigError: it does not fit the joints, a motor does not turn its own joint, or it cannot be inverted.
    """
    given = config.reduction
    assert given is not None
    rows = [row for row in given if isinstance(row, list)]
    if not rows:
        ratios: dict[str, float] | list[float]
        ratios = given if isinstance(given, dict) else [row for row in given if not isinstance(row, list)]
        matrix = np.diag(joint_values(ratios, "reduction", config, joints, movable, None))
    else:
        order = joint_order(len(rows), "reduction", config, joints, movable)
        if any(len(row) != len(rows) for row in rows):
            raise ConfigError(
                "the reduction matrix is not square",
                where="[robot] reduction",
                found=f"{len(rows)} rows of {', '.join(str(len(row)) for row in rows)} numbers",
                expected=f"{len(rows)} numbers in each row",
            )
        whole = np.array(rows, dtype=np.float64)
        pick = _picked(joints, order, whole)
        matrix = whole[np.ix_(pick, pick)]
    if np.any(np.diag(matrix) == 0.0):
        at = joints[int(np.flatnonzero(np.diag(matrix) == 0.0)[0])]
        raise ConfigError(f"the motor of joint '{at}' does not turn it: its reduction is 0", where="[robot] reduction")
    if not np.linalg.cond(matrix / np.abs(np.diag(matrix))[:, None]) < _WORST_CONDITION:
        raise ConfigError("the reduction matrix cannot be inverted", where="[robot] reduction")
    return np.asarray(matrix)


def _picked(joints: Sequence[str], order: Sequence[str], whole: FloatArray) -> list[int]:
    """Rows of the log's joints; a motor that also turns a joint which the log lacks tells nothing."""
    pick = [order.index(joint) for joint in joints if joint in order]
    if len(pick) < len(joints):
        raise ConfigError(
            "the reduction lacks joints of the log",
            where="[robot] reduction",
            found=", ".join(joint for joint in joints if joint not in order),
            expected=f"a row for each, in the order of [robot] joints ({', '.join(order)})",
        )
    others = [k for k in range(len(order)) if k not in pick]
    if np.any(whole[np.ix_(pick, others)]) or np.any(whole[np.ix_(others, pick)]):
        raise ConfigError(
            "the reduction couples joints that the log lacks",
            where="[robot] reduction",
            found=", ".join(order[k] for k in others),
            hint="record all motors of the coupled joints",
        )
    return pick


def _reduced(log: JointLog, matrix: FloatArray, config: RobotConfig) -> JointLog:
    """Position, velocity and effort at the joints, as far as they are the motors'."""
    coupled = bool(np.any(matrix - np.diag(np.diag(matrix))))
    side = set(config.motor_side)
    if coupled and log.effort_unit == "raw" and log.effort is not None and "effort" in side:
        raise ConfigError(
            "the reduction couples motors whose efforts are in an unknown unit: they cannot be added",
            where="[robot] reduction",
            hint='state the unit: [log.units] effort = "Nm", or "A" with torque_constant_nm_per_a of the motors',
        )
    inverse = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    inverse[np.abs(inverse) < 1e-12 * np.abs(np.diag(inverse))[:, None]] = 0.0
    findings = list(log.findings)
    position, velocity, effort = log.position_rad, log.velocity_rad_s, log.effort
    if "position" in side:
        whole = continued_angles(log)  # a motor's angle wraps many times a turn of its joint
        findings += [f for f in whole.findings if whole.position_rad is not position and f.severity == "info"]
        position = _times(whole.position_rad, inverse)
    if velocity is not None and "velocity" in side:
        velocity = _times(velocity, inverse)
    if effort is not None and "effort" in side:
        effort = _times(effort, matrix.T)
    ratios = ", ".join(f"{ratio:g}" for ratio in np.diag(matrix))
    text = (
        f"{', '.join(config.motor_side)} of the motors were brought to the joints by the stated reduction ({ratios})."
    )
    for i, j in zip(*np.nonzero(matrix - np.diag(np.diag(matrix))), strict=True):
        text += f" The motor of '{log.joint_names[i]}' also turns with '{log.joint_names[j]}' ({matrix[i, j]:g})."
    findings.append(fact(text[0].upper() + text[1:], where=log.source.name))
    return replace(
        log,
        position_rad=position,
        velocity_rad_s=velocity,
        effort=effort,
        findings=tuple(findings),
        couplings=_couplings(log.joint_names, matrix),
    )


def _couplings(names: Sequence[str], matrix: FloatArray) -> tuple[Coupling, ...]:
    """The motors that turn with more than their own joint."""
    found = []
    for i, row in enumerate(matrix):
        if np.count_nonzero(row) > 1:
            weights = {names[j]: float(row[j] / row[i]) for j in np.flatnonzero(row).tolist()}
            found.append(Coupling(names[i], weights))
    return tuple(found)


def _times(values: FloatArray, matrix: FloatArray) -> FloatArray:
    """(n, j) rows times the matrix's transpose; a missing value stays with the joints that it belongs to."""
    out = np.empty(values.shape, order="F")
    for j, row in enumerate(matrix):
        parts = np.flatnonzero(row)
        np.multiply(values[:, parts[0]], row[parts[0]], out=out[:, j])
        for k in parts[1:]:
            out[:, j] += row[k] * values[:, k]
    return frozen(out)
