"""Publishers of one topic: whose its samples are, always by joint name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.logs.messages.decoded_columns import QUANTITIES, Decoded, Group
from collaudit.core.logs.signals.stamps import interpolate, seconds_since
from collaudit.core.logs.topics.topic_series import Series, in_order
from collaudit.core.numeric.arrays import FloatArray

#: The column that tells the groups of a publisher apart.
_GROUP = "group"


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
