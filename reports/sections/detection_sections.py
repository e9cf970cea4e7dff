"""What stands beside the events: other detectors, the controller's alarms and labels, scores."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.detection_result import ControllerAlarmComparison, DelayFacts, Score
from collaudit.reports.sections.section import Section
from collaudit.reports.values.numbers import percent, significant
from collaudit.reports.values.words import NONE

_RELATION = {
    "agreed": "agrees with a contact",
    "missed": "did not alarm",
    "spurious": "no contact found here (spurious)",
    "not-judged": "not judged: no contact could have been noticed here",
}


def delay_text(delay: DelayFacts) -> str:
    """Filter, persistence and jitter apart."""
    return (
        f"{1e3 * delay.filter_s:.1f} ms filter + {1e3 * delay.persistence_s:.1f} ms persistence + up to "
        f"{1e3 * delay.jitter_s:.1f} ms jitter"
    )


def shortest_push_text(delay: DelayFacts) -> str:
    """What a push must last to alarm, by its height; empty where that is not known."""
    listed = ", ".join(f"{1e3 * push.duration_s:.3g} ms at {push.ratio:g} γ" for push in delay.shortest_push)
    asked = f"the rule asks for {1e3 * delay.persistence_s:.3g} ms above γ"
    return f"Through the detector's filter a steady push alarms from {listed} on; {asked}." if listed else ""


def detection_sections(result: AuditResult) -> tuple[Section, ...]:
    """Other detectors, the controller's alarms and labels, scores against known events; what there is of them."""
    facts = result.detection
    if facts is None:
        return ()
    detectors = tuple(
        (
            name,
            str(len(other.collisions)),
            str(other.near_misses),
            delay_text(other.delay),
            f"{other.delay.noise_gain:.2f}",
        )
        for name, other in facts.detectors.items()
    )
    head = ("detector", "alarms", "near misses", "delay", "noise gain")
    marks = tuple((mark_text(flag),) for flag in facts.flags)
    title = f"The controller's alarms and the log's labels ({len(marks)})"
    every = (
        Section("Other detectors on this log", head, detectors),
        Section(title, ("mark",), marks),
        score_section(facts.scores),
    )
    return tuple(one for one in every if one.rows)


def mark_text(flag: ControllerAlarmComparison) -> str:
    """One mark: whose it is, how it relates to a contact, and how early or late it was."""
    if flag.flag_s is None:
        ours = "" if flag.detected_s is None else f" (ours at {flag.detected_s:.3f} s)"
        return f"neither controller alarm nor label{ours}"
    whose = "controller alarm" if flag.label is None else f"label {flag.label}"
    lead = ""
    if flag.lead_s is not None:
        lead = f", {1000 * abs(flag.lead_s):.0f} ms {'before' if flag.lead_s < 0 else 'after'} the detection"
    return f"{whose} at {flag.flag_s:.3f} s{lead}: {_RELATION[flag.relation]}"


def score_section(scores: Sequence[Score]) -> Section:
    """Scores of an audit against known events."""
    rows = tuple(
        (
            row.joint or "all joints",
            f"{row.found} of {row.events}",
            str(row.not_observable),
            NONE if row.recall is None else percent(row.recall),
            NONE if row.precision is None else percent(row.precision),
            NONE if row.false_alarms_per_hour is None else significant(row.false_alarms_per_hour),
            _delay(row.delay_s),
            NONE if row.auc is None else f"{row.auc:.3f}",
        )
        for row in scores
    )
    head = ("joint", "found", "not observable", "recall", "precision", "false alarms/h", "delay (5 to 95 %)", "AUC")
    note = "Recall leaves out events hidden at rest or where nothing was judged."
    return Section("Against the known events", head, rows, (note,) if rows else ())


def _delay(delays_s: Sequence[float]) -> str:
    if not delays_s:
        return NONE
    low, middle, high = (1e3 * x for x in np.percentile(delays_s, [5, 50, 95]))
    return f"{middle:.0f} ({low:.0f} to {high:.0f}) ms"
