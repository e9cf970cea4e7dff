"""Causes, each a few columns of torque beside the residual: what it would add, had it been left out of the model.

With the residual r = effort - model of eq. (5), a cause with parameters b explains the part X b of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from collaudit.core.causes.excess import Excess
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.robot_model import RobotModel


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """One cause to be tried.

    Attributes:
        kind: of the cause.
        joints: those that it is about; empty for the arm.
        columns_nm: (n, j, k) torque for one unit of each parameter.
        prior_sd: (k,) physical width of the parameters, which holds what the motion does not tell.
        fit_sd: (k,) standard errors of what a fit has wrong of the parameters. That is alike in all of a log, so its
            scatter does not show it.
        what: the name of what is tried, beside joints.
    """

    kind: str
    joints: tuple[str, ...]
    columns_nm: FloatArray
    prior_sd: FloatArray
    fit_sd: Sequence[float] = (0.0,)
    what: str = ""


def trials(
    table: Excess,
    robot: RobotModel,
    described: RobotModel,
    gravity: bool,
    load_sd: Sequence[float],
    siblings: Iterable[tuple[str, RobotModel]] = (),
) -> Iterator[Trial]:
    """Every cause, the simplest first.

    Args:
        table: what is left over.
        robot: as the log was judged with, its tool included.
        described: the same without what a fit found.
        gravity: whether the effort holds that of gravity.
        load_sd: (4,) how well a load is known against what the fit identified.
        siblings: other descriptions of the family, by name, on the same base and with the same tool.
    """
    yield Trial("friction", (), table.friction_nm[:, :, None], np.array([1.0]))
    yield Trial("scale", (), table.model_nm[:, :, None], np.array([2.0]))
    yield Trial("delay", (), -table.slope_nm_s[:, :, None], np.array([0.1]))
    alone: dict[str, list[Trial]] = {"friction": [], "scale": [], "zero": []}
    for j, joint in enumerate(table.joints):
        alone["friction"].append(Trial("friction", (joint,), only(table.friction_nm, j), np.array([1.0])))
        alone["scale"].append(Trial("scale", (joint,), only(table.model_nm, j), np.array([2.0])))
        alone["zero"].append(Trial("zero", (joint,), _zero(table, j), np.full(2, 1e3 * table.usual_nm[j])))
        yield from (trials_of[j] for trials_of in alone.values())
    for i, k in combinations(range(len(table.joints)), 2):
        swapped = np.zeros_like(table.model_nm)
        swapped[:, i] = table.model_nm[:, k] - table.model_nm[:, i]
        swapped[:, k] = table.model_nm[:, i] - table.model_nm[:, k]
        known = table.known[:, i] & table.known[:, k]
        yield Trial("swapped", (table.joints[i], table.joints[k]), (swapped * known[:, None])[:, :, None], np.ones(1))
    if gravity:
        yield Trial("mounting", (), _of(table, lambda q, *_: robot.gravity_regressor(q)), np.full(3, 10.0))
        load = _of(table, lambda *motion: load_torques(robot, motion))
        yield Trial("tool", (), load, np.array([20.0, 5.0, 5.0, 5.0]), load_sd)
        for name, sibling in siblings:
            other, own = (_of(table, _rigid(one)) for one in (sibling, described))
            yield Trial("description", (), other - own, np.ones(1), what=name)
    end = robot.tool_frame
    yield Trial("pull", (), _of(table, lambda q, *_: robot.torque_per_newton(q, end)), np.full(3, 500.0))
    for at, place in (((), end), *_places(table, robot)):
        columns = _of(table, lambda q, *_, place=place: robot.base_torque_per_newton(q, place))
        yield Trial("force", at, columns, np.full(3, 500.0))
    if len(table.joints) > 1:
        for kind, its in alone.items():
            columns = np.concatenate([one.columns_nm for one in its], axis=2)
            yield Trial(kind, table.joints, columns, np.concatenate([one.prior_sd for one in its]))


def _places(table: Excess, robot: RobotModel) -> list[tuple[tuple[str, ...], str]]:
    """The ends of the links before the last: the joint that moves each, and a frame."""
    ends = ((joint, frame) for joint in table.joints[:-1] for frame in {robot.link_of(joint), robot.outer_frame(joint)})
    return sorted(((joint,), frame) for joint, frame in ends if frame is not None)


def only(torque_nm: FloatArray, j: int) -> FloatArray:
    """(n, j, 1) of one joint."""
    out = np.zeros((*torque_nm.shape, 1))
    out[:, j, 0] = torque_nm[:, j]
    return out


def _zero(table: Excess, j: int) -> FloatArray:
    """(n, j, 2) a constant torque of one joint, and one that drifts over the log, each of one N·m."""
    out = np.zeros((*table.known.shape, 2))
    out[:, j, 0] = table.known[:, j]
    out[:, j, 1] = table.known[:, j] * np.linspace(-1.0, 1.0, table.time_s.size)
    return out


def _of(table: Excess, torque_of: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]) -> FloatArray:
    """(n, j, k) of the judged joints, by a function of position, velocity and acceleration (n, joints) without NaN."""
    moving = np.isfinite(np.hstack(table.motion)).all(axis=1)
    some = torque_of(*(np.ascontiguousarray(x[moving]) for x in table.motion))[:, table.columns]
    out = np.zeros((moving.size, *some.shape[1:]))
    out[moving] = some
    return out * table.known[:, :, None]


def _rigid(robot: RobotModel) -> Callable[[FloatArray, FloatArray, FloatArray], FloatArray]:
    """(n, j, 1) torque of rigid bodies, by a motion."""
    return lambda *motion: robot.inverse_dynamics(*motion)[:, :, None]


def load_torques(robot: RobotModel, motion: Sequence[FloatArray]) -> FloatArray:
    """(n, j, 4) torque of a body at the tool's frame: of a kg at its origin, and of kg·m along its axes.

    Its inertia about its own centre is left out: it hardly shows beside what a load weighs.

    Args:
        robot: with inertials.
        motion: position, velocity, acceleration, (n, j) each, without NaN.
    """
    turn, place, body = robot.in_joint(None)
    regressor = robot.torque_regressor(*(np.ascontiguousarray(x) for x in motion))
    mass, first = regressor[:, :, 10 * body], regressor[:, :, 10 * body + 1 : 10 * body + 4]
    return np.concatenate([(mass + first @ place)[:, :, None], first @ turn], axis=2)
