"""Samples of one topic in order of recording: their columns, and their clocks without garbage and never set back.

Of joint states they are sorted into publishers, always by joint name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from collaudit.core.logs.messages.message_decoding import Decoded, Group
from collaudit.core.logs.signals.sample_clock import Clock, garbage_ns, interpolate, of_two_clocks, seconds_since
from collaudit.core.logs.signals.signal_names import QUANTITIES
from collaudit.core.logs.signals.stamp_conflicts import SetBack, straighten
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray

Breaks = tuple[SetBack, ...]
#: The column that tells the groups of a publisher apart.
_GROUP = "group"


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
        garbage: which of the messages in their order were left out, as their stamps are no times of this recording;
            None where none was.
    """

    columns: dict[str, NDArray[Any]]
    log_ns: IntArray
    stamp_ns: IntArray | None
    source: IntArray | None = None
    names: tuple[str, ...] = ()
    log_breaks: Breaks = ()
    stamp_breaks: Breaks = ()
    followed: bool = True
    garbage: BoolArray | None = None

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
        series = replace(series.at(~far), garbage=far[np.argsort(place)])
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
    found, shown = known, False
    out = stamps.copy()
    for mine in [np.ones(stamps.size, np.bool_)] if source is None else [source == key for key in np.unique(source)]:
        out[mine], breaks = straighten(stamps[mine], found or None)
        found, shown = found or breaks, shown or bool(breaks)
    return out, found if shown else ()


def publishers_of(decoded: Decoded, keep: frozenset[str]) -> list[Series]:
    """Sort a topic's groups into publishers; groups that share a joint belong to one publisher.

    Args:
        decoded: the groups; they are used up.
        keep: log names wanted.

    Returns:
        Publishers with at least one wanted joint, the one with most samples first.
    """
    clusters: list[tuple[set[str], list[Group]]] = []
    for group in decoded.groups.values():
        names = set(group.key.names) & keep
        if not names:
            continue
        joined = [cluster for cluster in clusters if cluster[0] & names]
        merged = (names.union(*(c[0] for c in joined)), [g for c in joined for g in c[1]] + [group])
        clusters = [cluster for cluster in clusters if cluster not in joined] + [merged]
    out = [_publisher(groups, names) for names, groups in clusters]
    decoded.groups.clear()
    return sorted(out, key=lambda publisher: -publisher.log_ns.shape[0])


def _publisher(groups: list[Group], wanted: set[str]) -> Series:
    """Stack groups that share joints; columns are permuted by name, what a group lacks is NaN."""
    names = tuple(dict.fromkeys(name for group in sorted(groups, key=lambda g: -g.rows) for name in group.key.names))
    names = tuple(name for name in names if name in wanted)
    present = [q for q in QUANTITIES if any(q in dict(group.key.present) for group in groups)]
    rows = [group.rows for group in groups]
    columns = {quantity: _stack(groups, rows, quantity, names) for quantity in present}
    if len({_holds(group, names) for group in groups}) == 1:
        return in_order(groups, columns, names)
    own = np.repeat(np.arange(len(groups)), rows)
    return _filled(in_order(groups, {**columns, _GROUP: own}, names), groups)


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
        for index, name in enumerate(names):
            if values is not None and name in group.key.names:
                out[start : start + count, index] = values[:, group.key.names.index(name)]
        start += count
    return out


def _filled(publisher: Series, groups: Sequence[Group]) -> Series:
    """Fill what other messages of the same publisher hold; rows without positions then have served their purpose.

    A value that a message did give, even if it is not a number, is never replaced.
    """
    columns = dict(publisher.columns)
    own = columns.pop(_GROUP)
    stamps = publisher.stamps("header")
    time_s = seconds_since(stamps, int(stamps[0]))
    for quantity, values in columns.items():
        for index, name in enumerate(publisher.names):
            given = np.array([name in g.key.names and quantity in dict(g.key.present) for g in groups])[own]
            if given.any() and not given.all():
                column = values[:, index]
                column[~given] = interpolate(time_s[~given], time_s[given], column[given, None])[:, 0]
    placed = np.array(["position" in dict(group.key.present) for group in groups])[own]
    filled = replace(publisher, columns=columns)
    return filled.at(placed) if placed.any() else filled
