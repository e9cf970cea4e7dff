"""Samples that were written twice: of one stamp, again and again while the arm moves on, or as a whole stretch."""

from __future__ import annotations

from dataclasses import replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from collaudit.core.conditioning.calm_stretches import CHANCE
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.uniform_series import MOVING_RAD_S
from collaudit.core.findings import Finding
from collaudit.core.logs.signals.stamp_conflicts import contradicting
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, frozen
from collaudit.core.numeric.channel_noise import Noise
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.runs import marked, run_bounds
from collaudit.core.numeric.stats import quantile_of

#: This many repeats in a row, and this many times the usual number, are a stall and not a slow source.
_LEAST, _TIMES = 8, 4
_LISTED = 20


def without_stalls(log: JointLog) -> JointLog:
    """The log without samples that only repeat the one before while the arm moved, and a finding for each stall.

    The arm moved if a velocity is logged that says so, or if it stands elsewhere after the stall.
    """
    repeats = _repeats(log)
    if not repeats.any():
        return log
    starts, stops = run_bounds(repeats)
    usual = float(np.median(stops - starts)) if starts.size >= 20 else 0.0
    drop = np.zeros(repeats.size, dtype=bool)
    findings = []
    for a, b in zip(starts, stops, strict=True):
        if b - a >= max(_LEAST, _TIMES * usual) and _moved(log, int(a), int(b)):
            drop[a:b] = True
            first, last = float(log.time_s[a - 1]), float(log.time_s[min(b, repeats.size - 1)])
            text = (
                f"The log repeats one sample {b - a} times from {first:.4g} to {last:.4g} s while the arm moves: the "
                "logger stalled. The repeats were left out; a contact then would not be seen."
            )
            findings.append(Finding("not-measured", "warning", text, start_s=first, end_s=last))
    if not findings:
        return log
    return replace(log.samples(~drop), findings=(*log.findings, *findings[:_LISTED]))


def _repeats(log: JointLog) -> BoolArray:
    """(n,) samples whose every value is that of the sample before."""
    first = log.position_rad[:, 0]
    at = np.flatnonzero(first[1:] == first[:-1]) + 1  # the first joint says where a closer look is needed
    out = np.zeros(log.time_s.size, dtype=bool)
    out[at] = True
    for values in (log.position_rad, log.velocity_rad_s, log.effort):
        if values is not None:
            now, before = values[at], values[at - 1]
            out[at] &= ((now == before) | (np.isnan(now) & np.isnan(before))).all(axis=1)
    return out


def _moved(log: JointLog, start: int, stop: int) -> bool:
    speed = np.zeros(1) if log.velocity_rad_s is None else np.nan_to_num(np.abs(log.velocity_rad_s[start]))
    if float(speed.max()) > MOVING_RAD_S:
        return True
    if stop >= log.time_s.size:
        return False
    way = np.nan_to_num(np.abs(log.position_rad[stop] - log.position_rad[start - 1]))
    return float(way.max()) > MOVING_RAD_S * float(log.time_s[stop] - log.time_s[start - 1])


#: A position that repeats for less than this, or for fewer samples, is not frozen.
_LEAST_S, _POSITIONS_LEAST = 0.05, 8
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
    least = max(_POSITIONS_LEAST, ceil(_LEAST_S / period))
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


_UNITS = {"Nm": "N·m"}


def without_contradictions(log: JointLog) -> JointLog:
    """The log without the values of samples that share a stamp and contradict each other, and a finding for each joint.

    Nothing tells which of them was measured, and the order of the rows does not.
    """
    parts: dict[str, FloatArray] = {}
    findings: list[Finding] = []
    for name, values in (("position_rad", log.position_rad), ("effort", log.effort)):
        if values is None:
            continue
        rows = ordered_map(lambda column: contradicting(log.time_s, column), values.T)
        contradicted = {j: wrong for j, wrong in enumerate(rows) if wrong is not None}
        if contradicted:
            known = values.copy(order="F")
            unit = "rad" if name == "position_rad" else _UNITS.get(log.effort_unit, "")
            for j, wrong in contradicted.items():
                known[wrong, j] = np.nan
                findings.append(_conflict(log, j, wrong, name.partition("_")[0], values, unit))
            parts[name] = frozen(known)
    if not parts:
        return log
    return replace(log, findings=(*log.findings, *findings), **parts)  # type: ignore[arg-type]


def _conflict(log: JointLog, j: int, wrong: BoolArray, what: str, values: FloatArray, unit: str) -> Finding:
    joint, at = log.joint_names[j], np.flatnonzero(wrong)
    _, size = _from_the_first(log.time_s[at], values[at, j : j + 1])
    first, last = float(np.min(log.time_s[at])), float(np.max(log.time_s[at]))
    text = (
        f"{at.size} samples share their stamps and give other {what}s of joint '{joint}', by up to {size.max():.3g} "
        f"{unit}, between {first:.4g} and {last:.4g} s: two publishers, two recordings in one, or one stamp for "
        "several samples. Nothing shows which are right: they count as missing, and a contact then would not be seen."
    )
    return Finding("log-publishers-conflict", "warning", text, joint=joint, start_s=first, end_s=last)


def duplicate_findings(log: JointLog, order: IntArray) -> list[Finding]:
    """What was left out because of its stamp, and by how much it differs from what was kept.

    Args:
        log: as recorded.
        order: rows that are used.
    """
    unused = np.isfinite(log.time_s)
    unused[order] = False
    if not unused.any():
        return []
    values = np.concatenate([log.position_rad, *([] if log.effort is None else [log.effort])], axis=1)
    rows, size = _from_the_first(log.time_s, values)
    here = unused[rows]
    if not here.any():
        return []
    largest = size[here].max(axis=0)
    left_out = np.count_nonzero(here)
    text = f"{left_out} samples have the stamp of the sample before and were left out (the first was kept)"
    count = len(log.joint_names)
    parts = [(largest[:count], "positions", "rad"), (largest[count:], "efforts", _UNITS.get(log.effort_unit, ""))]
    by = [
        f"{what} of up to {part.max():.3g} {unit} ({log.joint_names[int(np.argmax(part))]})".replace("  ", " ")
        for part, what, unit in parts
        if part.size and part.max() > 0.0
    ]
    if not by:
        return [Finding("time-duplicate", "info", f"{text}; they are the same.")]
    return [Finding("time-duplicate", "warning", f"{text}; they differ in {' and '.join(by)}.")]


def _from_the_first(time_s: FloatArray, values: FloatArray) -> tuple[IntArray, FloatArray]:
    """(m,) rows that are not the first of their stamp, and (m, c) how far their values are from those of the first."""
    known = np.flatnonzero(np.isfinite(time_s))
    sorting = known[np.argsort(time_s[known], kind="stable")]
    stamps = time_s[sorting]
    fresh = np.concatenate(([True], np.diff(stamps) > 0.0))
    first = sorting[np.flatnonzero(fresh)[np.cumsum(fresh) - 1]]
    rows = sorting[~fresh]
    return rows, np.nan_to_num(np.abs(values[rows] - values[first[~fresh]]))


#: So many times as many values have to agree as would if each were drawn anew: noise is not, and less in slow motion.
_DEPENDENT = 2
#: A channel two of whose values are the same more often than this is too coarse to tell.
_MOST_ALIKE = 0.1
#: Values from which it is told how often two are the same.
_DRAWN = 1 << 14
#: What a hash is multiplied by before the next value is added: odd, its bits mixed (2^64 / golden ratio).
_FACTOR, _FOLD = np.uint64(0x9E3779B97F4A7C15), np.uint64(29)
_Hashes = NDArray[np.uint64]


def repeated_rows(x: FloatArray, noise: Noise, usual: BoolArray, least: int) -> BoolArray | None:
    """(n,) rows of runs that occurred before in the same order; None without any.

    The first of them counts as measured. If it was the copy, the log holds a stretch without measurement all the same.

    Values that are held count once. How many have to agree follows from how often two values of the channel do.

    Args:
        x: (n,) channel.
        noise: of it; one that was computed repeats where its motion does, a coarse one by chance.
        usual: (n,) rows that are looked at.
        least: samples.
    """
    return _repeated(_bits(x), usual & np.isfinite(x), least) if noise.varied else None


def repeated_rows_of_all(values: FloatArray, usual: BoolArray, least: int) -> BoolArray | None:
    """As :func:`repeated_rows`, where several channels (n, c) repeat together: fewer samples tell that."""
    key = np.zeros(values.shape[0], dtype=np.uint64)
    for column in values.T:
        _add(key, _bits(column))
    return _repeated(key, usual & np.isfinite(values.sum(axis=1)), least)


def _bits(x: FloatArray) -> _Hashes:
    return (x + 0.0).view(np.uint64)  # -0.0 is 0.0


def _add(key: _Hashes, value: _Hashes) -> None:
    """Add values to hashes, in place."""
    key *= _FACTOR
    key ^= key >> _FOLD
    key += value


def _repeated(value: _Hashes, usual: BoolArray, least: int) -> BoolArray | None:
    fresh = np.flatnonzero(np.concatenate(([True], value[1:] != value[:-1])) & usual)
    if fresh.size < 2:
        return None
    values = value[fresh]
    alike = _alike(values)
    if alike > _MOST_ALIKE:
        return None
    count = _DEPENDENT * ceil(np.log(0.5 * fresh.size**2 / CHANCE) / -np.log(alike))
    if fresh.size < 2 * count:
        return None
    starts, stops = run_bounds(_again(values, count))
    starts, stops = fresh[starts], fresh[stops + count - 2] + 1
    long = stops - starts >= least
    return marked(starts[long], stops[long], value.size) if long.any() else None


def _alike(values: _Hashes) -> float:
    """Share of the pairs of values that are the same, of some drawn evenly, or that one such pair would be."""
    ordered = np.sort(values[:: max(1, values.size // _DRAWN)])
    starts, stops = run_bounds(ordered[1:] == ordered[:-1])
    times = (stops - starts + 1).astype(np.float64)
    return max(float(np.sum(times * (times - 1.0))), 1.0) / (float(ordered.size) * (ordered.size - 1.0))


def _again(values: _Hashes, count: int) -> BoolArray:
    """(m,) whether the ``count`` values from each place on stand earlier too."""
    size = values.size - count + 1
    key = np.zeros(size, dtype=np.uint64)
    for k in range(count):
        _add(key, values[k : k + size])
    later = np.zeros(size, dtype=np.bool_)
    ordered = np.sort(key)
    if not (ordered[1:] == ordered[:-1]).any():  # as in most logs, and told in a tenth of the time
        return later
    order = np.argsort(key, kind="stable")
    later[order[1:]] = key[order[1:]] == key[order[:-1]]
    return later
