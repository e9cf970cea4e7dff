"""What stands behind the events, for a terminal: delay, other detectors, the controller's alarms."""

from __future__ import annotations

from typing import TYPE_CHECKING

from collaudit.reports.terminal.text_table import table, wrapped

if TYPE_CHECKING:
    from collaudit.core.data.audit_result import AuditResult
    from collaudit.core.data.detection_result import DelayFacts, DetectionFacts


def detection_text(result: AuditResult, width: int | None = None) -> str:
    """Lines about the detection; empty for results without it. Tables are cut to ``width``, None: any."""
    facts = result.detection
    if facts is None:
        return ""
    mode = "causal" if facts.causal else "offline, zero phase"
    parts = [
        wrapped(f"Detector: {result.rule.detector} ({mode}); delay {delay_text(facts.delay)}.", width, "  ") + "\n"
    ]
    if facts.delay.shortest_push:
        parts.append(f"{wrapped(shortest_push_text(facts.delay), width, '  ')}\n")
    parts += [_side_by_side(facts, width), _flags(facts, width)]
    return "".join(parts)


def delay_text(delay: DelayFacts) -> str:
    """Filter, persistence and jitter apart."""
    return (
        f"{1e3 * delay.filter_s:.1f} ms filter + {1e3 * delay.persistence_s:.1f} ms persistence + up to "
        f"{1e3 * delay.jitter_s:.1f} ms jitter"
    )


def shortest_push_text(delay: DelayFacts) -> str:
    """What a push must last to alarm, by its height; empty where that is not known."""
    listed = ", ".join(f"{1e3 * push.duration_s:.3g} ms at {push.ratio:g} γ" for push in delay.shortest_push)
    return (
        f"Through the detector's filter a steady push alarms from {listed} on; the rule asks for "
        f"{1e3 * delay.persistence_s:.3g} ms above γ."
    )


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
    head = ("detector", "alarms", "near misses", "delay", "noise gain")
    return "\nOther detectors on this log\n" + table(head, lines, (1, 2, 4), width, fold=True)


def _flags(facts: DetectionFacts, width: int | None) -> str:
    if not facts.flags:
        return ""
    lines = []
    for flag in facts.flags:
        lead = ""
        if flag.lead_s is not None:
            lead = f"{abs(1e3 * flag.lead_s):.0f} ms {'early' if flag.lead_s < 0 else 'late'}"
        times = ["–" if t is None else f"{t:.3f} s" for t in (flag.flag_s, flag.detected_s)]
        lines.append(
            (flag.label or "controller alarm" if flag.flag_s is not None else "–", *times, flag.relation, lead)
        )
    head = ("mark", "at", "audit", "relation", "mark was")
    return "\nThe controller's alarms and the log's labels\n" + table(head, lines, width=width, fold=True)
