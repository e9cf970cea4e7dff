"""Rows and samples that were lost: one without the position of every joint is a lost row; single holes are bridged.

The model's torque of any joint takes the positions of all. A missing velocity is derived (``velocity_choice.py``); a
missing effort is its joint's alone. A hole is bridged where it is short against the filter's band, and marked.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import NotJudgedError
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.parallel import each


def positions_known(log: JointLog) -> BoolArray:
    """(n,) rows with the position of every joint."""
    if np.isfinite(log.position_rad.sum()):
        return np.ones(log.time_s.size, dtype=np.bool_)
    return np.asarray(np.isfinite(log.position_rad).all(axis=1))


def with_positions(log: JointLog) -> JointLog:
    """The log without the rows that lack the position of a joint; unchanged where none does.

    Args:
        log: (n, j) signals.

    Raises:
        NotJudgedError: a joint has no position in any row.
    """
    known = positions_known(log)
    if known.all():
        return log
    if not known.any():
        never = [
            joint for joint, x in zip(log.joint_names, log.position_rad.T, strict=True) if not np.isfinite(x).any()
        ]
        named = ", ".join(f"'{joint}'" for joint in never)
        raise NotJudgedError(
            "no row of the log holds the positions of all joints",
            where=log.source.name,
            found=f"no position of {named} in any row" if named else "rows that each lack a joint's position",
            expected="the position of every joint of the model, in the same row",
            hint="check [log.csv] position or [log] joint_states: another column or topic may hold the positions",
        )
    return log.samples(known)


def lost_ends_s(log: JointLog) -> float:
    """Time before the first and after the last row that holds the position of every joint, s."""
    known = positions_known(log)
    stamped = np.isfinite(log.time_s)
    if known.all() or not (known & stamped).any():
        return 0.0
    whole, kept = log.time_s[stamped], log.time_s[known & stamped]
    return float(np.ptp(whole) - np.ptp(kept))


def missing_findings(log: JointLog) -> Iterator[Finding]:
    """How many positions and efforts of each joint are missing."""
    for name, values, so in (
        ("position", log.position_rad, "; rows without one count as lost"),
        ("effort", log.effort, ""),
    ):
        if values is None or np.isfinite(values.sum()):
            continue
        for joint, bad in zip(log.joint_names, np.count_nonzero(~np.isfinite(values), axis=0).tolist(), strict=True):
            if bad:
                text = f"{bad} of {len(values)} {name} values of joint '{joint}' are missing or not a number{so}."
                yield Finding("log-nan", "warning", text, joint=joint)


#: The longest step over several lost samples, and over a single one, in periods of the filter's band.
SEVERAL, _SINGLE = 0.25, 0.4
#: From this share of bridged samples on it is a warning.
_MANY = 0.05


def bridged_steps(steps: FloatArray, period_s: float, limit_s: float, bandwidth_hz: float) -> BoolArray:
    """(n - 1,) steps that are too long for one period and short enough to be bridged.

    Args:
        steps: between stamps, s.
        period_s: sample period, s.
        limit_s: a longer step lost samples.
        bandwidth_hz: of the filters that the samples pass.
    """
    slack = 0.05 * period_s
    single = steps <= min(2.5 * period_s, _SINGLE / bandwidth_hz + slack)
    return np.asarray((steps > limit_s) & (single | (steps <= SEVERAL / bandwidth_hz + slack)))


def filled(rows: FloatArray, places: IntArray, count: int, smooth: bool) -> FloatArray:
    """(count, j) rows at every place, those between interpolated: straight, or by a cubic through two on either side.

    Args:
        rows: (m, j) recorded values.
        places: (m,) their places, ascending from 0.
        count: number of places.
        smooth: positions, of which second derivatives are taken.
    """
    out = np.empty((count, rows.shape[1]), order="F")
    at = np.arange(count, dtype=np.float64)
    out[places] = rows
    missing = np.ones(count, dtype=bool)
    missing[places] = False
    holes = np.flatnonzero(missing)
    right = np.searchsorted(places, holes)
    cubic = smooth & (right >= 2) & (right + 1 < places.size)
    for j in range(rows.shape[1]):
        out[holes, j] = np.interp(at[holes], places, rows[:, j])
    k, x = right[cubic], at[holes[cubic]]
    if k.size:
        nodes = [places[k + o].astype(np.float64) for o in (-2, -1, 0, 1)]
        out[holes[cubic]] = through(x, nodes, [rows[k + o] for o in (-2, -1, 0, 1)])
    return out


def through(x: FloatArray, nodes: Sequence[FloatArray], values: Sequence[FloatArray]) -> FloatArray:
    """(m, j) at places (m,) the polynomial through values (m, j) at nodes (m,), each place with its own."""
    out = np.zeros(values[0].shape)
    for node, rows in zip(nodes, values, strict=True):
        weight = np.ones_like(x)
        for other in nodes:
            if other is not node:
                weight = weight * (x - other) / (node - other)
        out = out + weight[:, None] * rows
    return out


def bridged_findings(count: int, holes: int, total: int, longest_s: float) -> list[Finding]:
    """How many samples were bridged.

    Args:
        count: samples that were put in; holes: how many holes they fill.
        total: samples with them.
        longest_s: the longest step that was bridged, s.
    """
    if not count:
        return []
    share = count / total
    text = (
        f"{count} lost samples ({100 * share:.2g} %) in {holes} holes of {1e3 * longest_s:.3g} ms at most were bridged "
        "by interpolation: they are short against the filter. What happened only inside a hole is not seen."
    )
    return [Finding("time-gap", "warning", text) if share > _MANY else fact(text)]


def picked_rows(order: IntArray) -> IntArray | slice:
    """Indices of consecutive samples as a slice, which copies nothing."""
    first = int(order[0]) if order.size else 0
    whole = order.size and int(order[-1]) == first + order.size - 1 and bool((np.diff(order) == 1).all())
    return slice(first, first + order.size) if whole else order


def interpolated(x: FloatArray, at: FloatArray, values: FloatArray) -> FloatArray:
    """(m, c) columns of ``values`` (n, c) at other places (m,), of samples at (n,); beyond the ends its value there."""
    out = np.empty((x.size, values.shape[1]), order="F")

    def fill(c: int) -> None:
        out[:, c] = np.interp(x, at, values[:, c])

    each(fill, range(values.shape[1]))
    return out
