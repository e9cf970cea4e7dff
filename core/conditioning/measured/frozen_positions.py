"""Positions that stand still while the joint moves: by its velocity, or by the jump that ends them."""

from __future__ import annotations

from math import ceil

import numpy as np

from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.uniform_series import MOVING_RAD_S
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.runs import run_bounds
from collaudit.core.numeric.stats import quantile_of

#: A position that repeats for less than this, or for fewer samples, is not frozen.
_LEAST_S, _LEAST = 0.05, 8
#: No joint of an arm brakes harder, rad/s².
_BRAKE_RAD_S2 = 200.0
#: A frozen position catches up by more than so many times its usual step, and than so many steps of its encoder.
_CATCHES_UP, _STEPS = 5.0, 2.5


def frozen_spans(recorded: JointLog, j: int, period: float) -> list[tuple[int, int]]:
    """Rows (start, stop) in which a joint's position repeats the row before although the joint moves.

    Args:
        recorded: the log.
        j: column.
        period: s.
    """
    q = np.ascontiguousarray(recorded.position_rad[:, j])
    same = np.zeros(q.size, dtype=np.bool_)
    np.equal(q[1:], q[:-1], out=same[1:])
    least = max(_LEAST, ceil(_LEAST_S / period))
    starts, stops = run_bounds(same)
    long = stops - starts >= least
    if not long.any():
        return []
    step = _encoder_step(q)
    velocity = None if recorded.velocity_rad_s is None else recorded.velocity_rad_s[:, j]
    found = []
    for a, b in zip(starts[long].tolist(), stops[long].tolist(), strict=True):
        if velocity is not None and np.isfinite(velocity[a:b]).any():
            inside = np.nan_to_num(velocity[a:b])
            if abs(float(np.sum(inside))) * period <= MOVING_RAD_S * (b - a) * period:
                continue
        if _jumps(q, a, b, period, step):
            found.append((a, b))
    return found


def _encoder_step(q: FloatArray) -> float:
    """The smaller steps of a position, which a slow joint makes one at a time."""
    steps = np.abs(np.diff(q))
    steps = steps[np.isfinite(steps) & (steps > 0.0)]
    return quantile_of(steps, 0.05) if steps.size else 0.0


def _jumps(q: FloatArray, a: int, b: int, period: float, step: float) -> bool:
    """Whether the joint came in at speed, and its position catches up at once after the stretch, or it never ends.

    A logged velocity that lags behind, a joint that stops at once, and the steps of an encoder do not look like this.
    """
    before = float(np.nanmedian(np.diff(q[max(a - 6, 0) : a]))) / period if a >= 3 else 0.0
    if b >= q.size:
        return abs(before) / period > _BRAKE_RAD_S2 and abs(before) > MOVING_RAD_S
    leap = float(q[b] - q[b - 1])
    after = float(np.nanmedian(np.abs(np.diff(q[b : b + 6])))) if b + 2 < q.size else 0.0
    fair = max(after, abs(before) * period)
    return abs(leap) > max(_CATCHES_UP * fair, _STEPS * step) and abs(leap) > MOVING_RAD_S * (b - a) * period
