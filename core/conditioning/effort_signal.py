"""What an effort signal shows by itself: missing, constant, or resting at its extreme."""

from __future__ import annotations

from math import ceil

import numpy as np

from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.uniform_series import MOVING_RAD_S
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.runs import run_bounds


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
            findings.append(Finding("log-effort-saturated", "warning", text, joint=joint, start_s=first, end_s=last))
    return findings


def _constant(effort: FloatArray, velocity: FloatArray, joint: str) -> list[Finding]:
    """A finding when one joint's effort (n,) has no values, or one value while the joint moves."""
    known = effort if np.isfinite(effort.sum()) else effort[np.isfinite(effort)]
    if known.size == 0:
        return [Finding("log-effort-missing", "error", f"Joint '{joint}' has no effort values.", joint=joint)]
    first = known[0]
    if (known != first).any() or not np.nanmax(np.abs(velocity), initial=0.0) > MOVING_RAD_S:
        return []
    text = f"The effort of joint '{joint}' is {first:g} all the time although the joint moves."
    return [Finding("log-effort-missing", "error", text, joint=joint)]
