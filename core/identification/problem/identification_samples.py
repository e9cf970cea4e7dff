"""Samples of any motion for identification: filtered alike, thinned, with what the thinning costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.errors import ConfigError, NotJudgedError
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.filters import low_pass
from collaudit.core.prepare.effort.channel_shift import prompt_motion
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.prepare.reversal_travel import one_way

_CLUSTER_S = 1.0
#: Around a reversal or a start friction is not that of sliding, and the filter mixes before with after.
_SETTLED_S, _SETTLED_PERIODS = 0.05, 0.5
_MIN_SAMPLES = 200
_KNOT_S, _MOST_KNOTS = 30.0, 20  # of an offset that wanders
_STRETCH_S = 10.0  # of time held out in one piece, at least


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Samples for identification.

    Attributes:
        position, velocity, acceleration: (n, j).
        effort: (n, j) in the log's unit, low-passed as the motion was.
        contact: (n, j) torque of the commanded tool force, zero without a wrench.
        moving: (n, j) where a joint has moved one way for a while and will, and its effort is known.
        drift: (n, d) functions of time that an offset may follow.
        coupled: (c, j) weights of the joints in the speeds of axes that turn with several.
        cluster: (n,) stretch of one second that a sample belongs to; errors inside one are alike.
        block: (n,) block of time to be held out together.
        rate_hz: samples a second.
        loss: what the thinning costs, in words.
        load: (n, j) torque of the logs' known loads, also part of ``contact``.
        log: (n,) number of the log that a sample is of; row: (n,) its sample number there.
        bandwidth_hz: of the filter.
        regressor: (n, j, p) derivative of the torques by the inertial parameters; p = 0 where not asked for.
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    effort: FloatArray
    contact: FloatArray
    moving: BoolArray
    drift: FloatArray
    coupled: FloatArray
    cluster: IntArray
    block: IntArray
    rate_hz: float
    loss: str
    load: FloatArray
    log: IntArray
    row: IntArray
    bandwidth_hz: float
    regressor: FloatArray

    def with_effort_of(self, prepared: Sequence[Prepared]) -> Motion:
        """The same samples with the effort of the same logs, of which some may be unknown now: it does not count."""
        found = [_effort(log.series, self.bandwidth_hz)[self.row[self.log == k]] for k, log in enumerate(prepared)]
        effort = np.concatenate(found)
        moving = np.asarray(self.moving & np.isfinite(effort))
        return replace(self, effort=np.nan_to_num(effort), moving=moving)

    def at_most(self, most: int) -> Motion:
        """So many of them, evenly."""
        step, whole = max(1, -(-self.cluster.size // most)), ("coupled", "rate_hz", "loss", "bandwidth_hz")
        every = {field.name: getattr(self, field.name)[::step] for field in fields(self) if field.name not in whole}
        every["regressor"] = every["regressor"].copy()  # a view would keep all of it in memory
        return replace(self, **every, rate_hz=self.rate_hz / step)


def collect(prepared: Sequence[Prepared], max_samples: int, blocks: int, inertials: bool = True) -> Motion:
    """Gather valid samples of several logs of one arm.

    Args:
        prepared: the logs.
        max_samples: most of them.
        blocks: of time, to be held out.
        inertials: whether derivatives by the inertial parameters are asked for.

    Raises:
        ConfigError: the logs have different joints, or no effort. NotJudgedError: too little motion.
    """
    names = {p.series.joint_names for p in prepared}
    if len(names) > 1:
        raise ConfigError("logs of different joints cannot be identified together", found=str(sorted(names)))
    bandwidth = min(p.bandwidth_hz for p in prepared)
    moved = [_motion(p.series, bandwidth) for p in prepared]
    found = [_valid(p, bandwidth, *motion) for p, motion in zip(prepared, moved, strict=True)]
    total = sum(rows.size for rows, _ in found)
    if total < _MIN_SAMPLES:
        raise NotJudgedError(
            "there is too little motion to identify anything from",
            found=f"{total} usable samples",
            expected=f"at least {_MIN_SAMPLES}",
        )
    period = prepared[0].series.period_s
    step = max(1, -(-total // max_samples))
    parts = [
        _part(p, rows[::step], effort, bandwidth, *motion)
        for p, (rows, effort), motion in zip(prepared, found, moved, strict=True)
    ]
    columns: dict[str, Any] = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    clocks = [p.series.time_s[part["row"]] for p, part in zip(prepared, parts, strict=True)]
    cluster = np.concatenate([np.floor(t / _CLUSTER_S) + 1e7 * k for k, t in enumerate(clocks)])
    _, cluster = np.unique(cluster, return_inverse=True)
    order = np.arange(cluster.size)
    rate = 1.0 / (step * period)
    # long logs often move one joint after the other: a block is then made of several stretches of time
    rounds = int(np.clip(order.size / (rate * _STRETCH_S * blocks), 1, blocks))
    block = (order * blocks * rounds // max(1, order.size)) % blocks
    motion = [columns[name] for name in ("position", "velocity", "acceleration")]
    regressor = prepared[0].robot.torque_regressor(*motion) if inertials else np.zeros((*motion[0].shape, 0))
    return Motion(
        **columns,
        drift=_drift_columns(clocks),
        coupled=_coupled(prepared[0]),
        cluster=np.asarray(cluster, dtype=np.int64),
        block=np.asarray(block, dtype=np.int64),
        rate_hz=rate,
        loss=_loss(step, rate, bandwidth),
        log=np.repeat(np.arange(len(clocks), dtype=np.int64), [clock.size for clock in clocks]),
        bandwidth_hz=bandwidth,
        regressor=regressor,
    )


def _motion(series: UniformSeries, bandwidth_hz: float) -> tuple[FloatArray, FloatArray]:
    """(n, j) velocity and acceleration up to a bandwidth: noise of the acceleration biases what is multiplied by it."""
    v, a = prompt_motion(series)
    if bandwidth_hz >= series.bandwidth_hz:
        return v, a
    filters = series.segments, series.period_s, bandwidth_hz
    return low_pass(v, *filters), low_pass(a, *filters)


def _valid(prepared: Prepared, bandwidth_hz: float, v: FloatArray, a: FloatArray) -> tuple[IntArray, FloatArray]:
    """Rows at which the whole motion is known and settled, and the low-passed effort (n, j)."""
    series, effort = prepared.series, _effort(prepared.series, bandwidth_hz)
    known = np.isfinite(series.position_rad + v + a).all(axis=1)
    if prepared.contact_nm is not None:
        known &= np.isfinite(prepared.contact_nm).all(axis=1)
    moves = (np.abs(v) > MOVING_RAD_S).any(axis=1)
    return np.asarray(np.flatnonzero(known & moves & ~series.edge), dtype=np.int64), effort


def _effort(series: UniformSeries, bandwidth_hz: float) -> FloatArray:
    """(n, j) effort up to a bandwidth, in the log's unit."""
    if series.effort is None:
        raise ConfigError("nothing can be identified without effort", where=series.source.name)
    return low_pass(series.effort, series.segments, series.period_s, bandwidth_hz)


def _part(
    prepared: Prepared,
    rows: IntArray,
    effort: FloatArray,
    bandwidth_hz: float,
    velocity: FloatArray,
    acceleration: FloatArray,
) -> dict[str, FloatArray | BoolArray | IntArray]:
    """What there is of each sample, by the names of :class:`Motion`."""
    series = prepared.series
    q, v, a = (x[rows] for x in (series.position_rad, velocity, acceleration))
    contact = np.zeros_like(q) if prepared.contact_nm is None else prepared.contact_nm[rows]
    use = np.isfinite(effort[rows]) & ~series.saturated[rows]
    margin = round(max(_SETTLED_S, _SETTLED_PERIODS / bandwidth_hz) / series.period_s)
    for j in range(v.shape[1]):
        use[:, j] &= one_way(velocity[:, j], MOVING_RAD_S, margin)[rows]
    for weights in _coupled(prepared):  # where such an axis reverses, its friction is not that of sliding
        use[:, weights != 0] &= one_way(velocity @ weights, MOVING_RAD_S, margin)[rows, None]
    load = np.zeros_like(q) if prepared.start.load_nm is None else prepared.start.load_nm[rows]
    return {
        "position": q,
        "velocity": v,
        "acceleration": a,
        "effort": np.nan_to_num(effort[rows]),
        "contact": contact + load,
        "moving": use,
        "load": load,
        "row": rows,
    }


def _coupled(prepared: Prepared) -> FloatArray:
    """(c, j) weights of the joints in the axes that turn with several."""
    names = prepared.series.joint_names
    rows = [[c.weights.get(name, 0.0) for name in names] for c in prepared.series.couplings]
    return np.array(rows).reshape(len(rows), len(names))


def _loss(step: int, rate: float, bandwidth: float) -> str:
    if step == 1:
        return "every sample was used"
    kept = min(1.0, rate / (2.0 * bandwidth))
    text = f"one sample in {step} was used ({rate:.3g} a second); the signals are filtered at {bandwidth:.3g} Hz"
    if kept >= 1.0:
        return f"{text}, so that nothing is lost"
    return f"{text}, so that standard errors of what noise limits grow by up to {100 * (kept**-0.5 - 1):.0f} %"


def _drift_columns(times_s: Sequence[FloatArray]) -> FloatArray:
    """(n, d) hats about every half minute of each log, less their mean, so that the offset is the mean over time.

    Args:
        times_s: of each log, (n_k,) times of its samples, ascending.
    """
    parts = []
    for k, time in enumerate(times_s):
        # a log of less than half a minute has no drift: a trend would take what gravity does in the few poses it has
        count = min(int(float(time[-1] - time[0]) / _KNOT_S), _MOST_KNOTS) if time.size else 0
        knots = np.linspace(time[0], time[-1], count + 1) if time.size else np.array([0.0])
        # the first log lacks one hat: all hats together are the offset itself
        hats = [np.interp(time, knots, row) for row in np.eye(count + 1)[int(k == 0) :]]
        parts.append(np.array(hats).reshape(len(hats), time.size).T)
    out = block_diag(*parts)
    return np.asarray(out - out.mean(axis=0))
