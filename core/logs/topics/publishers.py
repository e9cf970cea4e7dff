"""From decoded groups to publishers, and from publishers to one table: always by joint name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.logs.messages.decoded_columns import QUANTITIES, Decoded, Group
from collaudit.core.logs.signals.clock_set_back import SetBack
from collaudit.core.logs.signals.stamps import interpolate, seconds_since
from collaudit.core.logs.topics.sample_order import clocks_of, in_order
from collaudit.core.numeric.arrays import FloatArray, IntArray


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
        garbage: messages left out for their stamps, as of :class:`~.sample_order.Ordered`.
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
