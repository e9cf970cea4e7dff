"""What a reader of one audit must know first, a sentence a line, in at most 120 words; the same in every format.

Headlines, tables and formats list contacts; the alarms of single joints are their detail."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TypeVar

from collaudit.core.data.audit_result import AuditResult, Collision, NearMiss
from collaudit.core.data.detection_result import Contact, ContactForce, LeastForce
from collaudit.reports.values.numbers import apart, fixed, percent, time_decimals
from collaudit.reports.values.visible_text import joint_lines
from collaudit.reports.values.words import after_text, cause_sentence, clock_text, noticed_line, plural, speaking

MOST_WORDS = 120
#: Words that the first line has at least, and what counts the statements left out.
_FOR_FIRST = 24
_REST = "More statements below: {}."
#: Contacts that are told one by one, those furthest above their thresholds.
_MOST_CONTACTS = 2


def first_lines(result: AuditResult) -> tuple[str, ...]:
    """What happened, what would have been noticed, what was not judged, what to do next.

    A fail begins with its contacts, a pass with the push that it would have noticed, a log that was not judged with
    what is missing. What does not fit is counted.
    """
    noticed = noticed_line(result)
    seen = [] if noticed is None else [noticed]
    reasons = _reasons(result)
    lost = [text for text in (lost_line(result),) if text]
    contacts = _contact_lines(result, _MOST_CONTACTS)
    if result.verdict == "pass":
        return _fitting([*seen, *reasons, *contacts], [f"Not covered: {text}" for text in excluded_lines(result)], lost)
    next_step = [f"Next: {text}" for text in (_next(result),) if text]
    cause = [] if speaking(result) is None else [text for text in (cause_sentence(result),) if text]
    if result.verdict == "not_judged":
        return _fitting([*reasons[:1], *cause], [*contacts, *reasons[1:], *seen], [*lost, *next_step])
    brief = _contact_lines(result, 1, brief=True)
    for told, not_judged in ((contacts, lost), (_contact_lines(result, 1), lost), (brief, lost), (brief, [])):
        lines = _fitting([*reasons[:1], *told], reasons[1:], [*cause, *seen, *not_judged, *next_step])
        if not unsaid(told, lines):
            break
    return lines


def _contact_lines(result: AuditResult, most: int, brief: bool = False) -> list[str]:
    contacts = [contact_line(contact, result, brief) for contact in strongest(result, most).values()]
    left = len(result.contacts) - len(contacts)
    if not left:
        return contacts
    first = [f"Strongest: {contacts[0]}"] if most == 1 else contacts
    return [*first, f"{plural(left, 'more contact')}: below."]


def all_told(result: AuditResult) -> bool:
    """Whether :func:`first_lines` tell every contact."""
    if len(result.contacts) > _MOST_CONTACTS:
        return False
    return not unsaid((contact_line(contact, result) for contact in result.contacts), first_lines(result))


def contact_line(contact: Contact, result: AuditResult, brief: bool = False) -> str:
    """One contact: when, where, how far above γ, how strong; unless brief how late the alarm and what the arm did."""
    worst = max(alarms_of(contact, result), key=height, default=None)
    when = f"{fixed(contact.onset_s, time_decimals(result.log.sample_period_s))} s"
    clock = clock_text(result.log.start, contact.onset_s).partition(" ")[2]  # the date stands above
    parts = [f"{when}{f' ({clock})' if clock else ''}"]
    parts += [f"{contact.link} or further out"] if contact.link else []
    parts += [] if worst is None else [f"{worst.joint} at {apart([height(worst), 1.0])[0]} γ"]
    force = force_text(contact.force, contact.least_force)
    parts += [force if force.endswith(" N") else f"force {force}"]
    if brief:
        return f"{', '.join(parts)}."
    parts += [f"alarm after {fixed(1e3 * (contact.detected_s - contact.onset_s), 0)} ms"]
    after = after_text(contact.after)
    return f"{', '.join(parts)}{f'; {after}' if after else ''}."


def lost_line(result: AuditResult) -> str:
    """Of each watched joint the share of the log that was not judged, the largest first; empty where there is none."""
    shares = {
        joint: cover.lost_s / cover.time_s
        for joint, cover in result.coverage.joints.items()
        if cover.watched and cover.time_s > 0
    }
    lossy = sorted((joint for joint, share in shares.items() if share > 0), key=lambda joint: -shares[joint])
    if not lossy:
        return ""
    texts = [percent(shares[joint]) for joint in lossy]
    if len(lossy) == len(shares) > 1 and len(set(texts)) == 1:
        return f"Not judged: {texts[0]} of the log, on all joints."
    others = f", others at most {texts[1]}" if len(lossy) > 1 else ""
    return f"Not judged, of the log: {lossy[0]} {texts[0]}{others}."


def excluded_lines(result: AuditResult) -> list[str]:
    """What the verdict does not cover; what is said of several joints is said once."""
    joint_of = {finding.text: finding.joint or "" for finding in result.findings if finding.excludes}
    return joint_lines(((joint_of.get(said, ""), said) for said in result.exclusions), brief=True)


def unsaid(texts: Iterable[str], lines: Sequence[str]) -> list[str]:
    """The texts that no line holds."""
    return [text for text in texts if not any(text in line for line in lines)]


def _next(result: AuditResult) -> str:
    """What to do: state a cause that speaks; look at the contact; or what mends the first reason."""
    cause = speaking(result)
    if cause is not None and cause.line:
        return f"state {cause.line} and run again." if cause.line.startswith("[") else f"{cause.line}."
    if result.verdict == "fail" and result.contacts:
        known = next((c.id for c in strongest(result, 1).values() if c.id), "")
        accept = f"; to accept the strongest: collaudit accept OUT {known}" if known else ""
        return f"look at the contacts below{accept}."
    found = (finding.kind.remedy for reason in result.reasons for finding in result.findings if finding.text in reason)
    return next(found, "")


def _reasons(result: AuditResult) -> list[str]:
    """The reasons, without the push that would have been noticed, which has a line of its own."""
    noticed = noticed_line(result)
    said = (text if noticed is None else text.replace(noticed, "").strip() for text in result.reasons)
    return [text for text in said if text]


def more_reasons(result: AuditResult, lines: Sequence[str]) -> list[str]:
    """The reasons that no line holds."""
    return unsaid(_reasons(result), lines)


def _cut(line: str, words: int) -> str:
    """A line of so many words, with a mark that some are left out."""
    return " ".join([*line.split()[: max(words - 1, 1)], "…"])


def _fitting(first: Sequence[str], more: Sequence[str], last: Sequence[str]) -> tuple[str, ...]:
    """The first and last lines, and of those between as many as fit; the first are cut where even they do not.

    The longest of the last leaves room for the first to be understood.
    """
    over = sum(len(line.split()) for line in last) - MOST_WORDS + _FOR_FIRST
    if over > 0:
        longest = max(last, key=lambda line: len(line.split()))
        last = [_cut(line, len(line.split()) - over) if line is longest else line for line in last]
    room = MOST_WORDS - sum(len(line.split()) for line in last)
    lines = [*first, *more]
    if sum(len(line.split()) for line in lines) <= room:
        return (*lines, *last)
    room -= len(_REST.split())
    out: list[str] = []
    for number, line in enumerate(lines):
        words = line.split()
        if number == 0 and len(words) > room:
            line = _cut(line, room)
        elif len(words) > room:
            break
        out.append(line)
        room -= len(words)
    rest = [_REST.format(len(lines) - len(out))] if len(out) < len(lines) else []
    return (*out, *last, *rest)


_LEAST_MARGIN_S = 0.25
_LEAST_MARGIN_SAMPLES = 25

E = TypeVar("E", Collision, NearMiss)


def in_time(events: Sequence[E]) -> list[E]:
    """Events in order of their onset."""
    return sorted(events, key=lambda event: (event.onset_s, event.joint))


def alarms_of(contact: Contact, result: AuditResult, alarms: Sequence[Collision] | None = None) -> list[Collision]:
    """The alarms of single joints that make up a contact, in order of time.

    Args:
        contact: the contact.
        result: the audit.
        alarms: its alarms in order of time, for those who ask of many contacts.
    """
    found = in_time(result.collisions) if alarms is None else alarms
    return [one for one in found if one.joint in contact.joints and contact.onset_s <= one.onset_s <= contact.end_s]


def height(alarm: Collision) -> float:
    """Peak over threshold."""
    return abs(alarm.peak_nm) / alarm.gamma_nm


def strongest(result: AuditResult, limit: int) -> dict[int, Contact]:
    """The contacts with the highest residual for its threshold, by their number from 1, in order of time.

    Args:
        result: the audit.
        limit: how many at most; of equals the earlier.
    """
    contacts, alarms = result.contacts, in_time(result.collisions)
    heights = [max(map(height, alarms_of(contact, result, alarms)), default=0.0) for contact in contacts]
    kept = sorted(range(len(contacts)), key=lambda k: (-heights[k], k))[:limit]
    return {k + 1: contacts[k] for k in sorted(kept)}


def contact_limits(contact: Contact, period_s: float) -> tuple[float, float]:
    """Times between which a contact is drawn: 0.25 s, 25 samples or its own length on either side."""
    margin = max(_LEAST_MARGIN_S, _LEAST_MARGIN_SAMPLES * period_s, contact.end_s - contact.onset_s)
    return contact.onset_s - margin, contact.end_s + margin


def force_text(force: ContactForce | None, least: LeastForce | None = None) -> str:
    """The interval of a contact's force; what it is at least where a direction is blind or there is no interval."""
    low, high = (0.0, None) if force is None else force.size_ci95_n
    if high is not None:
        return f"{low:.0f} to {high:.0f} N"
    at_least = max(low, 0.0 if least is None else least.force_n)
    return "unknown" if force is None and at_least < 1.0 else _at_least(at_least)


def link_forces_text(force: ContactForce | None) -> str:
    """The force on each link on which the contact can be: ``if on link3: 45 to 80 N``; empty where that is not told."""
    links = () if force is None else force.links
    said = (
        f"if on {link.frame}: "
        + (f"{link.low_n:.0f} to {link.high_n:.0f} N" if link.high_n is not None else _at_least(link.low_n))
        for link in links
    )
    return "; ".join(said)


def _at_least(low_n: float) -> str:
    return f"at least {math.floor(low_n)} N" if low_n >= 1.0 else "not determinable"
