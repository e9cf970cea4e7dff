"""Joints' curves and positions as compact data for the page's own plots: few samples, every extreme among them."""

from __future__ import annotations

import zlib
from base64 import b64encode
from collections.abc import Sequence

import numpy as np

from collaudit.core.data.signals import ArmGeometry, State
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.reports.plots.joint_trace import JointTrace, extremes, in_steps
from collaudit.reports.plots.plot_contact import model_range

#: Samples that a window has at least, where it has so many.
_LEAST_OF_WINDOW = 40
#: Step of positions in which the arm is drawn, rad or m: a hundredth of a degree.
_POSE_STEP = 2.0**-13
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
    """The curves at some samples, as of :func:`_deflated`.

    In order: steps to the next sample; residual, measured, least and most modelled torque, γ in force; a number of the
    state: 0 alarms above γ, 1 friction known only as a range, 2 not judged.
    """
    codes = trace.state[kept]
    state = np.where(codes == State.JUDGED, 0, np.where(codes == State.FRICTION_INTERVAL, 1, 2))
    torques = (trace.measured_nm[kept], *model_range(trace, kept))
    return _deflated([_steps(kept), trace.residual_nm[kept], *torques, trace.gamma_nm[kept], state])


def _steps(kept: IntArray) -> IntArray:
    return np.asarray(np.diff(kept, prepend=0), dtype=np.int64)


def _deflated(columns: Sequence[np.ndarray]) -> dict[str, object]:
    """How many numbers a column has, and ``data``: base64 of all columns, deflated, 32-bit floats, NaN where not known.

    Bytes of equal weight stand together: the high ones repeat themselves, which deflating makes use of.
    """
    numbers = np.array(columns, dtype="<f4")
    planes = np.moveaxis(numbers.view(np.uint8).reshape(*numbers.shape, 4), 2, 1)
    return {"kept": numbers.shape[1], "data": b64encode(zlib.compress(planes.tobytes(), 9)).decode("ascii")}


def pose_samples(count: int, period_s: float, points: int, contacts_s: Sequence[tuple[float, float]]) -> IntArray:
    """Samples at which the arm is drawn; between them the page goes straight.

    Args:
        count, period_s: of the log's samples.
        points: spread evenly over the log.
        contacts_s: start and end of stretches that have some of their own, in this order.
    """
    even = np.linspace(0, count - 1, min(count, points))
    around = [np.linspace(a, b, _OF_CONTACT) / period_s for a, b in contacts_s[:_CONTACTS]]
    kept = np.unique(np.rint(np.concatenate([even, *around])).astype(np.int64))
    return np.asarray(kept[(kept >= 0) & (kept < count)], dtype=np.int64)


def pose_block(arm: ArmGeometry, joints: Sequence[str], position: FloatArray, kept: IntArray) -> dict[str, object]:
    """Kinematics, and positions at some samples.

    The columns of :func:`_deflated` are steps to the next sample, then each joint's position.

    Args:
        arm: its kinematics.
        joints: names of the columns of ``position``.
        position: (n, j) at the samples, rad or m.
        kept: (n,) the samples.
    """
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
    return {"links": links, "tool": tool, "joints": len(joints)} | _deflated(
        [_steps(kept), *in_steps(position.T, _POSE_STEP)]
    )
