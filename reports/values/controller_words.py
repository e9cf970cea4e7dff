"""What the controller's alarms and the log's labels say of a contact, in words."""

from __future__ import annotations

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.detection_result import Contact, ControllerAlarmComparison

_RELATION = {
    "agreed": "agrees with a contact",
    "missed": "did not alarm",
    "spurious": "no contact found here (spurious)",
    "not-judged": "not judged: no contact could have been noticed here",
}


def controller_text(contact: Contact, result: AuditResult) -> str:
    """What was said of one contact."""
    flags = () if result.detection is None else result.detection.flags
    if not flags:
        return "no alarm or label in the log"
    own = next((flag for flag in flags if flag.detected_s == contact.detected_s), None)
    return "not compared" if own is None else mark_text(own)


def mark_text(flag: ControllerAlarmComparison) -> str:
    """One mark: whose it is, how it relates to a contact, and how early or late it was."""
    if flag.flag_s is None:
        return "neither controller alarm nor label"
    whose = "controller alarm" if flag.label is None else f"label {flag.label}"
    lead = ""
    if flag.lead_s is not None:
        lead = f", {1000 * abs(flag.lead_s):.0f} ms {'before' if flag.lead_s < 0 else 'after'} the detection"
    return f"{whose} at {flag.flag_s:.3f} s{lead}: {_RELATION[flag.relation]}"
