"""Samples of one topic in order of recording: their columns, and their clocks without garbage and never set back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from collaudit.core.logs.messages.decoded_columns import Group
from collaudit.core.logs.signals.clock_set_back import SetBack, straighten
from collaudit.core.logs.signals.impossible_values import garbage_ns
from collaudit.core.logs.signals.sample_clock import Clock, of_two_clocks
from collaudit.core.numeric.arrays import BoolArray, IntArray

Breaks = tuple[SetBack, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """Samples of one topic, or of one set of its joints.

    Attributes:
        columns: name to (n, …) values; a quantity that was never present is absent.
        log_ns, stamp_ns: (n,) times of recording and header stamps (None: there are none).
        source: (n,) channel of each sample, or None where there is only one.
        names: j joint names of the log.
        log_breaks, stamp_breaks: where either clock was set back; the stamps above go on after them.
        followed: False where another topic shows breaks of the same clocks and this one does not show the same.
        garbage: (how many, of how many, the first's number from 1) messages left out, whose stamps are no times of
            this recording; None where there are none.
    """

    columns: dict[str, NDArray[Any]]
    log_ns: IntArray
    stamp_ns: IntArray | None
    source: IntArray | None = None
    names: tuple[str, ...] = ()
    log_breaks: Breaks = ()
    stamp_breaks: Breaks = ()
    followed: bool = True
    garbage: tuple[int, int, int] | None = None

    def at(self, rows: IntArray | BoolArray) -> Series:
        """Some of the samples, or all in another order."""
        return replace(
            self,
            columns={name: values[rows] for name, values in self.columns.items()},
            log_ns=self.log_ns[rows],
            stamp_ns=None if self.stamp_ns is None else self.stamp_ns[rows],
            source=None if self.source is None else self.source[rows],
        )

    def stamps(self, clock: Clock) -> IntArray:
        """(n,) stamps of a clock; times of recording where there are no others."""
        return self.log_ns if clock == "log" or self.stamp_ns is None else self.stamp_ns


def taken(groups: Sequence[Group], name: str) -> NDArray[Any] | None:
    """A column of groups, one after the other, which give it away; None unless all have it."""
    parts = [values for group in groups if (values := group.take(name)) is not None]
    if len(parts) < len(groups):
        return None
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def in_order(
    groups: Sequence[Group],
    columns: dict[str, NDArray[Any]],
    names: tuple[str, ...] = (),
    joints: Series | None = None,
) -> Series:
    """Put samples in order of recording, channel by channel where clocks were set back, without garbage stamps.

    Args:
        groups: of the topic; they give their clocks away.
        columns: name to (n, …) values of their messages, one group after the other.
        names: of the joints.
        joints: the joint states, which show breaks of the same clocks, for another topic.
    """
    log_ns, place = taken(groups, "log_ns"), taken(groups, "place")
    assert log_ns is not None and place is not None, "every message has them"
    source = taken(groups, "source")
    several = source is not None and bool((source != source[0]).any())
    series = Series(columns, log_ns, taken(groups, "stamp_ns"), source if several else None, names)
    garbage = [far for ns in (series.log_ns, series.stamp_ns) if ns is not None and (far := garbage_ns(ns)) is not None]
    if garbage:
        far = np.logical_or.reduce(garbage)
        before = int(np.count_nonzero(place < place[far].min()))
        series = replace(series.at(~far), garbage=(int(far.sum()), far.size, before + 1))
        place = place[~far]
    if (place[1:] < place[:-1]).any():  # messages of other sizes are decoded after each other
        by_place = np.argsort(place, kind="stable") if series.source is None else np.lexsort((place, series.source))
        series = series.at(by_place)
    known = series if joints is None else joints
    log_ns, in_log = _by_channel(series.log_ns, series.source, known.log_breaks)
    followed = len(known.log_breaks or in_log) == len(in_log)
    stamp_ns = series.stamp_ns
    in_stamps: Breaks = ()
    if stamp_ns is not None and not of_two_clocks(stamp_ns, log_ns):
        stamp_ns, in_stamps = _by_channel(stamp_ns, series.source, known.stamp_breaks)
        followed &= len(known.stamp_breaks or in_stamps) == len(in_stamps)
    series = replace(
        series, log_ns=log_ns, stamp_ns=stamp_ns, log_breaks=in_log, stamp_breaks=in_stamps, followed=followed
    )
    return series.at(np.argsort(log_ns, kind="stable")) if (log_ns[1:] < log_ns[:-1]).any() else series


def _by_channel(stamps: IntArray, source: IntArray | None, known: Breaks) -> tuple[IntArray, Breaks]:
    """Straighten each channel; the first that shows a break says how far the others are shifted."""
    if source is None:
        return straighten(stamps, known or None)
    found = known
    out = stamps
    for channel in np.unique(source).tolist():
        mine = np.flatnonzero(source == channel)
        straight, breaks = straighten(stamps[mine], found or None)
        if breaks:
            found = found or breaks
            out = out.copy() if out is stamps else out
            out[mine] = straight
    return out, found if out is not stamps else ()
