"""Joints' curves and positions as compact data for the page's own plots: few samples, every extreme among them."""

from __future__ import annotations

import zlib
from base64 import b64encode
from collections.abc import Sequence

import numpy as np

from collaudit.core.data.arm_geometry import ArmGeometry
from collaudit.core.data.signals import State
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.reports.plots.joint_trace import JointTrace, Series, extremes
from collaudit.reports.plots.plot_contact import model_range

#: What a value that is not known reads as among the coarse ones.
UNKNOWN = 65535
_MOST_STEP = 60_000
#: Steps over the range of the residual and of the torques: finer than a plot shows, and small when deflated.
_FINE, _COARSE = 4_095, 1_023
#: Samples that a window has at least, where it has so many.
_LEAST_OF_WINDOW = 40
#: Steps over a joint's range: a hundredth of a degree over a turn.
_POSE_STEPS = 36_000
#: Samples of a contact, and contacts that have them.
_OF_CONTACT, _CONTACTS = 5, 60


def kept_samples(trace: JointTrace, points: int, windows_s: Sequence[tuple[float, float]], most: int) -> IntArray:
    """Samples that stand for the joint: extremes of what was judged, of what was not, and of the measured torque.

    Args:
        trace: of the joint.
        points: about how many, over the whole log.
        windows_s: stretches of which more is kept, in this order, as long as there is room: every sample of short
            ones, extremes of those longer than their share of the room.
        most: about how many samples these windows may take together.
    """
    n = len(trace.time_s)
    if n <= points:
        return np.arange(n)
    out = ~(trace.judged | trace.standing)
    shown = trace.residual_nm.astype(np.float32)
    found = [np.array([0, n - 1])]
    for mask, share in ((trace.judged, 0.5), (trace.standing, 0.15), (out, 0.1)):
        found.append(extremes(np.where(mask, shown, np.float32(np.nan)), round(share * points)))
    found.append(extremes(trace.measured_nm, round(0.25 * points)))
    found += _in_windows(trace, windows_s, most)
    kept = np.unique(np.concatenate(found))
    return np.asarray(kept[(kept >= 0) & (kept < n)], dtype=np.int64)


def _in_windows(trace: JointTrace, windows_s: Sequence[tuple[float, float]], most: int) -> list[IntArray]:
    """Samples inside of windows; each has an even share of the room, and what shorter ones leave of theirs."""
    found, room = [], most
    for k, (start, stop) in enumerate(windows_s[: most // _LEAST_OF_WINDOW]):
        share = max(_LEAST_OF_WINDOW, room // (min(len(windows_s), most // _LEAST_OF_WINDOW) - k))
        a, b = (int(i) for i in np.searchsorted(trace.time_s, [start, stop]))
        every = np.arange(a, b)
        inside = every if b - a <= share else a + extremes(np.ascontiguousarray(trace.residual_nm[a:b]), share)
        found.append(inside)
        room -= len(inside)
    return found


def packed(trace: JointTrace, kept: IntArray) -> dict[str, object]:
    """The curves at some samples: ``data``, base64 of a deflated run of arrays, and what they mean.

    In order, each of ``kept`` numbers, of uint16 all low bytes before all high ones: uint16 steps to the next sample;
    uint16 ``residual``, ``measured``, ``least`` and ``most`` (of the modelled torque), ``gamma`` in force, each a value
    of ``from`` plus so many ``step``, 65535 where not known; uint8 state: 0 alarms above γ, 1 friction known only as a
    range, 2 not judged.
    """
    kept = _with_steps(kept)
    codes = trace.state[kept]
    state = np.where(codes == State.JUDGED, 0, np.where(codes == State.FRICTION_INTERVAL, 1, 2)).astype(np.uint8)
    least, most = model_range(trace, kept)
    measured = trace.measured_nm[kept].astype(np.float64)
    residual = trace.residual_nm[kept]
    gamma = trace.gamma_nm[kept].astype(np.float64)
    low, step = _scale_of(residual, _FINE)
    level, level_step = _scale_of(gamma, _FINE)
    torque_low, torque_step = _scale_of(np.concatenate([measured, least, most]), _COARSE)
    arrays = [
        np.diff(kept, prepend=0).astype("<u2"),
        _same_side_of_gamma(_to_steps(residual, low, step), residual, low, step, gamma),
        *(_to_steps(x, torque_low, torque_step) for x in (measured, least, most)),
        _to_steps(gamma, level, level_step),
        state,
    ]
    data = zlib.compress(b"".join(_byte_planes(x) for x in arrays), 9)
    return {
        "kept": len(kept),
        "data": b64encode(data).decode("ascii"),
        "residual": [low, step],
        "torque": [torque_low, torque_step],
        "gamma": [level, level_step],
    }


def _byte_planes(values: np.ndarray) -> bytes:
    """Bytes of equal weight together: the high ones repeat themselves, which deflating makes use of."""
    return np.ascontiguousarray(values).view(np.uint8).reshape(len(values), -1).T.tobytes()


def _with_steps(kept: IntArray) -> IntArray:
    """The samples and some between those that lie further apart than a uint16 can say."""
    wide = np.flatnonzero(np.diff(kept, prepend=0) > _MOST_STEP)
    between = [np.arange(kept[k - 1] if k else 0, kept[k], _MOST_STEP) for k in wide]
    return np.asarray(np.unique(np.concatenate([kept, *between])), dtype=np.int64)


def _scale_of(values: FloatArray, steps: int) -> tuple[float, float]:
    """Least value and the size of a step, so that so many steps reach the greatest."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    return low, (high - low) / steps or 1.0


def _same_side_of_gamma(
    steps: np.ndarray, values: FloatArray, low: float, step: float, gamma_nm: FloatArray
) -> np.ndarray:
    """Steps moved by one where rounding has carried a residual over its threshold, in or out."""
    shown = low + step * steps
    over = (np.abs(values) > gamma_nm) & (np.abs(shown) <= gamma_nm)
    under = (np.abs(values) <= gamma_nm) & (np.abs(shown) > gamma_nm) & (steps < UNKNOWN)
    away = np.where(values >= 0, 1, -1)
    moved = steps.astype(np.int64) + np.where(over, away, 0) - np.where(under, away, 0)
    return np.clip(moved, 0, UNKNOWN).astype("<u2")


def _to_steps(values: Series, low: float, step: float) -> np.ndarray:
    """Values in whole steps, 65535 where not known."""
    whole = np.rint((values - low) / step)
    return np.where(np.isfinite(whole), whole, UNKNOWN).astype("<u2")


def pose_samples(count: int, period_s: float, points: int, contacts_s: Sequence[tuple[float, float]]) -> IntArray:
    """Samples at which the arm is drawn; between them the page goes straight.

    Args:
        count, period_s: of the log's samples.
        points: spread evenly over the log.
        contacts_s: start and end of stretches that have some of their own, in this order.
    """
    even = np.linspace(0, count - 1, min(count, max(points, count // _MOST_STEP + 2)))
    around = [np.linspace(a, b, _OF_CONTACT) / period_s for a, b in contacts_s[:_CONTACTS]]
    kept = np.unique(np.rint(np.concatenate([even, *around])).astype(np.int64))
    return np.asarray(kept[(kept >= 0) & (kept < count)], dtype=np.int64)


def pose_block(arm: ArmGeometry, joints: Sequence[str], position: FloatArray, kept: IntArray) -> dict[str, object]:
    """Kinematics, and positions at some samples.

    ``data`` is base64 of a deflated run of arrays of uint16, all low bytes before all high ones: steps to the next
    sample, then each joint's position, a value of ``from`` plus so many ``step``, 65535 where not known.

    Args:
        arm: its kinematics.
        joints: names of the columns of ``position``.
        position: (n, j) at the samples, rad or m.
        kept: (n,) the samples.
    """
    scales = [_scale_of(column, _POSE_STEPS) for column in position.T]
    arrays = [np.diff(kept, prepend=0).astype("<u2")]
    arrays += [_to_steps(column, *scaled) for column, scaled in zip(position.T, scales, strict=True)]
    data = zlib.compress(b"".join(_byte_planes(x) for x in arrays), 9)
    links = [
        [
            -1 if link.joint is None else joints.index(link.joint),
            link.parent,
            int(link.prismatic),
            link.factor,
            link.offset,
            [round(x, 6) for x in link.rotation],
            [round(x, 5) for x in link.translation_m],
        ]
        for link in arm.links
    ]
    tool = [arm.tool_link, [round(x, 5) for x in arm.tool_m]]
    return {"links": links, "tool": tool, "kept": len(kept), "scale": scales, "data": b64encode(data).decode("ascii")}
