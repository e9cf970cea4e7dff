"""The level a residual has to exceed: gamma, constant or dynamic, raised by what is uncertain about friction.

Dynamic: gamma(t) = g0 + g1 |v| + g2 |a|, learnt from clean data by quantile regression in its simplest form. The
errors of a model grow with speed (friction, Coriolis terms) and acceleration (inertia), so a constant that is safe
while moving fast is blind while moving slowly.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy

from collaudit.core.config.schema import DetectConfig
from collaudit.core.data.audit_result import RuleFacts
from collaudit.core.data.detection_result import DynamicThreshold
from collaudit.core.data.signals import State
from collaudit.core.data.threshold_result import MotionScale
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.sliding_extremes import whole_window_minima
from collaudit.core.residual.residual import Residual

_MARGIN = 1.3
_LEAST_SAMPLES = 1000
_RIDGE = 1e-12
#: The base is never taken below this share of the mean residual: a joint at rest is noisy too.
_LEAST_BASE = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class Threshold:
    """The level of each joint plus the residual's own uncertainty, computed where it is asked for.

    Attributes:
        series: the judged joints.
        residual: its uncertainty is added, and its kernel is what the threshold passes as well.
        rule: constant thresholds.
        config: dynamic coefficients, if any.
    """

    series: UniformSeries
    residual: Residual
    rule: RuleFacts
    config: DetectConfig
    _kept: dict[int, FloatArray] = field(default_factory=dict)

    def of(self, j: int, part: slice | IntArray = slice(None)) -> FloatArray:
        """(n,) N·m of one joint, or of a part of its samples; NaN without one."""
        joint = self.series.joint_names[j]
        constant = joint not in self.rule.follows and self.config.gamma_nm != "dynamic"
        level = self.rule.gamma_nm.get(joint, np.nan) if constant else self._moving(j, joint)[part]
        level = np.asarray(self.residual.uncertainty_nm[:, j][part] + level)
        if extra := self.rule.at_rest_nm.get(joint, 0.0):
            level = np.where(self.residual.state[:, j][part] == State.FRICTION_INTERVAL, level + extra, level)
        return level

    def _moving(self, j: int, joint: str) -> FloatArray:
        """(n,) threshold of a joint that follows the motion, through the residual's kernel."""
        if j not in self._kept:
            balance, series = self.residual.balance, self.series
            scale, law = self.rule.follows.get(joint), self.config.dynamic.get(joint)
            if scale is not None:
                relative = relative_scale(scale, series.velocity_rad_s, j, series.period_s)
                level = self.rule.gamma_nm[joint] * relative
            elif law is None:
                level = np.full(series.time_s.size, self.rule.gamma_nm.get(joint, np.nan))
            else:
                level = dynamic_level(
                    DynamicThreshold(law.base_nm, law.speed_nm_s_per_rad, law.acceleration_nm_s2_per_rad),
                    balance.velocity_rad_s[:, j],
                    series.acceleration_rad_s2[:, j],
                )
            self._kept[j] = balance.kernel.apply(level[:, None], series.segments, series.period_s)[:, 0]
        return self._kept[j]

    def all_joints(self) -> FloatArray:
        """(n, j) N·m."""
        out = np.empty(self.residual.uncertainty_nm.shape, order="F")
        for j in range(len(self.series.joint_names)):
            out[:, j] = self.of(j)
        return out


def dynamic_level(law: DynamicThreshold, velocity: FloatArray, acceleration: FloatArray) -> FloatArray:
    """base + speed·|v| + acceleration·|a|, N·m, for (n,) motions."""
    return np.asarray(
        law.base_nm + law.speed_nm_s_per_rad * np.abs(velocity) + law.acceleration_nm_s2_per_rad * np.abs(acceleration)
    )


def learn_dynamic_thresholds(
    series: UniformSeries, residual: Residual, clean: Mapping[str, BoolArray], n: int
) -> dict[str, DynamicThreshold | None]:
    """Dynamic thresholds of the joints whose clean samples (n,) are given, at a persistence of ``n`` samples."""

    def learnt(joint: str) -> DynamicThreshold | None:
        j = series.column(joint)
        motion = (series.velocity_rad_s[:, j], series.acceleration_rad_s2[:, j])
        return learn_dynamic(residual.torque_nm[:, j], *motion, clean[joint], n)

    return by_name(learnt, [joint for joint in series.joint_names if joint in clean])


def learn_dynamic(
    residual: FloatArray, velocity: FloatArray, acceleration: FloatArray, clean: BoolArray, n: int
) -> DynamicThreshold | None:
    """Learn one joint's dynamic threshold from clean data.

    The shape is the non-negative least-squares fit of |residual| on (1, |v|, |a|); it is scaled to 1.3 times what
    the largest residual that lasted n samples asks for, so that rule (6) never fires on the data it was learnt from.

    Args:
        residual: (n,) of one joint.
        velocity, acceleration: (n,) of the joint, rad/s and rad/s².
        clean: (n,) judged samples away from collisions.
        n: persistence, samples.

    Returns:
        None with fewer than 1,000 clean samples, or where the residual of all is zero.
    """
    use = clean & np.isfinite(residual) & np.isfinite(velocity) & np.isfinite(acceleration)
    level = np.abs(residual[use])
    if level.size < _LEAST_SAMPLES:
        return None
    columns = np.column_stack([np.ones(level.size), np.abs(velocity[use]), np.abs(acceleration[use])])
    shape = dynamic_shape(level, columns)
    if not shape[0] > 0.0:  # every residual is zero
        return None
    lasting = whole_window_minima(np.where(use, np.abs(residual), 0.0), n)
    scale = _MARGIN * max(1.0, float(np.max(lasting[use] / (columns @ shape))))
    return DynamicThreshold(*(float(scale * x) for x in shape))


def dynamic_shape(size_nm: FloatArray, columns: FloatArray) -> FloatArray:
    """(3,) non-negative least-squares fit of |residual| (n,) on columns (n, 3) of 1, |v| and |a|."""
    shape = non_negative_fit(columns, size_nm)
    shape[0] = max(shape[0], _LEAST_BASE * float(np.mean(size_nm)))
    return np.asarray(shape)


def non_negative_fit(columns: FloatArray, target: FloatArray) -> FloatArray:
    """(k,) non-negative least-squares fit of columns (n, k) to (n,), of very many rows: by their normal equations."""
    gram = columns.T @ columns
    root = np.linalg.cholesky(gram + _RIDGE * np.trace(gram) * np.eye(len(gram)))  # the same minimum from k rows
    right: FloatArray = np.asarray(np.linalg.solve(root, columns.T @ target), dtype=np.float64)
    return np.asarray(scipy.optimize.nnls(root.T, right)[0])


def pooled_dynamic(laws: Sequence[DynamicThreshold | None]) -> DynamicThreshold | None:
    """One law of a joint that is at least as high as each of its runs', at any motion; None without any."""
    known = [law for law in laws if law is not None]
    if not known:
        return None
    return DynamicThreshold(
        max(law.base_nm for law in known),
        max(law.speed_nm_s_per_rad for law in known),
        max(law.acceleration_nm_s2_per_rad for law in known),
    )


#: The scale is at least this share of the usual one.
LEAST_SHARE = 0.3
#: Time over which acceleration is averaged, s: longer than a contact moves it.
_AVERAGED_S = 1.0
#: Below this speed friction depends on it most: Stribeck velocities of gears lie there, rad/s (m/s if prismatic).
_SLOW_RAD_S = 0.1


def motion_features(velocity: FloatArray, j: int, period_s: float) -> FloatArray:
    """(n, 5) one, closeness to rest, speed, the norm over the joints, and the mean |acceleration| of the second around.

    Args:
        velocity: (n, j) of the joints, rad/s; unknown values count as rest.
        j: the joint's column.
        period_s: sample period, s.
    """
    known = np.nan_to_num(velocity)
    own = known[:, j]
    width = max(1, round(_AVERAGED_S / period_s))
    # the mean of |a| over a window is the way that the velocity makes in it
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(own, prepend=own[:1])))])
    at = np.arange(own.size)
    first, last = np.maximum(at - width // 2, 0), np.minimum(at + width // 2 + 1, own.size)
    turn = (way[last] - way[first]) / ((last - first) * period_s)
    speed = np.abs(own)
    slow = np.maximum(1.0 - speed / _SLOW_RAD_S, 0.0)
    return np.column_stack([np.ones(own.size), slow, speed, np.linalg.norm(known, axis=1), turn])


def scale_over(scale: MotionScale, features: FloatArray) -> FloatArray:
    """(n,) standard deviation at motions with these features (n, 5), N·m."""
    weights = (
        scale.base_nm,
        scale.slow_nm,
        scale.speed_nm_s_per_rad,
        scale.arm_speed_nm_s_per_rad,
        scale.acceleration_nm_s2_per_rad,
    )
    return np.asarray(np.maximum(features @ np.array(weights), LEAST_SHARE * scale.usual_nm))


def relative_scale(scale: MotionScale, velocity: FloatArray, j: int, period_s: float) -> FloatArray:
    """(n,) scale of a joint's residual over the usual one; arguments as of :func:`motion_features`."""
    return scale_over(scale, motion_features(velocity, j, period_s)) / scale.usual_nm
