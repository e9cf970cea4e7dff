"""Samples of one topic in order of recording, and whose they are: always by joint name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.logs.messages.decoded_columns import QUANTITIES, Decoded, Group
from collaudit.core.logs.signals.clock_set_back import SetBack, straighten
from collaudit.core.logs.signals.impossible_values import garbage_ns
from collaudit.core.logs.signals.stamps import interpolate, seconds_since
from collaudit.core.numeric.arrays import FloatArray, IntArray

Breaks = tuple[SetBack, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Ordered:
    """Clocks of one topic in order of recording, never set back.

    Attributes:
        log_ns, stamp_ns: (n,) times of recording and header stamps (None: there are none).
        source: (n,) channel of each sample, or None where there is only one.
        sort: (n,) the order as indices into what was given; None where that was in order.
        log_breaks, stamp_breaks: where either clock was set back.
        garbage: (how many, of how many, the first's number from 1) messages left out, whose stamps are no times of
            this recording; None where there are none.
        followed: False where the breaks of another topic were given and this one does not show the same.
    """

    log_ns: IntArray
    stamp_ns: IntArray | None
    source: IntArray | None
    sort: IntArray | None
    log_breaks: Breaks
    stamp_breaks: Breaks
    followed: bool
    garbage: tuple[int, int, int] | None = None


def clocks_of(groups: Sequence[Group]) -> tuple[IntArray, IntArray | None, IntArray | None, IntArray | None]:
    """Recording times, header stamps, places in the file and channels of stacked groups, which give them away."""
    stamped = all(group.key.stamped for group in groups)
    tagged = all("source" in group.columns for group in groups)
    log_ns = _integers(groups, "log_ns")
    stamp_ns = _integers(groups, "stamp_ns") if stamped else None
    places = _integers(groups, "place")
    ascend = bool((places[1:] >= places[:-1]).all())  # messages of other sizes are decoded after each other
    return log_ns, stamp_ns, None if ascend else places, _integers(groups, "source") if tagged else None


def _integers(groups: Sequence[Group], name: str) -> IntArray:
    parts = [np.asarray(group.take(name), dtype=np.int64) for group in groups]
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def in_order(
    log_ns: IntArray,
    stamp_ns: IntArray | None,
    order: IntArray | None,
    source: IntArray | None,
    log_breaks: Breaks | None = None,
    stamp_breaks: Breaks | None = None,
) -> Ordered:
    """Put samples in order of recording, channel by channel where clocks were set back, without garbage stamps.

    Args:
        log_ns, stamp_ns: (n,) both clocks.
        order: (n,) place in the file, of use within a channel only; None where they stand in that order.
        source: (n,) channel; None where there is only one.
        log_breaks, stamp_breaks: what the joints' topic showed of the same clocks, for another topic.
    """
    found_far = [far for ns in (log_ns, stamp_ns) if ns is not None and (far := garbage_ns(ns)) is not None]
    if found_far:
        far = np.logical_or.reduce(found_far)
        keep = np.flatnonzero(~far)
        first = int(np.argmax(far)) if order is None else int(np.count_nonzero(order < order[far].min()))
        stamps, place, channel = (None if part is None else part[keep] for part in (stamp_ns, order, source))
        found = in_order(log_ns[keep], stamps, place, channel, log_breaks, stamp_breaks)
        kept = keep if found.sort is None else keep[found.sort]
        return replace(found, sort=kept, garbage=(int(far.sum()), far.size, first + 1))
    sort = None
    if order is not None:
        sort = np.argsort(order, kind="stable") if source is None else np.lexsort((order, source))
        log_ns, stamp_ns = log_ns[sort], None if stamp_ns is None else stamp_ns[sort]
        source = None if source is None else source[sort]
    log_ns, in_log = _by_channel(log_ns, source, log_breaks)
    in_stamps: Breaks = ()
    if stamp_ns is not None:
        stamp_ns, in_stamps = _by_channel(stamp_ns, source, stamp_breaks)
    followed = len(log_breaks or in_log) == len(in_log)
    followed &= stamp_ns is None or len(stamp_breaks or in_stamps) == len(in_stamps)
    if (log_ns[1:] < log_ns[:-1]).any():
        later = np.argsort(log_ns, kind="stable")
        log_ns, stamp_ns = log_ns[later], None if stamp_ns is None else stamp_ns[later]
        source = None if source is None else source[later]
        sort = later if sort is None else sort[later]
    return Ordered(log_ns, stamp_ns, source, sort, in_log, in_stamps, followed)


def _by_channel(stamps: IntArray, source: IntArray | None, known: Breaks | None) -> tuple[IntArray, Breaks]:
    """Straighten each channel; the first that shows a break says how far the others are shifted."""
    if source is None:
        return straighten(stamps, known or None)
    found: Breaks = known or ()
    out = stamps
    for channel in np.unique(source).tolist():
        mine = np.flatnonzero(source == channel)
        straight, breaks = straighten(stamps[mine], found or None)
        if breaks:
            found = found or breaks
            out = out.copy() if out is stamps else out
            out[mine] = straight
    return out, found if out is not stamps else ()


@dataclass(slots=True, eq=False)
class Publisher:
    """Samples of one set of joints, in order of recording.

    Attributes:
        names: j joint names of the log.
        log_ns: (n,) recording times.
        stamp_ns: (n,) header stamps, or None when there are none.
        columns: quantity to (n, j) values; a quantity that was never present is absent.
        log_breaks, stamp_breaks: where either clock was set back; the stamps above go on after them.
        source: (n,) channel of each sample, or None where the topic has only one.
        garbage: messages left out for their stamps, as of :class:`Ordered`.
    """

    names: tuple[str, ...]
    log_ns: IntArray
    stamp_ns: IntArray | None
    columns: dict[str, FloatArray]
    log_breaks: tuple[SetBack, ...] = ()
    stamp_breaks: tuple[SetBack, ...] = ()
    source: IntArray | None = None
    garbage: tuple[int, int, int] | None = None


def publishers_of(decoded: Decoded, keep: frozenset[str] | None = None) -> list[Publisher]:
    """Sort a topic's groups into publishers; groups that share a joint belong to one publisher.

    Args:
        decoded: the groups; they are used up.
        keep: log names wanted; None keeps all.

    Returns:
        Publishers with at least one wanted joint, the one with most samples first.
    """
    clusters: list[tuple[set[str], list[Group]]] = []
    for group in decoded.groups.values():
        names = set(group.key.names) if keep is None else set(group.key.names) & keep
        if not names:
            continue
        joined = [cluster for cluster in clusters if cluster[0] & names]
        merged = (names.union(*(c[0] for c in joined)), [g for c in joined for g in c[1]] + [group])
        clusters = [cluster for cluster in clusters if cluster not in joined] + [merged]
    out = [_publisher(groups, names) for names, groups in clusters]
    decoded.groups.clear()
    return sorted(out, key=lambda publisher: -publisher.log_ns.shape[0])


def _publisher(groups: list[Group], wanted: set[str]) -> Publisher:
    """Stack groups that share joints; columns are permuted by name, what a group lacks is NaN."""
    names = tuple(dict.fromkeys(name for group in sorted(groups, key=lambda g: -g.rows) for name in group.key.names))
    names = tuple(name for name in names if name in wanted)
    present = [q for q in QUANTITIES if any(q in dict(group.key.present) for group in groups)]
    rows = [group.rows for group in groups]
    columns = {quantity: _stack(groups, rows, quantity, names) for quantity in present}
    ordered = in_order(*clocks_of(groups))
    sort = ordered.sort
    if sort is not None:
        columns = {quantity: values[sort] for quantity, values in columns.items()}
    publisher = Publisher(
        names=names,
        log_ns=ordered.log_ns,
        stamp_ns=ordered.stamp_ns,
        columns=columns,
        log_breaks=ordered.log_breaks,
        stamp_breaks=ordered.stamp_breaks,
        source=ordered.source,
        garbage=ordered.garbage,
    )
    if len(groups) > 1 and len({_holds(group, names) for group in groups}) > 1:
        _fill(publisher, groups, rows, sort)
    return publisher


def _holds(group: Group, names: tuple[str, ...]) -> tuple[tuple[str, ...], bool]:
    """Which of the joints a group names, and whether with positions."""
    return tuple(name for name in names if name in group.key.names), "position" in dict(group.key.present)


def _stack(groups: Sequence[Group], rows: Sequence[int], quantity: str, names: tuple[str, ...]) -> FloatArray:
    if len(groups) == 1 and groups[0].key.names == names:
        return np.asarray(groups[0].take(quantity), dtype=np.float64)
    out = np.full((sum(rows), len(names)), np.nan)
    start = 0
    for group, count in zip(groups, rows, strict=True):
        values = group.take(quantity)
        if values is not None:
            pairs = [(i, group.key.names.index(name)) for i, name in enumerate(names) if name in group.key.names]
            target, source = (list(part) for part in zip(*pairs, strict=True))
            out[start : start + count, target] = values[:, source]
        start += count
    return out


def _fill(publisher: Publisher, groups: Sequence[Group], rows: Sequence[int], sort: IntArray | None) -> None:
    """Fill what other messages of the same publisher hold; rows without positions then have served their purpose.

    A value that a message did give, even if it is not a number, is never replaced.
    """
    stamps = publisher.stamp_ns if publisher.stamp_ns is not None else publisher.log_ns
    time_s = seconds_since(stamps, int(stamps[0]))
    origin = np.repeat(np.arange(len(groups)), rows)
    origin = origin if sort is None else origin[sort]
    for quantity, values in publisher.columns.items():
        for index, name in enumerate(publisher.names):
            given = np.array([name in g.key.names and quantity in dict(g.key.present) for g in groups])[origin]
            if given.any() and not given.all():
                column = values[:, index]
                column[~given] = interpolate(time_s[~given], time_s[given], column[given, None])[:, 0]
    placed = np.array(["position" in dict(group.key.present) for group in groups])[origin]
    if placed.any() and not placed.all():
        publisher.log_ns = publisher.log_ns[placed]
        publisher.stamp_ns = publisher.stamp_ns[placed] if publisher.stamp_ns is not None else None
        publisher.source = publisher.source[placed] if publisher.source is not None else None
        publisher.columns = {quantity: values[placed] for quantity, values in publisher.columns.items()}
