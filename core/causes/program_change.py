"""What changed in a program between two logs: path, speed, load, friction, residual, each with its interval.

Both logs are laid on the earlier one's path. At each place the measured torque, less the model's at each log's own
motion, is compared; what a load at the tool, friction of a joint and the zeros of the torques explain of the difference
is solved together, cycle by cycle. Cycles next to each other share what drifts: intervals are those of blocks of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.special import stdtrit as student_quantile

from collaudit.core.causes.trials import load_torques
from collaudit.core.cycles.cycle_search import DrawnPath, resampled
from collaudit.core.cycles.path_place import (
    CyclePath,
    along,
    along_path_speeds,
    median_and_spread,
    placed,
    usual_path,
)
from collaudit.core.data.audit_result import Audit
from collaudit.core.data.signals import LEAST_CHANGE, ChangedQuantity, ProgramChange, ProgramComparison, Signals, State
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span, equal_runs
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.block_sums import estimate, rows_of_blocks

#: Cycles of a log that are compared at most, evenly over it; blocks of them, and the fewest cycles that make blocks.
_MOST_CYCLES, _BLOCKS, _FEWEST = 60, 8, 4
#: Stretches of the path.
_STRETCHES = 20
#: Torques are not compared where the tool passes so far aside, mm: errors of the model are others there.
_ELSEWHERE_MM = 0.2
#: Widths of what is solved for: kg at the origin of the tool's frame, share of friction, N·m of a zero
#: from log to log.
_LOAD_SD, _SHARE_SD, _ZERO_SD = (20.0, 0.02, 0.02, 0.02), 1.0, 0.3
#: Torques of a place are compared where it is judged in more than this share of the cycles of both logs, and passed at
#: more than this share of the usual speed.
_NEARLY_ALL, _PACE = 0.8, 0.3
#: The path's slopes are those of so many places; so many at either end have none on one side.
_SMOOTH, _ENDS = 5, 10


@dataclass(frozen=True, slots=True, eq=False)
class _Side:
    """One log on the path: cycles c, places p, joints j.

    Attributes:
        position_rad: (c, p, j).
        torque_nm: (c, p, j) measured; NaN where it was not judged with friction of one value.
        speed: (c, p) places a second.
    """

    position_rad: FloatArray
    torque_nm: FloatArray
    speed: FloatArray

    @classmethod
    def of(cls, signals: Signals, drawn: DrawnPath, spans: Sequence[Span], path: CyclePath) -> _Side:
        chosen = np.linspace(0, len(spans) - 1, min(len(spans), _MOST_CYCLES)).astype(np.int64)
        on_path = placed(drawn, [spans[k] for k in chosen], path)
        torque = np.where(signals.state == State.JUDGED, signals.measured_nm, np.nan)
        table = on_path.at_places(
            np.column_stack([signals.position_rad, torque, along_path_speeds(on_path, drawn.motion)])
        )
        position, torque = np.split(table[:, :, :-1], 2, axis=2)
        return cls(position, torque, table[:, :, -1])

    @property
    def motion(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position, velocity and acceleration (p, j) of the usual cycle."""
        every = np.concatenate([self.position_rad, self.speed[:, :, None]], axis=2)
        places, usual = np.arange(every.shape[1], dtype=np.float64), median_and_spread(every, 1)[0]
        known = np.isfinite(usual).all(
            axis=1
        )  # of other places what lies between: a filter would spread what is missing
        usual = resampled(places, places[known], usual[known])
        position, speed = usual[:, :-1], usual[:, -1:]
        velocity = uniform_filter1d(np.gradient(position, axis=0), _SMOOTH, axis=0) * speed
        return position, velocity, uniform_filter1d(np.gradient(velocity, axis=0), _SMOOTH, axis=0) * speed

    @property
    def fast(self) -> BoolArray:
        """(p,) places passed fast: near rest, and at the ends of the path, the same place is less well known."""
        pace = np.linalg.norm(self.motion[1], axis=1)
        fast = pace > _PACE * np.median(pace)
        fast[:_ENDS] = fast[-_ENDS:] = False
        return np.asarray(fast)


def compare_programs(old: Audit, new: Audit, robot: RobotModel) -> ProgramComparison:
    """The same program in two logs.

    Args:
        old, new: the earlier and the later log, as judged.
        robot: in their joints, as stated now.
    """
    names = new.result.log.name, old.result.log.name
    drawn = [DrawnPath.of(audit.signals) for audit in (old, new)]
    cycles = old.signals.cycles
    if old.signals.joint_names != new.signals.joint_names or cycles is None:
        return ProgramComparison(
            *names,
            (0, 0),
            reason="nothing repeats in the earlier log" if cycles is None else "the earlier log has other joints",
        )
    starts, stops = equal_runs(cycles.number)
    spans = [Span(int(a), int(b)) for a, b in zip(starts, stops, strict=True) if cycles.number[a] >= 0]
    path = usual_path(drawn[0], spans)
    found = [spans, along(drawn[1], path)]
    counts = len(spans), len(found[1])
    if min(counts) < _FEWEST:
        return ProgramComparison(
            *names,
            counts,
            reason=f"the later log goes along the path of the earlier one {counts[1]} times; "
            f"{_FEWEST} are needed of each",
        )
    before, after = (
        _Side.of(audit.signals, its, own, path) for audit, its, own in zip((old, new), drawn, found, strict=True)
    )
    changes, elsewhere = _path(before, after, path, robot)
    changes += _speed(before, after)
    if robot.has_inertials and robot.joint_names == new.signals.joint_names:
        laws = {joint: law for joint, fit in new.result.friction.items() if (law := FrictionModel.of(fit)) is not None}
        after.torque_nm[:, elsewhere] = np.nan  # errors of the model are others at another place
        changes += _torques(before, after, robot, laws, new)
    return ProgramComparison(*names, counts, tuple(changes))


def _mean(values: FloatArray, axis: int = 0) -> FloatArray:
    known = np.isfinite(values)
    count = np.count_nonzero(known, axis=axis)
    return np.asarray(np.where(count > 0, np.where(known, values, 0.0).sum(axis=axis) / np.maximum(count, 1), np.nan))


def _stretches(values: FloatArray) -> FloatArray:
    """(c, s, …) means over stretches of the path of (c, p, …)."""
    return np.stack([_mean(part, axis=1) for part in np.array_split(values, _STRETCHES, axis=1)], axis=1)


def _difference(both: Iterable[FloatArray], among: int = 1) -> tuple[FloatArray, FloatArray]:
    """After less before (…), and half of its 95 % interval; ``both`` (c, …) of cycles, before and after.

    Where the largest of several is told, the interval holds for all ``among`` them at once (Bonferroni).
    """
    # means over blocks of cycles (b, …), NaN left aside
    parts = (np.array_split(side, min(_BLOCKS, len(side) // 2)) for side in both)
    sides = [np.stack([_mean(part) for part in its]) for its in parts]
    error = np.sqrt(sum(np.var(side, axis=0, ddof=1) / len(side) for side in sides))
    reach = float(student_quantile(min(len(side) for side in sides) - 1, 1.0 - 0.025 / among))
    return sides[1].mean(axis=0) - sides[0].mean(axis=0), np.asarray(reach * error)


def _change(
    quantity: ChangedQuantity,
    joint: str | None,
    value: float,
    half: float,
    least: float,
    stretch: int | None = None,
) -> ProgramChange:
    low, high, share = value - half, value + half, None if stretch is None else (stretch + 0.5) / _STRETCHES
    changed = low > least or high < -least
    unit, factor = _UNITS[quantity]
    of = f" of {joint}" if joint else ""
    if changed:
        at = "" if share is None else f", most at {100 * share:.0f} % of the path"
        text = f"{quantity}{of}: {factor * value:+.3g} {unit} ({factor * low:+.3g} to {factor * high:+.3g}){at}"
    else:
        text = f"{quantity}{of}: equal within {factor * max(abs(low), abs(high)):.2g} {unit}"
    return ProgramChange(quantity, joint, value, (low, high), least, changed, share, text)


_UNITS: dict[ChangedQuantity, tuple[str, float]] = {
    "path": ("mm", 1.0),
    "speed": ("%", 100.0),
    "load": ("kg", 1.0),
    "friction": ("%", 100.0),
    "residual": ("N·m", 1.0),
}


def _path(before: _Side, after: _Side, path: CyclePath, robot: RobotModel) -> tuple[list[ProgramChange], BoolArray]:
    """How far the tool passes beside where it passed, where that is most; and (p,) places at which it clearly does."""
    none = np.zeros(path.share.size, dtype=np.bool_)
    if robot.bodies is None or len(robot.joint_names) != path.position_rad.shape[1]:
        return [], none
    fast = before.fast[:, None]
    stretches = (_stretches(np.where(fast, x.position_rad, np.nan)) for x in (before, after))
    moved, half = _difference(stretches, among=_STRETCHES)
    middle = _stretches(path.position_rad[None])[0]
    per_rad = 1e3 * robot.torque_per_newton(np.ascontiguousarray(middle), robot.tool_frame)
    beside = np.linalg.norm(np.einsum("sjk,sj->sk", per_rad, moved), axis=1)
    error = np.sqrt(np.einsum("sjk,sj->s", per_rad**2, half**2))
    clear = np.nan_to_num(beside - error, nan=-np.inf)
    at = int(np.argmax(clear))
    if not np.isfinite(clear[at]):
        return [], none
    elsewhere = np.concatenate([np.full(len(part), off > _ELSEWHERE_MM) for part, off in
                                zip(np.array_split(none, _STRETCHES), clear, strict=True)])  # fmt: skip
    return [_change("path", None, float(beside[at]), float(error[at]), LEAST_CHANGE["path"], at)], elsewhere


def _speed(before: _Side, after: _Side) -> list[ProgramChange]:
    """How much faster the program runs over the whole path."""
    usual = median_and_spread(before.speed, 1)[0]
    shares = (np.maximum(side.speed, 1e-6) / np.maximum(usual, 1e-6) for side in (before, after))
    overall = [np.log(median_and_spread(share.T, 1)[0][:, None]) for share in shares]
    value, half = (float(x[0]) for x in _difference(overall))
    return [_change("speed", None, float(np.expm1(value)), half, LEAST_CHANGE["speed"])]


def _torques(
    before: _Side, after: _Side, robot: RobotModel, laws: Mapping[str, FrictionModel], new: Audit
) -> list[ProgramChange]:
    """Load, friction of each joint, and what is left of each joint's torque."""
    names, count = robot.joint_names, len(robot.joint_names)
    left = []
    # places that both logs judge in nearly every cycle, and pass fast
    shared = np.logical_and(*(np.isfinite(side.torque_nm).mean(axis=0) > _NEARLY_ALL for side in (before, after)))
    shared &= before.fast[:, None]
    for side in (before, after):
        explained = robot.inverse_dynamics(*side.motion) + _friction(side.motion[1], names, laws)
        left.append(np.where(shared, side.torque_nm - explained, np.nan))
    usual, spread = median_and_spread(left[0], _FEWEST)
    friction = _friction(after.motion[1], names, laws)
    of_joint = np.stack([friction, np.ones_like(friction)], axis=2)
    columns = np.concatenate([load_torques(robot, after.motion), of_joint], axis=2)
    sd = np.maximum(np.sqrt(_mean(spread**2)), 1e-3)
    # of each joint: the load, which all share, its friction, its zero
    place = np.column_stack([np.tile(np.arange(4), (count, 1)), 4 + np.arange(count), 4 + count + np.arange(count)])
    prior = 1.0 / np.array([*_LOAD_SD, *[_SHARE_SD] * count, *np.maximum(_ZERO_SD, sd)]) ** 2
    solved = [
        np.array([estimate(*_products(one - usual, columns, sd), place, prior).value for one in its]) for its in left
    ]
    value, half = _difference(solved)
    # errors of the model that all cycles share: large where the motion hardly tells
    shared_error = estimate(*_products(median_and_spread(left[1], 1)[0] - usual, columns, sd), place, prior).products
    half = np.hypot(half, STANDARD_ERRORS_95 * np.sqrt(np.diag(np.linalg.inv(shared_error))))
    changes = [_change("load", None, float(value[0]), float(half[0]), LEAST_CHANGE["load"])]
    for j, joint in enumerate(names):
        if joint in laws:
            its = float(value[4 + j]), float(half[4 + j])
            changes.append(_change("friction", joint, *its, LEAST_CHANGE["friction"]))
    others = [
        _stretches(its - usual - np.einsum("pjk,cjk->cpj", columns, solution[:, place]))  # at each place by itself
        for its, solution in zip(left, solved, strict=True)
    ]
    value, half = _difference(others, among=_STRETCHES * count)
    for j, joint in enumerate(names):
        gamma = new.result.rule.gamma_nm.get(joint)
        clear = np.abs(value[:, j]) - half[:, j]
        if gamma is not None and np.isfinite(clear).any():
            at = int(np.nanargmax(clear))
            least = LEAST_CHANGE["residual"] * gamma
            changes.append(_change("residual", joint, float(value[at, j]), float(half[at, j]), least, at))
    return changes


def _friction(velocity: FloatArray, names: Sequence[str], laws: Mapping[str, FrictionModel]) -> FloatArray:
    """(p, j) by the laws; 0 of joints without one."""
    none = np.zeros(velocity.shape[0])
    return np.stack(
        [laws[name].torque(v) if name in laws else none for name, v in zip(names, velocity.T, strict=True)], axis=1
    )


def _products(torque: FloatArray, columns: FloatArray, sd: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Products over stretches of the path, each as one observation: what the model has wrong there is one error.

    Args:
        torque, columns: (p, j) and (p, j, 3) N·m, NaN where not known.
        sd: (j,) of the torque from cycle to cycle.

    Returns:
        Means (s, j, 4, 4) of the products of columns and torque, and (s, j) 1 where any is known.
    """
    rows: FloatArray = np.asarray(np.concatenate([columns, torque[:, :, None]], axis=2) / sd[:, None])
    known: BoolArray = np.asarray(np.isfinite(rows).all(axis=2))
    block = np.arange(len(rows)) * _STRETCHES // len(rows)
    table = rows_of_blocks(np.asarray(np.where(known[:, :, None], rows, 0.0)), block)
    count = rows_of_blocks(known.astype(np.float64), block).sum(axis=1)
    means = np.einsum("brjm,brjn->bjmn", table, table) / np.maximum(count, 1.0)[:, :, None, None]
    return means, np.minimum(count, 1.0)
