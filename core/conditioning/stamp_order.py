"""Which samples are used, in which order, with which stamps: sorted, each once, rebuilt where the motion tells them.

Rows and samples that were lost are told first: a row without the position of every joint is a lost one. Of samples that
share a stamp the first counts; those that contradict each other are missing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.conditioning.motion_clock import clock_findings, motion_clock
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import NotJudgedError
from collaudit.core.findings import Finding, fact
from collaudit.core.logs.signals.stamp_conflicts import contradicting
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span, frozen
from collaudit.core.numeric.parallel import each, ordered_map
from collaudit.core.numeric.stats import median_of, robust_sd

_PERIODIC_SHARE = 1e-3  # stamps within this share of a period of a perfect comb are a perfect comb


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


def clocked(
    time_s: FloatArray, position: FloatArray, velocity: FloatArray | None
) -> tuple[IntArray, FloatArray, list[Finding]]:
    """Samples in time order with their stamps, rebuilt where the motion tells them; findings."""
    order, findings = _sorted(time_s)
    clock = motion_clock(time_s[order], position, velocity, order) if order.size else None
    if clock is not None:
        fresh = np.concatenate(([True], np.diff(clock.stamps_s) > 0.5 * clock.period_s))
        return order[fresh], clock.stamps_s[fresh], [*findings, *clock_findings(clock, fresh)]
    order = _distinct(order, time_s)
    return order, time_s[order], findings


def usable_order(time_s: FloatArray) -> IntArray:
    """Indices of samples with finite, distinct stamps, in time order."""
    return _distinct(_sorted(time_s)[0], time_s)


def _sorted(time_s: FloatArray) -> tuple[IntArray, list[Finding]]:
    """Indices of samples with finite stamps, in time order."""
    findings: list[Finding] = []
    finite = np.flatnonzero(np.isfinite(time_s))
    if finite.size < time_s.size:
        findings.append(
            Finding(
                "log-nan",
                "warning",
                f"{time_s.size - finite.size} stamps are not numbers and were left out.",
            )
        )
    stamps = time_s[finite]
    backwards = int(np.count_nonzero(np.diff(stamps) < 0))
    order = finite
    if backwards:
        order = finite[np.argsort(stamps, kind="stable")]
        findings.append(
            Finding(
                "log-clock",
                "warning",
                f"Stamps ran backwards {backwards} times; samples were sorted.",
            )
        )
    return order.astype(np.int64, copy=False), findings


def _distinct(order: IntArray, time_s: FloatArray) -> IntArray:
    """Those of the samples, in time order, whose stamp is not that of the one before."""
    stamps = time_s[order]
    fresh: BoolArray = np.concatenate(([True], np.diff(stamps) > 0)) if stamps.size else np.zeros(0, bool)
    return order if fresh.all() else order[fresh]


def comb_error(stamps: FloatArray, places: IntArray, period: float) -> FloatArray:
    """(m,) deviation of stamps from the best comb of this period, s."""
    off = stamps - period * places
    off -= median_of(off)
    return off


def _farthest(off: FloatArray) -> float:
    return float(max(off.max(), -off.min()))


def snaps(
    off: FloatArray, stamps: FloatArray, places: IntArray, position: FloatArray, order: IntArray, period: float
) -> bool:
    """Whether samples were taken evenly, whatever their stamps say.

    Judged by which time axis predicts each position better from its four neighbours (a cubic through
    them): an arm has inertia, so the true axis is the one on which it moves smoothly.

    Args:
        off: (m,) of the stamps, as of :func:`comb_error`.
        stamps: (m,) s; places: (m,) of each in its stretch.
        position: (n, j); order: (m,) rows of it.
        period: s.
    """
    error = _farthest(off)
    if error < _PERIODIC_SHARE * period:
        return True
    if error > 0.5 * period:
        return False
    even: FloatArray = np.asarray(period * places, dtype=np.float64)
    own = position[order]
    return _roughness(even, own) <= _roughness(stamps, own)


def _roughness(t: FloatArray, position: FloatArray) -> float:
    """RMS error of predicting each position from its neighbours at t[k±1], t[k±2]."""
    if t.size < 5:
        return 0.0
    inside = slice(2, t.size - 2)
    at = [slice(2 + k, t.size - 2 + k) for k in (-2, -1, 1, 2)]
    nodes = [t[part] - t[inside] for part in at]
    guess = through(np.zeros_like(nodes[0]), nodes, [position[part] for part in at])
    error = np.asarray(guess - position[inside])
    return float(np.sqrt(np.nanmean(error**2))) if np.isfinite(error).any() else 0.0


def jitter_finding(
    errors: Sequence[FloatArray], raw: Sequence[Span], snap: tuple[bool, ...], period: float
) -> list[Finding]:
    """How far stamps scatter about the period, and how the even time base was made.

    Args:
        errors: of each stretch's stamps, as of :func:`comb_error`.
        raw: the stretches; snap: which of them count as evenly sampled.
        period: s.
    """
    worst = max(_farthest(error) for error in errors)
    if worst < 0.02 * period:
        return []
    # of neighbours: a clock that drifts against another for minutes does not jitter
    spread = robust_sd(np.concatenate([np.diff(error) for error in errors])) / np.sqrt(2.0)
    snapped = sum(len(s) for s, yes in zip(raw, snap, strict=True) if yes)
    text = (
        f"Stamps scatter by {spread * 1e3:.2g} ms about a period of {period * 1e3:.6g} ms (robust standard deviation; "
        f"the farthest is {worst * 1e3:.3g} ms off an even clock); {snapped} of {sum(map(len, raw))} samples were "
        "taken as evenly spaced, on which positions move more smoothly, the others interpolated to an even time base."
    )
    return [fact(text)]


def without_contradictions(log: JointLog) -> JointLog:
    """The log without the values of samples that share a stamp and contradict each other, and a finding for each joint.

    Nothing tells which of them was measured, and the order of the rows does not.
    """
    parts: dict[str, FloatArray] = {}
    findings: list[Finding] = []
    for name, values in (("position_rad", log.position_rad), ("effort", log.effort)):
        if values is None:
            continue
        rows = ordered_map(lambda column: contradicting(log.time_s, column), values.T)
        for j, wrong in enumerate(rows):
            if wrong is None:
                continue
            parts.setdefault(name, values.copy(order="F"))[wrong, j] = np.nan
            times, joint, what = log.time_s[wrong], log.joint_names[j], name.partition("_")[0]
            text = (
                f"{times.size} samples share their stamps and give other {what}s of joint '{joint}', between "
                f"{times.min():.4g} and {times.max():.4g} s: two publishers, two recordings in one, or one stamp for "
                "several samples. Nothing shows which are right: they count as missing, and a contact then would not "
                "be seen."
            )
            span = float(times.min()), float(times.max())
            findings.append(Finding("log-publishers-conflict", "warning", text, None, joint, *span))
    if not parts:
        return log
    known = {name: frozen(values) for name, values in parts.items()}
    return replace(log, findings=(*log.findings, *findings), **known)  # type: ignore[arg-type]


def duplicate_findings(log: JointLog, order: IntArray) -> list[Finding]:
    """What was left out because of its stamp, and by how much it differs from what was kept.

    Args:
        log: as recorded.
        order: rows that are used, in time order.
    """
    unused = np.isfinite(log.time_s)
    unused[order] = False
    rows = np.flatnonzero(unused)
    kept = order[np.minimum(np.searchsorted(log.time_s[order], log.time_s[rows]), order.size - 1)]
    same = log.time_s[kept] == log.time_s[rows]
    rows, kept = rows[same], kept[same]
    if not rows.size:
        return []
    text = f"{rows.size} samples have the stamp of the sample before and were left out (the first was kept)"
    by = []
    for what, values in (("positions", log.position_rad), ("efforts", log.effort)):
        apart = 0.0 if values is None else float(np.nanmax(np.abs(values[rows] - values[kept]), initial=0.0))
        if apart > 0.0:
            by.append(f"{what} of up to {apart:.3g}")
    if not by:
        return [Finding("time-duplicate", "info", f"{text}; they are the same.")]
    return [Finding("time-duplicate", "warning", f"{text}; they differ in {' and '.join(by)}.")]
