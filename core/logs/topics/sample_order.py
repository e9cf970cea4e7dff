"""Samples of one topic in order of recording, whatever order its layouts and channels were decoded in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.logs.messages.decoded_columns import Group
from collaudit.core.logs.signals.clock_set_back import SetBack, straighten
from collaudit.core.logs.signals.impossible_values import garbage_ns
from collaudit.core.numeric.arrays import IntArray

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
