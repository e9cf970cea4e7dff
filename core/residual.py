"""The residual of eq. (5): measured torque less rigid-body dynamics, friction and the meant tool force."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import DetectConfig
from collaudit.core.friction.model import FrictionModel
from collaudit.core.series import BoolArray, FloatArray, UniformSeries
from collaudit.core.signals import State

#: Friction is trusted this far beyond the fastest speed it was measured at.
_BEYOND_RANGE = 1.05


@dataclass(frozen=True, slots=True, eq=False)
class Residual:
    """Estimate of external joint torque.

    Attributes:
        torque_nm: (n, j) residual; in state FRICTION_INTERVAL only what no friction within its interval
            explains; NaN where unknown.
        model_nm: (n, j) rigid-body + friction + contact torque that was compared with.
        state: (n, j) codes of :class:`State`.
    """

    torque_nm: FloatArray
    model_nm: FloatArray
    state: NDArray[np.int8]


def compute_residual(
    series: UniformSeries,
    rigid_nm: FloatArray | None,
    contact_nm: FloatArray | None,
    friction: Mapping[str, FrictionModel],
    contradicted: frozenset[str],
    config: DetectConfig,
) -> Residual:
    """Eq. (5) per joint: tau - tau_s - (M·ddq + C·dq + G + f(dq)).

    While a joint rests, or has travelled less than ``reversal_travel_rad`` since it rested or reversed, its
    friction can be anything up to breakaway. There the residual is the distance of the unexplained torque
    from that interval: nonzero is evidence, zero is not a clean bill.

    Args:
        series: the log on its uniform time base; effort in N·m.
        rigid_nm: (n, j) rigid-body torque, None without inertials.
        contact_nm: (n, j) J^T F of the meant tool force, or None without a wrench.
        friction: fitted laws by joint.
        contradicted: joints whose effort contradicts the model (inverted): not judged.
        config: speed and travel below which friction is an interval.
    """
    n, count = series.position_rad.shape
    state = np.full((n, count), State.JUDGED, dtype=np.int8)
    torque = np.full((n, count), np.nan)
    model = np.full((n, count), np.nan)
    usable = rigid_nm is not None and series.effort is not None and series.effort_unit == "Nm"
    for j, joint in enumerate(series.joint_names):
        law = friction.get(joint)
        if usable and law is not None:
            assert series.effort is not None
            assert rigid_nm is not None
            known = rigid_nm[:, j] if contact_nm is None else rigid_nm[:, j] + contact_nm[:, j]
            torque[:, j], model[:, j], state[:, j] = _one_joint(
                series, j, series.effort[:, j] - known, known, law, config
            )
        else:
            state[:, j] = State.NO_MODEL if not usable else State.NO_FRICTION
        if joint in contradicted:
            state[:, j] = State.NO_MODEL
    _mark(state, torque, series, usable)
    return Residual(torque, model, state)


def _one_joint(
    series: UniformSeries, j: int, unexplained: FloatArray, known: FloatArray, law: FrictionModel, config: DetectConfig
) -> tuple[FloatArray, FloatArray, NDArray[np.int8]]:
    """Residual, model torque and state of one joint with a friction law."""
    velocity = series.velocity_rad_s[:, j]
    speed = np.abs(velocity)
    sliding = law.torque(velocity)
    slow = config.slow_speed_rad_s or law.speed_range[0]
    undecided = _undecided(series, j, speed < slow, config.reversal_travel_rad)
    hold = np.maximum(law.hold, np.abs(sliding))
    beyond = np.sign(unexplained) * np.maximum(np.abs(unexplained) - hold, 0.0)
    residual = np.where(undecided, beyond, unexplained - sliding)
    state = np.where(undecided, State.FRICTION_INTERVAL, State.JUDGED).astype(np.int8)
    state[speed > _BEYOND_RANGE * law.speed_range[1]] = State.TOO_FAST
    effort = unexplained + known
    return residual, np.asarray(effort - residual), state


def _undecided(series: UniformSeries, j: int, slow: BoolArray, travel_rad: float) -> BoolArray:
    """Samples at rest, and those within a short travel after it (or after the start of a stretch)."""
    out = slow.copy()
    for segment in series.segments:
        position = series.position_rad[segment.slice, j]
        rest = slow[segment.slice].copy()
        rest[0] = True
        step = np.abs(np.diff(position, prepend=position[0]))
        travelled = np.cumsum(np.nan_to_num(step))
        last_rest = np.maximum.accumulate(np.where(rest, np.arange(rest.size), 0))
        out[segment.slice] = rest | (travelled - travelled[last_rest] < travel_rad)
    return out


def _mark(state: NDArray[np.int8], torque: FloatArray, series: UniformSeries, usable: bool) -> None:
    """Put the reasons that hold for any joint on top of the others (the larger code wins)."""
    recorded = np.zeros(state.shape[0], dtype=bool)
    for segment in series.segments:
        recorded[segment.slice] = True

    def raise_to(where: BoolArray, code: State) -> None:
        state[where] = np.maximum(state[where], code)

    raise_to(series.edge[:, None] & np.ones_like(state, dtype=bool), State.EDGE)
    if usable:
        has_law = state < State.NO_FRICTION
        raise_to(~np.isfinite(torque) & has_law, State.NOT_A_NUMBER)
    raise_to(np.asarray(series.saturated), State.SATURATED)
    raise_to(~recorded[:, None] & np.ones_like(state, dtype=bool), State.GAP)
