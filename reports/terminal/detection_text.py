"""What stands behind the events, for a terminal: delay, contacts, other detectors, the controller's alarms."""

from __future__ import annotations

from typing import TYPE_CHECKING

from collaudit.reports.terminal.text_table import table

if TYPE_CHECKING:
    from collaudit.core.data.audit_result import AuditResult
    from collaudit.core.data.detection_result import ContactForce, DelayFacts, DetectionFacts


def detection_text(result: AuditResult, width: int | None = None) -> str:
    """Lines about the detection; empty for results without it. Tables are cut to ``width``, None: any."""
    facts = result.detection
    if facts is None:
        return ""
    mode = "causal" if facts.causal else "offline, zero phase"
    parts = [f"Detector: {result.rule.detector} ({mode}); delay {delay_text(facts.delay)}.\n"]
    parts += [_contacts(facts, width), _side_by_side(facts, width), _flags(facts, width)]
    return "".join(parts)


def delay_text(delay: DelayFacts) -> str:
    """Filter, persistence and jitter apart."""
    return (
        f"{1e3 * delay.filter_s:.1f} ms filter + {1e3 * delay.persistence_s:.1f} ms persistence + up to "
        f"{1e3 * delay.jitter_s:.1f} ms jitter"
    )


def _contacts(facts: DetectionFacts, width: int | None) -> str:
    if not facts.incidents:
        return ""
    lines = [
        (f"{i.onset_s:.3f} s", ", ".join(i.joints), i.link, _force(i.force), i.kind, "; ".join(i.evidence))
        for i in facts.incidents
    ]
    head = ("onset", "joints", "link or further out", "force", "kind", "evidence")
    return "\nContacts\n" + table(head, lines, width=width)


def _force(force: ContactForce | None) -> str:
    if force is None:
        return "unknown"
    low, high = force.size_ci95_n
    blind = f", {len(force.blind)} blind direction{'s' if len(force.blind) > 1 else ''}" if force.blind else ""
    return f"{low:.0f} to {high:.0f} N{blind}"


def _side_by_side(facts: DetectionFacts, width: int | None) -> str:
    if not facts.detectors:
        return ""
    lines = [
        (
            name,
            str(len(other.collisions)),
            str(other.near_misses),
            delay_text(other.delay),
            f"{other.delay.noise_gain:.2f}",
        )
        for name, other in facts.detectors.items()
    ]
    head = ("detector", "collisions", "near misses", "delay", "noise gain")
    return "\nOther detectors on this log\n" + table(head, lines, (1, 2, 4), width)


def _flags(facts: DetectionFacts, width: int | None) -> str:
    if not facts.flags:
        return ""
    lines = []
    for flag in facts.flags:
        lead = ""
        if flag.lead_s is not None:
            lead = f"{abs(1e3 * flag.lead_s):.0f} ms {'early' if flag.lead_s < 0 else 'late'}"
        times = ["–" if t is None else f"{t:.3f} s" for t in (flag.flag_s, flag.detected_s)]
        lines.append((*times, flag.relation, lead))
    head = ("controller", "audit", "relation", "controller was")
    return "\nThe controller's own alarms\n" + table(head, lines, width=width)
