"""Samples that are no measurement: they count as missing, and a finding says so.

Of efforts, stretches that are constant, on a straight line, copies of another stretch, or without the channel's usual
noise, while the arm moves. Of positions, stretches that stand still while the joint moves on.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from collaudit.core.conditioning.calm_stretches import (
    quiet_rows,
    repeated_rows,
    shortest_stretch,
    straight,
    straight_rows,
    straight_runs,
)
from collaudit.core.conditioning.position_jumps import frozen_spans
from collaudit.core.config.schema_judging import DetectConfig
from collaudit.core.data.joint_log import LEAST_EFFORT_CHANGE, MOVING_RAD_S, JointLog
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, frozen, marked, run_bounds
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.stats import bend_of, median_of, noise_of, quantile_of

#: Samples from which a period is told.
_FEWEST = 24
#: Samples, drawn evenly, that tell what a drive usually exerts.
_DRAWN = 100_000
#: Speed is told over this time, s.
_SPEED_S = 0.05
_LISTED = 3
#: No effort is less than this share of what the drive exerts at most in so much of the time.
_NO_EFFORT, _USUAL = 0.02, 0.95
#: What a stretch is, said in this order.
_CONSTANT, _STRAIGHT, _QUIET, _COPIED = 1, 2, 3, 4
_WORDS = {
    _CONSTANT: "constant",
    _STRAIGHT: "a straight line",
    _QUIET: "without the usual noise",
    _COPIED: "the exact copy of another stretch",
}


def without_unmeasured(recorded: JointLog, detect: DetectConfig) -> JointLog:
    """The log with efforts and positions that are no measurement as missing values, and a finding for each joint.

    Args:
        recorded: (n, j) signals, stamps as recorded.
        detect: a stretch shorter than its persistence hides no contact.
    """
    period = _period(recorded.time_s)
    if period is None:
        return recorded
    count = range(len(recorded.joint_names))
    effort, position, findings = recorded.effort, recorded.position_rad, list[Finding]()
    found = list(ordered_map(lambda j: frozen_spans(recorded, j, period), count))
    for j, spans in enumerate(found):
        if spans:
            position = position.copy(order="F") if position is recorded.position_rad else position
            for start, stop in spans:
                position[start:stop, j] = np.nan
            what = "position of joint '{joint}' stands still while the joint moves"
            findings.append(_finding(recorded, j, what, *zip(*spans, strict=True)))
    if effort is not None:
        kinds = _efforts(recorded.position_rad, effort, period, shortest_stretch(detect, period))
        if kinds.any():
            kinds[saturation(effort, period)] = 0  # a limit is a measurement, of at least so much: it is judged as that
            effort = effort.copy(order="F")
            effort[kinds > 0] = np.nan
            for j in np.flatnonzero(kinds.any(axis=0)).tolist():
                what = " or ".join(words for code, words in _WORDS.items() if (kinds[:, j] == code).any())
                what = f"effort of joint '{{joint}}' is no measurement but {what}"
                findings.append(_finding(recorded, j, what, *run_bounds(kinds[:, j] > 0)))
    if not findings:
        return recorded
    parts = {"effort": None if effort is None else frozen(effort), "position_rad": frozen(position)}
    return replace(recorded, findings=(*recorded.findings, *findings), **parts)  # type: ignore[arg-type]


def _period(time_s: FloatArray) -> float | None:
    if time_s.size < _FEWEST:
        return None
    steps = np.diff(time_s)
    period = median_of(steps[~np.isnan(steps)])
    return period if period > 0 else None


def _efforts(position: FloatArray, effort: FloatArray, period: float, least: int) -> NDArray[np.int8]:
    """(n, j) what each effort is instead of a measurement, 0 where it is one.

    Where a moving joint's effort is none, so is that of every other joint that is as straight there, at rest too: what
    holds or fills in the one does so with all.
    """
    kinds = np.zeros(effort.shape, dtype=np.int8, order="F")
    moving = _moving(position, period)
    moving &= _driven(effort)[:, None]
    if not moving.any():
        return kinds
    arm = np.asarray(moving.any(axis=1))

    def mark_alone(j: int) -> tuple[FloatArray | None, bool]:
        """Mark a channel by itself; (n,) squares of its bends in its noise, if that tells, and whether it varies."""
        x = np.ascontiguousarray(effort[:, j])
        if not np.isfinite(x).any():
            return None, False
        bend, own = bend_of(x), moving[:, j]
        noise = noise_of(x, bend, own)
        _mark(kinds[:, j], x, _STRAIGHT, straight_rows(x, bend, noise, own, least))
        _mark(kinds[:, j], x, _QUIET, quiet_rows(bend, own, least) if noise.tells else None)
        _mark(kinds[:, j], x, _COPIED, repeated_rows(x[:, None], arm, least) if noise.varied else None)
        return np.square(bend / noise.sd) if noise.tells else None, noise.varied

    power, channels, varied = np.zeros(arm.size), 0, 0
    for own_power, varies in ordered_map(mark_alone, range(effort.shape[1])):
        varied += varies
        if own_power is not None:
            power += own_power
            channels += 1
    quiet = quiet_rows(np.sqrt(power), arm, least, channels) if channels > 1 else None
    again = repeated_rows(effort, arm, least) if varied > 1 else None
    for j, x in enumerate(effort.T):
        _mark(kinds[:, j], x, _QUIET, quiet)
        _mark(kinds[:, j], x, _COPIED, again)
    if kinds.any():
        lost = np.asarray((kinds > 0).any(axis=1))
        for j in range(effort.shape[1]):
            x = np.ascontiguousarray(effort[:, j])
            _mark(kinds[:, j], x, _STRAIGHT, _along(x, lost, moving[:, j], least))
    return kinds


def _driven(effort: FloatArray) -> BoolArray:
    """(n,) rows in which some joint has an effort: where none has, drives are off, which is another matter."""
    out = np.zeros(effort.shape[0], dtype=np.bool_)
    for x in effort.T:
        some = x[:: max(1, x.size // _DRAWN)]
        known = np.abs(some[np.isfinite(some)])
        out |= np.abs(x) > (_NO_EFFORT * quantile_of(known, _USUAL) if known.size else np.inf)
    return out


def _moving(position: FloatArray, period: float) -> BoolArray:
    """(n, j) rows in which a joint moves, by its differentiated position."""
    half = max(1, ceil(_SPEED_S / period / 2))
    out = np.zeros(position.shape, dtype=np.bool_, order="F")
    if position.shape[0] > 2 * half:
        for moves, x in zip(out.T, position.T, strict=True):
            moves[half:-half] = np.abs(x[2 * half :] - x[: -2 * half]) > MOVING_RAD_S * (2 * half * period)
    return out


def _mark(kinds: NDArray[np.int8], x: FloatArray, kind: int, rows: BoolArray | None) -> None:
    """Give rows of a channel (n,) this kind where they have none; a straight line that is held is constant."""
    if rows is None:
        return
    fresh = rows & (kinds == 0)
    kinds[fresh] = kind
    if kind == _STRAIGHT:
        kinds[fresh & np.concatenate(([False], x[1:] == x[:-1]))] = _CONSTANT


def _along(x: FloatArray, lost: BoolArray, moving: BoolArray, least: int) -> BoolArray | None:
    """(n,) rows of runs that are straight on this joint and mostly lost on another one."""
    if not np.isfinite(x).any():
        return None
    bend = bend_of(x)
    starts, stops = straight_runs(x, straight(bend, noise_of(x, bend, moving)))
    count = np.concatenate(([0], np.cumsum(lost)))
    mostly = (stops - starts >= least) & (2 * (count[stops] - count[starts]) >= stops - starts)
    return marked(starts[mostly], stops[mostly], x.size)


def _finding(recorded: JointLog, j: int, what: str, starts: Iterable[int], stops: Iterable[int]) -> Finding:
    """That a joint's signal is none in runs of rows, with the steps that lead into each and out of it."""
    time_s, last = recorded.time_s, recorded.time_s.size - 1
    spans = [(float(time_s[max(a - 1, 0)]), float(time_s[min(b, last)])) for a, b in zip(starts, stops, strict=True)]
    total = sum(end - start for start, end in spans)
    listed = ", ".join(f"{start:.4g} to {end:.4g} s" for start, end in spans[:_LISTED])
    more = f" and {len(spans) - _LISTED} more times" if len(spans) > _LISTED else ""
    text = (
        f"The {what.format(joint=recorded.joint_names[j])} for {total:.3g} s ({listed}{more}). A contact then would "
        "not be seen: it counts as missing, and nothing that needs it is judged there."
    )
    return Finding("not-measured", "warning", text, None, recorded.joint_names[j], *spans[0])


def saturation(effort: FloatArray, period_s: float) -> BoolArray:
    """(n, j) where an effort rests exactly at its own extreme for 10 samples and 40 ms or longer.

    Only for signals that otherwise change from sample to sample: coarse, slow or constant signals
    repeat their extreme by nature.
    """
    least = max(10, ceil(0.04 / period_s))
    out = np.zeros(effort.shape, dtype=bool, order="F")  # memory that is not written to is none
    for mask, x in zip(out.T, effort.T, strict=True):
        for start, stop in _at_extreme(np.ascontiguousarray(x), least):
            mask[start:stop] = True
    return out


def _at_extreme(x: FloatArray, least: int) -> list[tuple[int, int]]:
    """Half-open ranges of at least so many samples at the largest or the smallest value."""
    known = x if np.isfinite(x.sum()) else x[np.isfinite(x)]
    if known.size == 0:
        return []
    extremes = (known.max(), known.min())
    found = [run_bounds(x == extreme) for extreme in extremes if extreme != 0.0]
    long = [(int(a), int(b)) for starts, stops in found for a, b in zip(starts, stops, strict=True) if b - a >= least]
    if not long:
        return []
    between = known[(known < extremes[0]) & (known > extremes[1])]
    coarse = between.size < 2 or np.mean(np.diff(between) == 0) > 0.5
    return [] if coarse else long


def effort_signal_findings(
    log: JointLog, effort: FloatArray | None, velocity: FloatArray, saturated: BoolArray, time_s: FloatArray
) -> list[Finding]:
    """Efforts that are missing, constant while the joint moves, or saturated.

    Args:
        log: whose joints these are.
        effort: (n, j) on the uniform grid, or None.
        velocity: (n, j) rad/s.
        saturated: (n, j) of :func:`saturation`.
        time_s: (n,) of the grid, s.
    """
    if effort is None:
        return [Finding("log-effort-missing", "error", "The log has no effort: nothing can be fitted or judged.")]
    findings = []
    pinned = np.count_nonzero(saturated, axis=0)
    for j, joint in enumerate(log.joint_names):
        x, v = effort[:, j], velocity[:, j]
        findings += _constant(x, v, joint)
        if pinned[j]:
            rows = np.flatnonzero(saturated[:, j])
            first, last = float(time_s[rows[0]]), float(time_s[rows[-1]])
            text = (
                f"The effort of joint '{joint}' rests at its extreme for {pinned[j] * (time_s[1] - time_s[0]):.3g} s "
                f"between {first:.4g} and {last:.4g} s: saturated, not judged there."
            )
            findings.append(Finding("not-measured", "warning", text, joint=joint, start_s=first, end_s=last))
    return findings


def _constant(effort: FloatArray, velocity: FloatArray, joint: str) -> list[Finding]:
    """A finding when one joint's effort (n,) has no values, or one value while the joint moves."""
    known = effort if np.isfinite(effort.sum()) else effort[np.isfinite(effort)]
    if known.size == 0:
        return [Finding("log-effort-missing", "error", f"Joint '{joint}' has no effort values.", joint=joint)]
    lowest, highest = float(known.min()), float(known.max())
    if highest - lowest > LEAST_EFFORT_CHANGE or not np.nanmax(np.abs(velocity), initial=0.0) > MOVING_RAD_S:
        return []
    text = f"The effort of joint '{joint}' is {known[0] + 0.0:g} all the time although the joint moves."
    if highest > lowest:
        text = f"The effort of joint '{joint}' is no measurement: all its values lie within {highest - lowest:.2g}."
    return [Finding("log-effort-missing", "error", text, joint=joint)]
