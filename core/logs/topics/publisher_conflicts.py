"""Publishers on one topic that name the same joints and say different things of them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from collaudit.core.findings import Finding
from collaudit.core.logs.signals.stamps import interpolate, seconds_since
from collaudit.core.logs.topics.topic_series import Series
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray

#: Positions closer than this (rad, or m) may be the same measurement.
SAME_POSITION = 5e-3
#: A sample may differ by so many times what the joint moves around it.
_MOTIONS = 5
#: From this share of the samples on, two publishers disagree.
SHARE = 0.05
_FEW = 20
#: A share of the samples in which smaller differences, and those of efforts, must show.
_MOSTLY = 0.5
#: Positions (rad, or m) this close spring for their resolution; so do efforts this close, as a share of their range.
_SMALL_POSITION, _EFFORT_SHARE = 2e-4, 0.02
#: Of a long log so many blocks of so many samples are looked at for springing positions.
_BLOCKS, _BLOCK = 64, 512


# Values may be anything that a message can hold.
_any_value = np.errstate(over="ignore", invalid="ignore")


@_any_value
def disagreement(publisher: Series, stamps_ns: IntArray, scale: float, topic: str) -> list[Finding]:
    """An error where channels of one topic give the same joints other positions or efforts at the same time.

    Args:
        publisher: samples of one set of joints; each keeps its channel where there are several.
        stamps_ns: (n,) its stamps.
        scale: rad (or m) in the unit of its positions.
        topic: for the finding.
    """
    source = publisher.source
    if source is None:
        return []
    channels, counts = np.unique(source, return_counts=True)
    main = source == channels[np.argmax(counts)]
    time_s = seconds_since(stamps_ns, int(stamps_ns[0]))
    for channel in channels.tolist():
        other = source == channel
        if bool((other & main).any()):
            continue
        for quantity, share in (("position", SHARE), ("effort", _MOSTLY)):
            values = publisher.columns.get(quantity)
            if values is None:
                continue
            there = interpolate(time_s[other], time_s[main], values[main])
            known = np.isfinite(there).any(axis=1)
            if known.sum() < _FEW:
                continue
            here = values[other][known]
            floor, unit = SAME_POSITION, scale
            if quantity == "effort":
                floor, unit = _EFFORT_SHARE * np.ptp(np.nan_to_num(here), axis=0), 1.0
            apart = _apart(np.abs(here - there[known]) * unit, here * unit, floor)
            # efforts are noisy, each in its own way: one joint must show the difference, not the joints in turn
            found = apart.any(axis=1).mean() if quantity == "position" else apart.mean(axis=0).max()
            if found > share:
                return [_finding(topic, publisher.names, apart, quantity)]
    return []


def _apart(difference: FloatArray, values: FloatArray, floor: float | FloatArray) -> BoolArray:
    motion = np.abs(np.gradient(values, axis=0)) if values.shape[0] > 1 else np.zeros_like(values)
    return np.asarray(difference > _MOTIONS * np.nan_to_num(motion) + floor)


@_any_value
def alternation(columns: Mapping[str, FloatArray], names: tuple[str, ...], topic: str) -> list[Finding]:
    """An error where positions or efforts spring between two courses, as two publishers on one channel make them.

    Positions far apart need few such samples. Those closer than ``SAME_POSITION``, and efforts, which are noisy, must
    go to and fro from sample to sample most of the time.

    Args:
        columns: quantity to (n, j), in order of recording; positions in rad.
        names: of the joints.
        topic: for the finding.
    """
    position = columns["position"]
    if position.shape[0] < _FEW:
        return []
    parts = _parts(position.shape[0])
    apart = np.concatenate([_off_neighbours(position[part], SAME_POSITION)[1] for part in parts])
    if (apart.mean(axis=0) > SHARE).any():
        return [_finding(topic, names, apart)]
    for quantity in ("position", "effort"):
        values = columns.get(quantity)
        if values is None:
            continue
        floor = np.full(len(names), _SMALL_POSITION)
        if quantity == "effort":
            looked = np.concatenate([values[part] for part in parts])
            floor = _EFFORT_SHARE * (np.fmax.reduce(looked, axis=0) - np.fmin.reduce(looked, axis=0))
        turns = np.concatenate([_turns(values[part], floor) for part in parts])
        if (turns.mean(axis=0) > _MOSTLY).any():
            return [_finding(topic, names, turns, quantity)]
    return []


def _parts(count: int) -> list[slice]:
    """The whole of a short log, blocks of a long one."""
    if count <= _BLOCKS * _BLOCK:
        return [slice(0, count)]
    return [slice(start, start + _BLOCK) for start in np.linspace(0, count - _BLOCK, _BLOCKS).astype(np.int64).tolist()]


def _turns(values: FloatArray, floor: FloatArray) -> BoolArray:
    """(n - 3, j) where a sample lies off its neighbours, the one before off the other way, and both far."""
    off, far = _off_neighbours(values, floor)
    return np.asarray(far[1:] & far[:-1] & ((off[1:] < 0) != (off[:-1] < 0)))


def _off_neighbours(values: FloatArray, floor: float | FloatArray) -> tuple[FloatArray, BoolArray]:
    """(n - 2, j) how far a sample lies from the middle of its neighbours, and whether further than they move."""
    moved = np.abs(values[2:] - values[:-2])
    off = values[1:-1] - 0.5 * (values[2:] + values[:-2])
    return off, np.asarray(np.abs(off) > _MOTIONS * moved + floor)


def _finding(topic: str, names: tuple[str, ...], apart: BoolArray, quantity: str = "position") -> Finding:
    joint = names[int(np.argmax(apart.sum(axis=0)))]
    text = (
        f"Several publishers on the topic give different {quantity}s of the same joints (in "
        f"{apart.any(axis=1).mean():.0%} of the samples, {joint} first of all): nothing can be judged."
        " Record each on a topic of its own."
    )
    return Finding("log-publishers-conflict", "error", text, where=topic, joint=joint)
