"""An arm that a person guides while its drives only hold its weight, told by the signals: not judged nor fitted there.

A drive that moves an arm supplies what friction and inertia take: s = f(v) + tau_rigid - g(q). When the arm is guided
by hand (freedrive, zero gravity), a person supplies it, and the effort is gravity's torque alone. So of the drive's
effort beside gravity, y = effort - g(q), the *share* <s, y> / <s, s> is 1 where the drive moves the joint and near 0
where a hand does; what is left of y against s must be small too. A contact on a driven arm adds its own torque to s: it
makes y larger, or smaller on the joints that it loads and for as long as it lasts. Therefore at least two joints, and
every joint that tells anything, must show it for a second. Where the drives act within such a stretch (y as large as s,
a push against a drive), the stretch is interrupted. What is left of it must last half a second: a single spike of s,
as a jump of the clock makes, outweighs all else in the windows around it. An effort that is what the drive supplies,
only late (a slow low-pass), is no sign of a hand; how far efforts are smoothed is told by the same two sides.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from math import ceil

import numpy as np
import scipy

from collaudit.core.arm_states.arm_states import without_states
from collaudit.core.config.schema import Config
from collaudit.core.config.schema_judging import PUSH_S
from collaudit.core.data.joint_log import MOVING_RAD_S, UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, marked, run_bounds
from collaudit.core.numeric.stats import quantile_of
from collaudit.core.prepare.effort_smoothing import Friction, effort_smoothing, smoothing_words
from collaudit.core.prepare.preparation import without_effort
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.torque_table.block_sums import products_of
from collaudit.core.torque_table.log_samples import TorqueTable, thinned

#: Of friction's line over speed one coefficient beside the other.
_EITHER = ("way", "along"), ("along", "way")
#: Blocks, s; window that must show it, blocks.
_BLOCK_S, _WINDOW = 0.1, 10
#: A joint moves in a window when it moves for this share of it; it tells when s is this many times its noise.
_MOVES, _TELLS = 0.3, 3.0
#: Share of s that the drive supplies at most, and RMS of y against that of s; above the last a block is driven.
_SHARE, _REST, _DRIVEN = 0.4, 0.5, 0.6
#: Joints that must show it, at least.
_LEAST_JOINTS = 2
#: Quantile of the blocks' residual that is taken for its noise: most of a log may be guided.
_QUIET = 0.2
#: Longest pause within one stretch, and shortest stretch, s.
_PAUSE_S, _LEAST_S = 3.0, 0.5
#: Time constants of a late drive that are tried, s; how long before the stretch its low-pass starts, in time constants.
_LAGS_S, _BEFORE = (0.1, 0.15, 0.25, 0.4, 0.6, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5), 5.0
#: Share of the effort beside gravity, as its power, that a late drive leaves at most in the mean of the joints.
#: Simulated, it leaves up to 0.4, and an arm in a hand several times the whole.
_LEFT = 0.5


def without_guiding(prepared: Prepared, friction: Mapping[str, Friction], config: Config) -> Prepared:
    """The log with stretches of hand guiding marked as not driven, and a finding for each.

    Args:
        prepared: the log to be judged.
        friction: sliding friction by joint.
        config: ``[detect] hand_guiding``.
    """
    found = _found(prepared, friction, config)
    if not found:
        return prepared
    series = prepared.series
    mask = _covered(series, found)
    if series.not_driven is not None:
        mask |= series.not_driven
    findings = tuple(_finding("arm-guided", one, "judged") for one in found)
    return replace(prepared, series=without_states(series, mask), findings=(*prepared.findings, *findings))


def with_effort_smoothing(
    prepared: Prepared, friction: Mapping[str, Friction], contact: BoolArray | None = None
) -> Prepared:
    """The log with how far its efforts are smoothed, and a finding where that is more than a drive does, or unknown.

    Args:
        prepared: the log to be judged.
        friction: sliding friction by joint.
        contact: (n,) samples that are not looked at.
    """
    table = _table(prepared)
    if table is None:
        return prepared
    if contact is not None:
        touched = thinned(contact[:, None].astype(np.float64), round(table.period_s / prepared.series.period_s))
        table = replace(table, effort=np.where(touched > 0.0, np.nan, table.effort))
    found = effort_smoothing(table, friction)
    shown = {joint: one for joint, one in found.items() if one.shown}
    findings = prepared.findings
    if shown:
        text = smoothing_words(shown, PUSH_S)
        findings = (*findings, Finding("effort-filtered", "warning", text))
    if unknown := [joint for joint, one in found.items() if not (one.bounded or one.shown)]:
        text = (
            f"How far the efforts of {', '.join(unknown)} are smoothed on their way into the log is not known: the "
            "motion is too slow to show it. No push there counts as noticed. Faster motion in the log shows it."
        )
        findings = (*findings, Finding("effort-filtered", "warning", text))
    return replace(prepared, findings=findings, effort_smoothing=found)


def fitted_without_guiding(prepared: Prepared, config: Config) -> tuple[Prepared, tuple[Finding, ...]]:
    """A log that is to be fitted, with the effort unknown where a hand guided the arm, and a finding for each stretch.

    Friction is not known yet: :func:`rough_friction` of the log itself stands for it.
    """
    found = _found(prepared, rough_friction(prepared), config)
    if not found:
        return prepared, ()
    findings = tuple(_finding("fit-left-out", one, "fitted") for one in found)
    return without_effort(prepared, _covered(prepared.series, found), config), findings


def rough_friction(prepared: Prepared) -> dict[str, Friction]:
    """Sliding friction F sgn v + D v by joint, of motion one way, as most of its seconds have it.

    In some of the motion the drives may supply less, as under a hand. Joints that hardly move, or whose effort does not
    go with their motion, have none.
    """
    table, found = _table(prepared), dict[str, Friction]()
    if table is None:
        return {}
    # counted by the rows that were recorded: a gap may be of years
    recorded = replace(table, time_s=np.arange(table.time_s.size) * np.float64(table.period_s))
    along = table.way * np.abs(table.motion[1])
    for joint, sums in recorded.sums(rest=table.effort - table.model, along=along).items():
        level = sums.slope("rest", "way", "beyond", "one")
        coulomb, viscous = (sums.slope("rest", *two, "one", least_own=0.0) for two in _EITHER)
        if joint in prepared.judged and level is not None and level.positive and coulomb and viscous:
            found[joint] = partial(_sliding, max(coulomb.value, 0.0), max(viscous.value, 0.0))
    return found


def _sliding(coulomb_nm: float, viscous_nm_s_per_rad: float, velocity: FloatArray) -> FloatArray:
    return np.asarray(coulomb_nm * np.tanh(velocity / (0.5 * MOVING_RAD_S)) + viscous_nm_s_per_rad * velocity)


def _found(prepared: Prepared, friction: Mapping[str, Friction], config: Config) -> list[HandGuiding]:
    table = None if config.detect.hand_guiding == "off" else _table(prepared)
    return [] if table is None else hand_guiding(table, prepared.robot.gravity_torque, friction)


def _table(prepared: Prepared) -> TorqueTable | None:
    """What the drives exert beside the tool's commanded force, and the rigid bodies' torque; None where unknown."""
    series, rigid, start = prepared.series, prepared.rigid_nm, prepared.start.table
    if rigid is None or start is None or series.effort is None or series.effort_unit != "Nm":
        return None
    contact = prepared.contact_nm
    driven = series if contact is None else replace(series, effort=series.effort - contact)
    return start.seen(driven, rigid)


def _covered(series: UniformSeries, found: Sequence[HandGuiding]) -> BoolArray:
    """(n,) samples in one of the stretches."""
    out = np.zeros(series.time_s.size, dtype=np.bool_)
    for one in found:
        out |= (series.time_s >= one.start_s) & (series.time_s < one.end_s)
    return out


def _finding(code: str, found: HandGuiding, what: str) -> Finding:
    """That a hand guided the arm in a stretch, which is not ``what``."""
    text = (
        f"From {found.start_s:.4g} to {found.end_s:.4g} s the arm moves and its drives do not move it: on "
        f"{', '.join(found.joints)} their efforts hold gravity and supply {100 * max(found.share, 0.0):.0f} % of what "
        f"friction and inertia take; {found.work_j:.3g} J come from outside. It looks guided by hand (freedrive) "
        f"without a flag that says so; not {what} there."
    )
    return Finding(code, "warning", text, start_s=found.start_s, end_s=found.end_s)


@dataclass(frozen=True, slots=True)
class HandGuiding:
    """One stretch in which the arm was guided.

    Attributes:
        start_s, end_s: s.
        joints: names of those that tell it.
        share: of friction and inertia that the drives supplied on these joints.
        work_j: work of these joints' external torque on the arm, J.
    """

    start_s: float
    end_s: float
    joints: tuple[str, ...]
    share: float
    work_j: float


@dataclass(frozen=True, slots=True, eq=False)
class _Blocks:
    """Sums over blocks of a tenth of a second, (b, j): known samples, those in motion, s², s·y, y², power, W."""

    known: FloatArray
    moving: FloatArray
    ss: FloatArray
    sy: FloatArray
    yy: FloatArray
    power_w: FloatArray

    @classmethod
    def of(cls, speed: FloatArray, supplied: FloatArray, exerted: FloatArray, block: IntArray) -> _Blocks:
        """Of (m, j) speed, s and y, by the block (m,) of each row."""
        known = np.isfinite(supplied + exerted)
        moving = known & (np.abs(speed) >= MOVING_RAD_S)
        v, s, y = (np.where(moving, x, 0.0) for x in (speed, supplied, exerted))
        sums = products_of(np.stack([known, moving, s, y, (s - y) * v], axis=2), block)
        return cls(*(sums[..., a, b] for a, b in ((0, 0), (1, 1), (2, 2), (2, 3), (3, 3), (0, 4))))

    def windows(self) -> _Blocks:
        """The same over each window of ten blocks, (b - 9, j)."""
        every = (np.lib.stride_tricks.sliding_window_view(getattr(self, f.name), _WINDOW, axis=0) for f in fields(self))
        return _Blocks(*(np.asarray(x.sum(axis=-1)) for x in every))

    def noise_nm(self) -> FloatArray:
        """(j,) what y differs from s by in a joint's quieter motion; 0 without any."""
        with np.errstate(invalid="ignore", divide="ignore"):
            off = np.sqrt(np.maximum(self.ss - 2.0 * self.sy + self.yy, 0.0) / self.moving)
        known = [column[~np.isnan(column)] for column in off.T]
        return np.array([quantile_of(column, _QUIET) if column.size else 0.0 for column in known])


def hand_guiding(
    table: TorqueTable, gravity: Callable[[FloatArray], FloatArray], friction: Mapping[str, Friction]
) -> list[HandGuiding]:
    """Stretches in which the arm was guided by hand.

    Args:
        table: the log, its effort without the commanded tool force's torque, its model that of the rigid bodies, N·m.
        gravity: (k, j) gravity torque at (k, j) positions.
        friction: sliding friction at (k,) speeds, by joint; joints without it tell nothing.
    """
    joints = [joint for joint in table.joints if joint in friction]
    columns = [table.joints.index(joint) for joint in joints]
    block = (np.arange(table.time_s.size) * table.period_s / _BLOCK_S + 1e-6).astype(np.int64)
    if len(joints) < _LEAST_JOINTS or table.period_s > _BLOCK_S or not block.size or block[-1] < _WINDOW:
        return []  # too few blocks, or more of them than samples
    speed = table.motion[1][:, columns]
    drives = table.model[:, columns] + np.stack([friction[x](v) for x, v in zip(joints, speed.T, strict=True)], axis=1)
    weight, effort = gravity(np.nan_to_num(table.motion[0]))[:, columns], table.effort[:, columns]
    sums = _Blocks.of(speed, drives - weight, effort - weight, block)
    mask, telling = _guided(sums)
    found = []
    for start, stop in zip(*run_bounds(mask), strict=True):
        tell = np.flatnonzero(telling[start:stop].any(axis=0))
        rows = np.flatnonzero((block >= start) & (block < stop))
        late = _follows_late(table.period_s, rows, effort[:, tell], drives[:, tell], weight[:, tell])
        if stop - start < round(_LEAST_S / _BLOCK_S) or late:
            continue
        whole, share = (float(x[start:stop, tell].sum()) for x in (sums.ss, sums.sy))
        work = (sums.power_w[start:stop, tell] / np.maximum(sums.known[start:stop, tell], 1.0)).sum() * _BLOCK_S
        ends = float(table.time_s[rows[0]]), float(table.time_s[rows[-1]]) + table.period_s
        found.append(HandGuiding(*ends, tuple(joints[k] for k in tell), share / max(whole, 1e-300), float(work)))
    return found


def _guided(sums: _Blocks) -> tuple[BoolArray, BoolArray]:
    """(b,) blocks of guided stretches, and (b, j) joints that tell it in the window around."""
    wide, noise = sums.windows(), sums.noise_nm()
    moves = wide.moving > _MOVES * np.maximum(wide.known, 1.0)
    tells = moves & (wide.ss > np.square(_TELLS * noise) * wide.moving) & (wide.ss > 0.0)
    passive = (wide.sy < _SHARE * wide.ss) & (wide.yy < _REST**2 * wide.ss) & (wide.power_w > 0.0)
    enough = np.maximum(_LEAST_JOINTS, np.ceil(0.5 * np.count_nonzero(moves, axis=1)))
    shown = (np.count_nonzero(tells, axis=1) >= enough) & (passive | ~tells).all(axis=1)
    told = [np.flatnonzero(shown & column) for column in (np.ones_like(shown), *tells.T)]
    mask, *telling = (marked(at, at + _WINDOW, len(sums.known)) for at in told)
    return _joined(mask, sums, noise), np.stack(telling, axis=1)


def _joined(mask: BoolArray, sums: _Blocks, noise: FloatArray) -> BoolArray:
    """Without blocks in which a drive acts, with those next to it in which none does, and with short pauses."""
    floor = np.square(_TELLS * noise) * sums.moving
    size = np.maximum(sums.ss, floor)
    share = np.sum(np.where(size > 0, sums.sy, 0.0), axis=1)
    whole = np.sum(sums.ss, axis=1)
    acts = (share > _DRIVEN * whole) & (whole > np.sum(floor, axis=1))
    acts |= ((sums.yy > np.maximum(sums.ss, 4.0 * floor)) & (sums.moving > 0)).any(axis=1)
    quiet = ~acts & (np.sum(sums.moving, axis=1) > 0)
    out: BoolArray = mask & quiet
    if out.any():  # neighbours that move without their drives belong to it
        out = scipy.ndimage.binary_dilation(out, iterations=2 * _WINDOW, mask=quiet)
    for a, b in zip(*run_bounds(~out), strict=True):
        inner = a > 0 and b < out.size
        if inner and b - a <= _PAUSE_S / _BLOCK_S and not acts[a:b].any() and (sums.known[a:b].sum(axis=1) > 0).all():
            out[a:b] = True
    return out


def _follows_late(period_s: float, rows: IntArray, effort: FloatArray, drives: FloatArray, weight: FloatArray) -> bool:
    """Whether in some rows the efforts of these joints are what their drives supply, behind one low-pass.

    Args:
        period_s: of the rows.
        rows: (k,) in question, one after the other.
        effort, drives, weight: (m, j) as logged, what drives supply, and gravity.
    """
    unknown = np.flatnonzero(~np.isfinite(drives[: rows[0]]).all(axis=1))
    first = max(rows[0] - ceil(_BEFORE * _LAGS_S[-1] / period_s), unknown[-1] + 1 if unknown.size else 0)
    supplied = np.nan_to_num(drives[first : rows[-1] + 1])
    before = np.where(np.isfinite(effort[first]), effort[first], supplied[0])  # friction at rest has no sign
    logged, own = effort[rows], np.nansum(np.square(effort[rows] - weight[rows]), axis=0)
    for lag_s in _LAGS_S:
        share = period_s / (period_s + lag_s)
        start = (1.0 - share) * before[None]
        late = scipy.signal.lfilter([share], [1.0, share - 1.0], supplied, axis=0, zi=start)[0][rows - first]
        if np.mean(np.nansum(np.square(logged - late), axis=0) / np.maximum(own, 1e-300)) < _LEFT:
            return True
    return False
