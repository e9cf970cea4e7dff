"""Any motion of logs as sums of products by joint and block of time: every question of identification is asked of them.

The rows are filtered alike and thinned to what the filter leaves. A block's weight falls where nothing explains it:
contact, stops and faults that were not left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from collaudit.core.data.joint_log import MOVING_RAD_S, UniformSeries
from collaudit.core.errors import ConfigError, NotJudgedError
from collaudit.core.identification.torque_terms import (
    OFFSET,
    angle_columns,
    angles_seen,
    axis_columns,
    base_map,
    drift_columns,
    friction_columns,
)
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.filters import low_pass
from collaudit.core.prepare.channel_delay import prompt_motion
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.block_sums import BlockSums, block_weights, products_of
from collaudit.core.torque_table.log_samples import block_length_s, fold_count, one_way

#: Around a reversal or a start friction is not that of sliding, and the filter mixes before with after.
_SETTLED_S, _SETTLED_PERIODS = 0.05, 0.5
#: Rows at least and at most, and blocks of time, each a second or longer.
_MIN_ROWS, _MOST_ROWS = 200, 20_000
_MOST_BLOCKS, _BLOCK_S = 300, 1.0
#: Share of a part that is spared at either end.
_SPARED = 0.02
#: A joint that moves the other way for less than this share of the time moves one way.
_ONE_WAY = 0.01


@dataclass(frozen=True, eq=False)
class MotionSums:
    """Sums over the rows at which a joint slides one way, of all logs of a fit.

    Attributes:
        robot: the arm as described.
        parts: number of the first column of each part, in this order: ``one``; ``effort`` in the log's unit, low-passed
            as the motion was; ``model``, the torque that the description explains, tool force and known load included,
            N·m; ``spin``, the acceleration; ``load``, the torque of known loads, and its size against the motion;
            ``base``, derivatives by the inertial parameters ``first``; beside the rigid body ``law``, ``axes``,
            ``angle``, ``drift``; and ``end``.
        base: (d, p) combinations of inertial parameters that torques depend on.
        raw: (b, j, c, c) products; count: (b, j) rows.
        fold: (b,) part that a block is held out with; log: (b,) number of its log.
        start, stop: (b,) rows of the log, from the first to the last; period_s: from one to the next.
        one_way: (j,) joints of which the motion does not tell offset from friction.
        angles: of each joint, of :func:`angles_seen`.
        coupled: (x, j) weights of the joints in the speeds of axes that turn with several; axis_speeds: (x, 2) their
            usual least and largest one.
        rows: of all joints; rate_hz: a second; loss: what the thinning costs, in words.
    """

    robot: RobotModel
    parts: Mapping[str, int]
    base: FloatArray
    raw: FloatArray
    count: FloatArray
    fold: IntArray
    log: IntArray
    start: IntArray
    stop: IntArray
    period_s: float
    one_way: BoolArray
    angles: tuple[tuple[float, ...] | None, ...]
    coupled: FloatArray
    axis_speeds: FloatArray
    rows: int
    rate_hz: float
    loss: str

    def columns(self, part: str) -> slice:
        """Of one part."""
        names = list(self.parts)
        return slice(self.parts[part], self.parts[names[names.index(part) + 1]])

    @property
    def nuisance(self) -> slice:
        """Columns beside the rigid body."""
        return slice(self.parts["law"], self.parts["end"])

    @cached_property
    def weight(self) -> FloatArray:
        """(b, j) of the blocks: all columns together explain the effort but for contact, in its own unit."""
        out = np.ones(self.count.shape)
        pick = [*range(self.parts["model"], self.parts["end"]), self.parts["effort"]]
        for j in np.flatnonzero(self.count.any(axis=0)):
            own = [k for k in pick if self.raw[:, j, k, k].any()]
            out[:, j] = block_weights(self.raw[:, j, own][..., own], self.count[:, j])
        return out

    @property
    def products(self) -> FloatArray:
        """(b, j, c, c) weighted products."""
        return np.asarray(self.raw * self.weight[:, :, None, None])

    @cached_property
    def total(self) -> FloatArray:
        """(j, c, c) weighted products of all blocks."""
        return np.asarray(np.einsum("bj,bjmn->jmn", self.weight, self.raw))

    @cached_property
    def counted(self) -> FloatArray:
        """(j,) weighted rows."""
        return np.asarray(np.sum(self.weight * self.count, axis=0))

    @cached_property
    def level(self) -> tuple[FloatArray, FloatArray]:
        """(b, j, c) weighted sums of the columns over blocks, and (j, c, c) products with the weight squared."""
        again = np.einsum("bj,bjmn->jmn", self.weight**2, self.raw)
        return self.weight[:, :, None] * self.raw[:, :, 0], again

    def of_parts(self, part: IntArray) -> FloatArray:
        """(k, j, c, c) weighted products of the blocks of each part (b,), numbered from 0 on."""
        own = (part == np.arange(int(part.max()) + 1)[:, None])[:, :, None] * self.weight
        return np.array([np.einsum("bj,bjmn->jmn", weight, self.raw) for weight in own])

    def some(self, blocks: BoolArray) -> MotionSums:
        """Some of the blocks (b,), with the weights that those have among themselves."""
        own = {name: getattr(self, name)[blocks] for name in ("raw", "count", "fold", "log", "start", "stop")}
        return replace(self, **own)

    def without(self, left_out: Sequence[BoolArray]) -> MotionSums:
        """Those without samples (n,) that are left out of a log."""
        kept = np.zeros(self.log.size, dtype=np.bool_)
        for k, mask in enumerate(left_out):
            seen = np.concatenate([[0], np.cumsum(mask)])
            own = self.log == k
            kept[own] = seen[self.stop[own] + 1] == seen[self.start[own]]
        return self.some(kept)

    def only(self, joints: BoolArray) -> MotionSums:
        """Without the rows of the other joints (j,)."""
        return replace(self, raw=self.raw * joints[:, None, None], count=self.count * joints)

    def together(self, length_s: float) -> IntArray:
        """(b,) number of the stretch of time of a block, in each of which so long."""
        stretch = np.floor(self.start * self.period_s / length_s).astype(np.int64)
        return np.asarray(np.unique(stretch + 10**9 * self.log, return_inverse=True)[1])

    def of(self, j: int, *parts: str) -> BlockSums:
        """Some columns of one joint, by the name of the part and the number in it."""
        found = {f"{part} {k}": at for part in parts for k, at in enumerate(range(*self.columns(part).indices(10**6)))}
        pick = [0, *found.values()]
        return BlockSums(("one", *found), self.raw[:, j, pick][..., pick], self.count[:, j])


def gathered(prepared: Sequence[Prepared], folds: int) -> MotionSums | None:
    """As :func:`collect` does; None where inertials, efforts or motion are not known."""
    if any(not log.robot.has_inertials or log.series.effort is None for log in prepared):
        return None
    try:
        return collect(prepared, folds)
    except (NotJudgedError, ConfigError):
        return None


def collect(prepared: Sequence[Prepared], folds: int, inertials: bool = True) -> MotionSums:
    """Gather the motion of several logs of one arm.

    Args:
        prepared: the logs.
        folds: at most so many parts are held out.
        inertials: whether derivatives by the inertial parameters are asked for.

    Raises:
        ConfigError: the logs have different joints, or no effort. NotJudgedError: too little motion.
    """
    names = {p.series.joint_names for p in prepared}
    if len(names) > 1:
        raise ConfigError("logs of different joints cannot be identified together", found=str(sorted(names)))
    bandwidth, period = min(p.bandwidth_hz for p in prepared), prepared[0].series.period_s
    coupled, count = _coupled(prepared[0]), fold_count([p.series for p in prepared], folds)
    total_s = sum(float(np.ptp(p.series.time_s)) for p in prepared)
    found = [_rows(p, bandwidth, coupled, count, max(_BLOCK_S, total_s / _MOST_BLOCKS)) for p in prepared]
    total = sum(part["row"].size for part in found)
    if total < _MIN_ROWS:
        raise NotJudgedError(
            "there is too little motion to identify anything from",
            found=f"{total} usable samples",
            expected=f"at least {_MIN_ROWS}",
        )
    step = max(1, int(0.5 / (bandwidth * period)), -(-total // _MOST_ROWS))
    found = [{name: values[::step] for name, values in part.items()} for part in found]
    rows = {name: np.concatenate([part[name] for part in found]) for name in found[0]}
    log = np.repeat(np.arange(len(found)), [part["row"].size for part in found])
    starts = np.flatnonzero(np.diff(log, prepend=-1) | np.diff(rows["block"], prepend=-1))
    block = np.repeat(np.arange(starts.size), np.diff(starts, append=log.size))
    robot, motion = prepared[0].robot, (rows["position"], rows["velocity"], rows["acceleration"])
    model, base = rows["known"], base_map(robot, robot.inertial_bodies().joint_names) if inertials else None
    if robot.has_inertials:
        model = model + robot.inverse_dynamics(*motion)
    by_base = np.zeros((log.size, model.shape[1], 0))
    if base is not None:
        by_base = np.ascontiguousarray(robot.torque_regressor(*motion)[:, :, base.first])
    moving, drift, axes = rows["moving"], drift_columns([part["time"] for part in found]), _axes(motion, coupled)
    steady = np.array([_turns_seldom(v[its]) for v, its in zip(motion[1].T, moving.T, strict=True)])
    raw, parts = [], dict[str, int]()
    for j, (q, v, a, use) in enumerate(zip(*(x.T for x in motion), moving.T, strict=True)):
        law, load = friction_columns(v, a), rows["load"][:, j]
        law[:, [OFFSET, OFFSET + 1]] *= not steady[j]
        its = {
            "one": np.ones_like(v), "effort": rows["effort"][:, j], "model": model[:, j], "spin": a,
            "load": np.column_stack([load, np.sign(v) * np.abs(load)]), "base": by_base[:, j], "law": law,
            "axes": axes * np.repeat(coupled[:, j] != 0.0, 3), "angle": angle_columns(q, use), "drift": drift,
        }  # fmt: skip
        columns = np.column_stack(list(its.values()))
        raw.append(products_of((columns * use[:, None])[:, None], block)[:, 0])
        widths = [x.shape[1] if x.ndim > 1 else 1 for x in its.values()]
        parts = dict(zip([*its, "end"], np.cumsum([0, *widths]).tolist(), strict=True))
    rate = 1.0 / (step * period)
    raw_products = np.stack(raw, axis=1)
    return MotionSums(
        robot=robot,
        parts=parts,
        base=np.zeros((0, 0)) if base is None else base.matrix,
        raw=raw_products,
        count=raw_products[:, :, 0, 0].copy(),
        fold=rows["fold"][starts],
        log=log[starts],
        start=rows["row"][starts],
        stop=rows["row"][np.append(starts[1:], log.size) - 1],
        period_s=period,
        one_way=steady,
        angles=tuple(angles_seen(q, use) for q, use in zip(motion[0].T, moving.T, strict=True)),
        coupled=coupled,
        axis_speeds=_axis_speeds(motion[1], coupled, moving),
        rows=log.size,
        rate_hz=rate,
        loss=_loss(step, rate, bandwidth),
    )


def _rows(prepared: Prepared, bandwidth_hz: float, coupled: FloatArray, folds: int, block_s: float) -> dict[str, Any]:
    """What there is of each row at which the whole motion is known and settled, by name."""
    series, contact, load = prepared.series, prepared.contact_nm, prepared.start.load_nm
    if series.effort is None:
        raise ConfigError("nothing can be identified without effort", where=series.source.name)
    v, a = _motion(series, bandwidth_hz)
    known = np.isfinite(series.position_rad + v + a).all(axis=1) & (np.abs(v) > MOVING_RAD_S).any(axis=1)
    if contact is not None:
        known &= np.isfinite(contact).all(axis=1)
    rows = np.flatnonzero(known & ~series.edge)
    effort = low_pass(series.effort, series.segments, series.period_s, bandwidth_hz)[rows]
    use = np.isfinite(effort) & ~series.saturated[rows]
    settled_s = max(_SETTLED_S, _SETTLED_PERIODS / bandwidth_hz)
    margin = round(settled_s / series.period_s)
    for j in range(v.shape[1]):
        use[:, j] &= one_way(v[:, j], MOVING_RAD_S, margin)[rows]
    for weights in coupled:  # where such an axis reverses, its friction is not that of sliding
        use[:, weights != 0] &= one_way(v @ weights, MOVING_RAD_S, margin)[rows, None]
    none = np.zeros_like(effort)
    carried = none if load is None else load[rows]
    held_s, time = block_length_s(series, folds), series.time_s[rows] - series.time_s[0]
    each, held = max(1, round(held_s / block_s)), np.floor(time / held_s).astype(np.int64)
    # the next part may be held out, and the filter mixes it in; of a short log's short parts little can be spared
    use &= (np.abs(time / held_s - held - 0.5) < 0.5 - min(settled_s / held_s, _SPARED))[:, None]
    return {
        "position": series.position_rad[rows], "velocity": v[rows], "acceleration": a[rows],
        "effort": np.nan_to_num(effort), "known": carried + (none if contact is None else contact[rows]),
        "load": carried, "moving": use, "row": rows, "time": series.time_s[rows], "fold": held % folds,
        "block": each * held + np.minimum((time / held_s - held) * each, each - 1).astype(np.int64),
    }  # fmt: skip


def _motion(series: UniformSeries, bandwidth_hz: float) -> tuple[FloatArray, FloatArray]:
    """(n, j) velocity and acceleration up to a bandwidth: noise of the acceleration biases what is multiplied by it."""
    v, a = prompt_motion(series)
    if bandwidth_hz >= series.bandwidth_hz:
        return v, a
    filters = series.segments, series.period_s, bandwidth_hz
    return low_pass(v, *filters), low_pass(a, *filters)


def _coupled(prepared: Prepared) -> FloatArray:
    """(x, j) weights of the joints in the axes that turn with several."""
    names = prepared.series.joint_names
    rows = [[c.weights.get(name, 0.0) for name in names] for c in prepared.series.couplings]
    return np.array(rows).reshape(len(rows), len(names))


def _axes(motion: tuple[FloatArray, ...], coupled: FloatArray) -> FloatArray:
    """(n, 3 x) columns of all axes that turn with several joints."""
    return np.column_stack([motion[0][:, :0], *(axis_columns(motion[1], motion[2], weights) for weights in coupled)])


def _axis_speeds(velocity: FloatArray, coupled: FloatArray, moving: BoolArray) -> FloatArray:
    """(x, 2) speed of each axis that only 1 % are below, and the largest, where its joints count."""
    out = np.zeros((len(coupled), 2))
    for c, weights in enumerate(coupled):
        s = np.abs(velocity @ weights)[moving[:, weights != 0].any(axis=1)]
        out[c] = np.quantile(s, [0.01, 1.0]) if s.size else 0.0
    return out


def _turns_seldom(velocity: FloatArray) -> bool:
    ahead = np.count_nonzero(velocity > 0)
    return bool(min(ahead, velocity.size - ahead) < _ONE_WAY * velocity.size)


def _loss(step: int, rate: float, bandwidth: float) -> str:
    if step == 1:
        return "every sample was used"
    kept = min(1.0, rate / (2.0 * bandwidth))
    text = f"one sample in {step} was used ({rate:.3g} a second); the signals are filtered at {bandwidth:.3g} Hz"
    if kept >= 1.0:
        return f"{text}, so that nothing is lost"
    return f"{text}, so that standard errors of what noise limits grow by up to {100 * (kept**-0.5 - 1):.0f} %"
