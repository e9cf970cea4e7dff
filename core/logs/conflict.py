"""Publishers on one topic that name the same joints and say different things of them."""

from __future__ import annotations

import numpy as np

from collaudit.core.findings import Finding
from collaudit.core.logs.publishers import Publisher, interpolate, seconds_since
from collaudit.core.series import BoolArray, FloatArray, IntArray

#: Positions closer than this (rad, or m) may be the same measurement.
SAME_POSITION = 5e-3
#: A sample may differ by so many times what the joint moves around it.
_MOTIONS = 5
#: From this share of the samples on, two publishers disagree.
SHARE = 0.05
_FEW = 20
#: Of a long log so many blocks of so many samples are looked at for springing positions.
_BLOCKS, _BLOCK = 64, 512


def disagreement(publisher: Publisher, stamps_ns: IntArray, scale: float, topic: str) -> list[Finding]:
    """An error where channels of one topic give the same joints other positions at the same time.

    Args:
        publisher: samples of one set of joints; each keeps its channel where there are several.
        stamps_ns: (n,) its stamps.
        scale: rad (or m) in the unit of its positions.
        topic: for the finding.
    """
    source, position = publisher.source, publisher.columns.get("position")
    if source is None or position is None:
        return []
    channels, counts = np.unique(source, return_counts=True)
    main = source == channels[np.argmax(counts)]
    time_s = seconds_since(stamps_ns, int(stamps_ns[0]))
    for channel in channels.tolist():
        other = source == channel
        if bool((other & main).any()):
            continue
        there = interpolate(time_s[other], time_s[main], position[main])
        apart = _apart(np.abs(position[other] - there) * scale, position[other] * scale)
        known = np.isfinite(there).any(axis=1)
        if known.sum() >= _FEW and apart[known].any(axis=1).mean() > SHARE:
            return [_finding(topic, publisher.names, apart[known])]
    return []


def _apart(difference: FloatArray, position: FloatArray) -> BoolArray:
    motion = np.abs(np.gradient(position, axis=0)) if position.shape[0] > 1 else np.zeros_like(position)
    return np.asarray(difference > _MOTIONS * np.nan_to_num(motion) + SAME_POSITION)


def alternation(position: FloatArray, names: tuple[str, ...], topic: str) -> list[Finding]:
    """An error where positions spring between two courses, as two publishers on one channel make them.

    Args:
        position: (n, j) rad, in order of recording.
        names: of the joints.
        topic: for the finding.
    """
    if position.shape[0] < _FEW:
        return []
    count = position.shape[0]
    starts = [0] if count <= _BLOCKS * _BLOCK else np.linspace(0, count - _BLOCK, _BLOCKS).astype(np.int64).tolist()
    length = count if len(starts) == 1 else _BLOCK
    apart = np.concatenate([_springs(position[start : start + length]) for start in starts])
    return [_finding(topic, names, apart)] if (apart.mean(axis=0) > SHARE).any() else []


def _springs(position: FloatArray) -> BoolArray:
    """(n - 2, j) where a sample lies further from its neighbours than they move."""
    moved = np.abs(position[2:] - position[:-2])
    off = np.abs(position[1:-1] - 0.5 * (position[2:] + position[:-2]))
    return np.asarray(off > _MOTIONS * moved + SAME_POSITION)


def _finding(topic: str, names: tuple[str, ...], apart: BoolArray) -> Finding:
    joint = names[int(np.argmax(apart.sum(axis=0)))]
    text = (
        f"Several publishers on the topic give different positions of the same joints (in "
        f"{apart.any(axis=1).mean():.0%} of the samples, {joint} first of all): nothing can be judged."
        " Record each on a topic of its own."
    )
    return Finding("log-publishers-conflict", "error", text, where=topic, joint=joint)
