"""Logs on their way to a fit: contact, stops and faults left out of them before anything is fitted, and what that says.

What a joint's drive does without contact follows from the motion: the description's torque, what its inertials may be
off by, rotor inertia, friction, an offset. That much is regressed on the effort, one robust regression a joint, so that
nearly half of the log being contact does not move it (:mod:`robust_regression`). Contact is where the effort then lies
many standard deviations off, at once or over a fifth of a second, in which ripple and noise average out; a stretch
reaches as far as it can be seen, and over reversals. Where a joint's friction is not that of sliding, it lies between
that of both directions. One mask is left out of all joints. Nothing here is a result of its own: friction and inertials
are fitted afterwards, on what remains.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import LeftOut, LeftOutBy, LeftOutSpan
from collaudit.core.data.joint_log import MOVING_RAD_S
from collaudit.core.errors import NotJudgedError
from collaudit.core.findings import Finding
from collaudit.core.identification.effort_columns import JointColumns, ThinnedMotion, joint_columns, motion_of
from collaudit.core.numeric.arrays import (
    BoolArray,
    FloatArray,
    closed,
    marked,
    run_bounds,
    spread_over_unknown,
    widened,
)
from collaudit.core.numeric.parallel import Progress, ordered_map, stage
from collaudit.core.numeric.robust_regression import BISQUARE, RobustFit, local_spread, robust_fit
from collaudit.core.prepare.hand_guiding import fitted_without_guiding
from collaudit.core.prepare.preparation import without_effort
from collaudit.core.prepare.prepared import Prepared

_SHOWN = 6  # stretches that a message lists
_TOLD = 0.01  # share of a joint's motion from which it is named
#: What makes most of a log look like contact. A wrong statement spoils every log alike, so it comes first.
_CAUSES = (
    "if nothing touched the arm, check the description (is it of this arm?), its mounting ([robot] base_rpy_deg), the "
    "order of the joints, sign and unit of their efforts ([log.units]), and whether it carried a load for a part of "
    "the time. If something did, record a run without contact, or say where it was: --truth, [detect] true_events. "
    'Last, [fit] contact = "none": all is fitted, what looks like contact too, and thresholds grow by it'
)
Times = Sequence[tuple[float, float]]
#: A stretch begins where the residual, or its mean over so long, exceeds so many robust standard deviations for this
#: long. Clean motion of simulated arms reaches 4 and 8, that of real ones 8.
FAR, _MEAN_S, _LASTING_S = 8.0, 0.2, 0.05
#: It reaches as far as it exceeds so many, short dips included, and this much further.
_NEAR, _DIP_S, _MARGIN_S = 3.0, 0.1, 0.05
#: What lies beside it and tells nothing goes with it up to this long; twice as long between two.
_UNKNOWN_S = 0.5
#: The spread of a residual is taken for no less than this share of the effort's own: no model is better than that.
_LEAST_SHARE = 0.01
#: A condition has a spread of its own from so many seconds of samples.
_CELL_S = 1.0
#: Errors of the model within so long are alike, s.
_ALIKE_S = 0.5
#: With more of a joint's motion left out, margins aside, no majority is left to tell contact from motion by.
MOSTLY = 0.45


@dataclass(frozen=True, slots=True, eq=False)
class CleanedLogs:
    """Logs as they are fitted.

    Attributes:
        logs: with the effort unknown where something was left out, in the order given; those refused are unknown
            throughout.
        left_out: by log.
        findings: what was left out, and what looks like contact and was not.
    """

    logs: tuple[Prepared, ...]
    left_out: dict[str, LeftOut]
    findings: tuple[Finding, ...]


def cleaned(
    prepared: Sequence[Prepared],
    config: Config,
    known: Sequence[Times | None] = (),
    progress: Progress | None = None,
) -> CleanedLogs:
    """Leave contact out of logs that are to be fitted.

    Args:
        prepared: the logs.
        config: ``[fit] contact``.
        known: for each log the start and end of what is known to be contact, s; None where nothing is known.
        progress: called with steps done and in all.
    """
    logs: list[Prepared] = []
    left_out: dict[str, LeftOut] = {}
    findings: list[Finding] = []
    times = [*known, *[None] * (len(prepared) - len(known))]
    for number, (whole, stated) in enumerate(zip(prepared, times, strict=True)):
        part = stage(progress, number / len(prepared), (number + 1) / len(prepared))
        seeking = stage(part, 0.15, 0.85)
        name = whole.series.source.name
        log, guided = fitted_without_guiding(whole, config)
        part(15, 100)
        findings += [replace(finding, where=name) for finding in guided]
        if stated is None:
            mask, facts = find_contact(log, stated_free=config.fit.contact == "none", progress=seeking)
            suspected: tuple[LeftOutSpan, ...] = facts.spans if facts.by == "stated" else ()
        else:
            mask, facts = labelled_contact(log, stated)
            suspected = find_contact(without_effort(log, mask, config), True, seeking)[1].spans
        if facts.refused:
            mask = np.ones_like(mask)
        part(85, 100)
        logs.append(without_effort(log, mask, config))
        left_out[name] = facts
        findings += _findings(name, facts, suspected)
    return CleanedLogs(tuple(logs), left_out, tuple(findings))


def refuse_if_nothing_is_left(found: CleanedLogs) -> None:
    """Fitting needs one log that for the most part agrees with itself.

    Raises:
        NotJudgedError: there is none.
    """
    if found.left_out and all(facts.refused for facts in found.left_out.values()):
        raise NotJudgedError(
            "nothing can be fitted: most of the motion is not what the described arm does without contact",
            found="; ".join(f"{_share_text(facts)} of {name}" for name, facts in found.left_out.items()),
            expected="efforts that the arm needs without contact, in most of the motion",
            hint=_CAUSES,
        )


def _share_text(facts: LeftOut) -> str:
    """The share of a log that is off, and the joints that show it with theirs, the largest first."""
    largest = sorted(facts.by_joint.items(), key=lambda item: -item[1])
    joints = ", ".join(f"{joint} {100 * share:.0f} %" for joint, share in largest if share >= _TOLD)
    return f"{100 * facts.share_seen:.0f} %{f' ({joints})' if joints else ''}"


def times_text(spans: Sequence[LeftOutSpan]) -> str:
    """Start and end of stretches, the first ones, with the joint that shows each most."""
    listed = [
        f"{span.start_s:.1f} to {span.end_s:.1f} s" + (f" ({span.joints[0]})" if span.joints else "")
        for span in spans[:_SHOWN]
    ]
    more = len(spans) - len(listed)
    return ", ".join(listed) + (f" and {more} more" if more > 0 else "")


def _findings(name: str, facts: LeftOut, suspected: Sequence[LeftOutSpan]) -> list[Finding]:
    out = []
    if facts.refused:
        text = (
            f"{_share_text(facts)} of the motion in {name} is inconsistent with the rest: contact, stops or faults, or "
            "another arm, mounting, order of joints, sign or unit of an effort than stated. Nothing of it was fitted."
        )
        out.append(Finding("fit-left-out", "warning", text, where=name))
    elif facts.by != "stated" and facts.spans:
        why = "labelled as contact" if facts.by == "labels" else "as it looks like contact, a stop or a fault"
        text = (
            f"{100 * facts.share:.2g} % of the motion in {name} was left out of the fit, in all joints, {why}: "
            f"{times_text(facts.spans)}."
        )
        out.append(Finding("fit-left-out", "info" if facts.by == "labels" else "warning", text, where=name))
    if suspected:
        said = "labelled" if facts.by == "labels" else "stated to be free of contact"
        source = " beside its labels" if facts.by == "labels" else ""
        text = (
            f"{name} is {said} and has {len(suspected)} stretches that look like contact{source}, used in the fit all "
            f"the same: {times_text(suspected)}."
        )
        out.append(Finding("fit-contact-suspected", "warning", text, where=name))
    return out


def find_contact(
    prepared: Prepared, stated_free: bool = False, progress: Progress | None = None
) -> tuple[BoolArray, LeftOut]:
    """Look for contact in one log.

    Args:
        prepared: the log.
        stated_free: the log is stated to be free of contact: what looks like it is reported and nothing left out.
        progress: called with steps done and in all.

    Returns:
        (n,) samples to leave out, and what there is to say about them.
    """
    series = prepared.series
    n, names = series.time_s.size, series.joint_names
    motion, part = motion_of(prepared), stage(progress, 0.0, 0.5)
    joints: list[JointColumns] = []
    for j, found in enumerate(ordered_map(lambda j: joint_columns(prepared, motion, j), range(len(names)))):
        joints += [] if found is None else [found]
        part(j + 1, len(names))
    fits = list(ordered_map(partial(_fit, motion), joints))
    rests = motion.rests(joints, fits, stage(progress, 0.5, 1.0))
    core = np.zeros(motion.rows.size, dtype=np.bool_)
    ratios, shares = [], {}
    for joint, fit, rest in zip(joints, fits, rests, strict=True):
        stretches, ratio = _stretches(joint, fit, *rest)
        core |= stretches
        ratios.append((names[joint.j], ratio))
        shares[names[joint.j]] = _share(stretches, joint.settled)
    wide = widened(core, round(_MARGIN_S / motion.period_s))
    spans = _spans(wide, ratios, series.time_s[motion.rows])
    wide = motion.samples(wide)
    seen = max(_share(core, part) for part in (motion.moving, *(joint.settled for joint in joints)))
    facts = _facts("stated" if stated_free else "found", wide, seen, prepared, spans)
    return (np.zeros(n, dtype=bool) if stated_free else wide), replace(facts, by_joint=shares)


def labelled_contact(prepared: Prepared, times_s: Sequence[tuple[float, float]]) -> tuple[BoolArray, LeftOut]:
    """Leave out what labels or a truth file mark.

    Args:
        prepared: the log.
        times_s: start and end of each event, seconds from the log's first sample.

    Returns:
        As :func:`find_contact` does.
    """
    series = prepared.series
    out = np.zeros(series.time_s.size, dtype=bool)
    for start, end in times_s:
        a, b = np.searchsorted(series.time_s, [start, end], side="left")
        out[a : max(b, a + 1)] = True
    wide = widened(out, ceil(2 * _MARGIN_S / series.period_s))
    return wide, _facts("labels", wide, _share(out, _moving(prepared)), prepared, _spans(wide, [], series.time_s))


def _fit(motion: ThinnedMotion, joint: JointColumns) -> RobustFit:
    columns = np.column_stack(joint.columns(joint.drawn, motion.regressor[joint.settled_draws, joint.j]))
    alike = max(1.0, _ALIKE_S / (motion.period_s * motion.thinning))
    return robust_fit(columns, joint.effort[joint.drawn], joint.prior_sd, alike)


def _stretches(
    joint: JointColumns, fit: RobustFit, rest: FloatArray, widening: FloatArray
) -> tuple[BoolArray, FloatArray]:
    """(m,) rows in stretches of contact, and (m,) what lies off in robust standard deviations, 0 where unknown.

    Args:
        joint: where it tells something, and how it moves.
        fit: of its effort.
        rest: (m,) what it leaves, 0 where the joint's effort is not known.
        widening: (m,) by which the estimate's own error widens what it leaves.
    """
    period_s = joint.period_s
    margin, unknown = round(_MARGIN_S / period_s), round(_UNKNOWN_S / period_s)
    near = joint.settled & (np.abs(rest) < BISQUARE * fit.sd * widening)
    spread = np.maximum(_spread(joint, rest / widening, near), max(_LEAST_SHARE * joint.usual, joint.step, 1e-9))
    ratio = np.abs(rest) / (spread * widening)
    stretches, near = _reaching(ratio, period_s)
    stretches = spread_over_unknown(stretches, joint.settled | near, unknown)
    free = joint.settled & ~widened(stretches, margin)
    mean, count = _running_mean(rest / widening, free, max(1, round(0.5 * _MEAN_S / period_s)))
    spread = np.maximum(_spread(joint, mean, count > 0), spread / np.sqrt(np.maximum(count, 1.0)))
    slow = np.abs(mean) / spread
    weak, also = _reaching(slow, period_s)
    return spread_over_unknown(stretches | weak, joint.settled | near | also, unknown), np.maximum(ratio, slow)


def _spread(joint: JointColumns, rest: FloatArray, kept: BoolArray) -> FloatArray:
    """(m,) local robust standard deviation of what is left, without what is far off itself."""
    cell, out = max(20, round(_CELL_S / joint.period_s)), np.full(rest.size, np.inf)
    for _ in range(3):
        if np.count_nonzero(kept) >= cell:
            out = local_spread(rest, kept, (np.abs(joint.velocity), np.abs(joint.acceleration)), cell)
            kept = kept & (np.abs(rest) < FAR * out)
    return out


def _reaching(ratio: FloatArray, period_s: float) -> tuple[BoolArray, BoolArray]:
    """(m,) rows near a stretch that is far off for long enough, and all that are near, short dips included."""
    near = closed(ratio > _NEAR, round(_DIP_S / period_s))
    starts, stops = run_bounds(ratio > FAR)
    core = np.zeros(ratio.size + 1, dtype=np.int64)
    core[starts[stops - starts >= max(2, round(_LASTING_S / period_s))] + 1] = 1
    count = np.cumsum(core)
    first, last = run_bounds(near)
    hit = count[last] > count[first]
    return marked(first[hit], last[hit], ratio.size), near


def _running_mean(rest: FloatArray, free: BoolArray, half: int) -> tuple[FloatArray, FloatArray]:
    """(m,) mean over the free rows up to ``half`` away, and of how many; 0 where these are few."""
    window = np.ones(2 * half + 1)
    count = np.rint(np.convolve(free.astype(np.float64), window, "same"))
    count[~free | (count <= half)] = 0.0
    return np.convolve(np.where(free, rest, 0.0), window, "same") * (count > 0) / np.maximum(count, 1.0), count


def _moving(prepared: Prepared) -> BoolArray:
    return np.asarray((np.abs(prepared.series.velocity_rad_s) > MOVING_RAD_S).any(axis=1))


def _share(mask: BoolArray, moving: BoolArray) -> float:
    return int(np.count_nonzero(mask & moving)) / max(1, int(np.count_nonzero(moving)))


def _facts(by: LeftOutBy, wide: BoolArray, seen: float, prepared: Prepared, spans: tuple[LeftOutSpan, ...]) -> LeftOut:
    return LeftOut(
        by=by,
        spans=spans,
        seconds=float(np.count_nonzero(wide)) * prepared.series.period_s,
        share=_share(wide, _moving(prepared)),
        share_seen=seen,
        refused=by != "stated" and seen > MOSTLY,
    )


def _spans(wide: BoolArray, ratios: Sequence[tuple[str, FloatArray]], time_s: FloatArray) -> tuple[LeftOutSpan, ...]:
    """The stretches with the joints that show them."""
    spans = []
    for a, b in zip(*run_bounds(wide), strict=True):
        peaks = sorted(((float(ratio[a:b].max()), name) for name, ratio in ratios), reverse=True)
        shown = [(peak, name) for peak, name in peaks if peak > FAR]
        names = tuple(name for _, name in shown)
        spans.append(LeftOutSpan(float(time_s[a]), float(time_s[b - 1]), names, shown[0][0] if shown else None))
    return tuple(spans)
