"""Joint states that come from several places: publishers that contradict each other, efforts on a topic of their own.

Messages without usable stamps are spaced by the rate that is stated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.errors import LogError
from collaudit.core.findings import Finding
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.signals.sample_clock import interpolate, seconds_since
from collaudit.core.logs.topics.log_topics import Topic
from collaudit.core.logs.topics.topic_series import Series, publishers_of
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import median_of

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
    first = channels[np.argmax(counts)]
    main = source == first
    time_s = seconds_since(stamps_ns, int(stamps_ns[0]))
    for channel in channels[channels != first].tolist():
        other = source == channel
        for quantity, share in (("position", SHARE), ("effort", _MOSTLY)):
            if quantity not in publisher.columns:
                continue
            values = publisher.columns[quantity] * (scale if quantity == "position" else 1.0)
            there = interpolate(time_s[other], time_s[main], values[main])
            known = np.isfinite(there).any(axis=1)
            if known.sum() < _FEW:
                continue
            here = values[other][known]
            floor = SAME_POSITION if quantity == "position" else _EFFORT_SHARE * np.ptp(np.nan_to_num(here), axis=0)
            motion = np.nan_to_num(np.abs(np.gradient(here, axis=0)))
            apart = np.abs(here - there[known]) > _MOTIONS * motion + floor
            # efforts are noisy, each in its own way: one joint must show the difference, not the joints in turn
            found = apart.any(axis=1).mean() if quantity == "position" else apart.mean(axis=0).max()
            if found > share:
                return [_finding(topic, publisher.names, apart, quantity)]
    return []


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


#: A stated rate may be so many times that at which messages were received.
_RATE = 1.25
#: Messages that are written in bursts wait for at most so many of the usual times between two bursts.
_BURSTS = 2.5

#: Messages of one time of recording in a burst: two may be of two publishers. Fewer times tell nothing.
_BURST, _FEWEST = 3, 3


def with_efforts(publishers: Sequence[Series], topic: Topic, keep: frozenset[str], where: str) -> list[Series]:
    """Publishers with the efforts of another topic in place of their own.

    The first, onto whose stamps the others are brought, is the slower one: positions are smooth between two stamps, and
    efforts are not.

    Args:
        publishers: of the joint states.
        topic: of the efforts, decoded; its groups are used up.
        keep: log names wanted.
        where: the log, for messages.

    Raises:
        LogError: it has no efforts of these joints.
    """
    named = tuple(name for key in topic.decoded.groups for name in key.names)
    found = publishers_of(topic.decoded, keep)
    own = [replace(p, columns={"effort": p.columns["effort"]}) for p in found if "effort" in p.columns]
    if not own:
        raise LogError(
            f"the topic {topic.name} holds no efforts of the joints",
            where=where,
            found=f"joints {listed(tuple(dict.fromkeys(named)))}",
            expected=listed(sorted(keep)),
            hint="both topics must name the joints alike; where messages have no names, [log.fields] names gives them",
        )
    rest = [replace(p, columns={name: x for name, x in p.columns.items() if name != "effort"}) for p in publishers]
    slower = own[0].log_ns.shape[0] < rest[0].log_ns.shape[0]
    return [*own, *rest] if slower else [*rest, *own]


def spaced_evenly(series: Series, rate_hz: float, where: str) -> Series:
    """Messages stamped at a stated rate in the order of recording.

    Args:
        series: of one publisher.
        rate_hz: of its messages.
        where: log and topic, for messages.

    Raises:
        LogError: they were received at another rate, or some are missing in between.
    """
    received = seconds_since(series.log_ns, int(series.log_ns[0]))
    time_s = np.arange(received.shape[0]) / rate_hz
    steps = np.diff(np.unique(received))
    if steps.size:
        told = (received.shape[0] - 1) / float(received[-1])
        if not 1.0 / _RATE <= rate_hz / told <= _RATE:
            found = f"{received.shape[0]} messages in {received[-1]:.4g} s: {told:.4g} a second"
            raise LogError(
                f"[log] rate_hz = {rate_hz:g} is not the rate of the messages",
                where=where,
                found=found,
                hint="state the rate at which they were sent; where messages are missing, no rate tells their times",
            )
        late = received - time_s
        late -= np.polynomial.Polynomial.fit(time_s, late, 1)(time_s)
        allowed = _BURSTS * median_of(steps)
        if float(np.ptp(late)) > allowed:
            at = int(np.argmax(np.diff(late)))
            raise LogError(
                "messages are missing, so that no rate tells when the others were taken",
                where=where,
                found=f"{received[at + 1] - received[at]:.3g} s without messages after {received[at]:.4g} s",
                hint="record with stamps in the header, or judge its parts: [log] from_s, to_s",
            )
    stamps = series.log_ns[0] + np.rint(time_s * 1e9).astype(np.int64)
    return replace(series, stamp_ns=stamps, stamp_breaks=())


def check_clocks(series: Series, where: str) -> None:
    """Refuse messages that hold no stamp and were received in bursts: nothing tells when they were taken.

    Args:
        series: of one publisher.
        where: log and topic, for messages.

    Raises:
        LogError: naming the key that states their rate.
    """
    if series.stamp_ns is not None and bool((series.stamp_ns != series.stamp_ns[0]).any()):
        return
    rows, times = series.log_ns.shape[0], int(np.count_nonzero(np.diff(series.log_ns) > 0)) + 1
    if times < _FEWEST or rows < _BURST * times:
        return
    raise LogError(
        "no stamp tells when the messages were taken",
        where=where,
        found=f"no stamps in the header; {rows} messages were received in {times} bursts",
        expected="stamps in the header, or a time of recording for each message",
        hint="state how many messages were sent a second, with your own number: [log] rate_hz = 500.0",
    )
