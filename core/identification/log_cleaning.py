"""Logs on their way to a fit: contact left out, and what has to be said about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import LeftOut, LeftOutSpan
from collaudit.core.errors import NotJudgedError
from collaudit.core.findings import Finding
from collaudit.core.identification.contact_mask import find_contact, labelled_contact
from collaudit.core.numeric.parallel import Progress, stage
from collaudit.core.prepare.guided_stretches import fitted_without_guiding
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
    for number, (whole, marked) in enumerate(zip(prepared, times, strict=True)):
        part = stage(progress, number / len(prepared), (number + 1) / len(prepared))
        seeking = stage(part, 0.15, 0.85)
        name = whole.series.source.name
        log, guided = fitted_without_guiding(whole, config)
        part(15, 100)
        findings += [replace(finding, where=name) for finding in guided]
        if marked is None:
            mask, facts = find_contact(log, stated_free=config.fit.contact == "none", progress=seeking)
            suspected: tuple[LeftOutSpan, ...] = facts.spans if facts.by == "stated" else ()
        else:
            mask, facts = labelled_contact(log, marked)
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
