"""Positions of an arm's joints as compact data, from which the page draws the arm at any time."""

from __future__ import annotations

import zlib
from base64 import b64encode
from collections.abc import Sequence

import numpy as np

from collaudit.core.data.arm_geometry import ArmGeometry
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.reports.plots.signal_data import byte_planes, scale_of, to_steps

#: Steps over a joint's range: a hundredth of a degree over a turn.
_STEPS = 36_000
#: Samples of a contact, and contacts that have them.
_OF_CONTACT, _CONTACTS = 5, 60
_MOST_STEP = 60_000


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
    scales = [scale_of(column, _STEPS) for column in position.T]
    arrays = [np.diff(kept, prepend=0).astype("<u2")]
    arrays += [to_steps(column, *scaled) for column, scaled in zip(position.T, scales, strict=True)]
    data = zlib.compress(b"".join(byte_planes(x) for x in arrays), 9)
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
