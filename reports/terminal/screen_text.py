"""One audit on one screen: verdict, contacts, what would have been noticed, what was not judged, what matters most."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.detection_result import Contact
from collaudit.core.findings import Finding
from collaudit.core.verdict.noticed_words import time_text
from collaudit.reports.terminal.rule_text import rule_text
from collaudit.reports.terminal.text_table import table, table_with_text, without_unit, wrapped
from collaudit.reports.values.contact_rows import contact_row, contacts_of
from collaudit.reports.values.rows import NONE, near_miss_row
from collaudit.reports.values.sensitivity_rows import force_rows, force_shares, noticed_line, sensitivity_rows
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import BRIEF_STATEMENT, nothing_judged, plural, verdict_word

_MOST_CONTACTS = 8
_MOST_FINDINGS = 3
_MOST_NEAR = 3
_MOST_REASONS = 6


def screen_text(result: AuditResult, width: int | None = None, more: str | None = None) -> str:
    """What fits a screen.

    Args:
        result: the audit.
        width: columns of the terminal that tables are cut to; None: any.
        more: where the rest is.
    """
    contacts = contacts_of(result)
    parts = [verdict_text(result, _MOST_REASONS, width)]
    if contacts:
        worst = _highest(result, contacts, _MOST_CONTACTS)
        note = f", the {_MOST_CONTACTS} highest" if len(worst) < len(contacts) else ""
        parts += [f"\nContacts ({len(contacts)}{note})\n", _brief_contacts(result, worst, width)]
    parts += _near_misses(result, width)
    if not nothing_judged(result):
        parts += sensitivity_text(result, width)
    parts += _findings(result, width)
    parts.append(f"\n{wrapped(rule_text(result), width, '  ')}\n")
    parts += [] if more is None else [f"More: {more}.\n"]
    parts.append(f"{wrapped(BRIEF_STATEMENT, width)}\n")
    return "".join(parts)


def verdict_text(result: AuditResult, most: int | None = None, width: int | None = None) -> str:
    """The verdict, its reasons and what it does not cover, ``most`` of each at most, in lines of ``width``."""
    head = f"{verdict_word(result.verdict, result.exclusions)}  {visible(result.log.name)}\n"
    noticed = noticed_line(result)
    told = [*_listed(result.reasons, most, width), *_listed([noticed] if noticed else [], 1, width)]
    text = head + "".join(told)
    return text + ("  excluded:\n" + "".join(_listed(result.exclusions, most, width)) if result.exclusions else "")


def contact_table(result: AuditResult, contacts: Sequence[Contact], width: int | None) -> str:
    """Every contact with all that is known of it."""
    listed = [contact_row(contact, result) for contact in contacts]
    head = ("onset", "lasted", "highest residual", "kind", "joints; link or further out; force; evidence")
    lines = []
    for r in listed:
        more = "; ".join(text for text in (r.joints, r.link, f"force {r.force}", r.evidence) if text)
        lines.append((r.onset, r.lasted, r.worst, r.kind, more))
    return table_with_text(head, lines, (0, 1), width)


def _brief_contacts(result: AuditResult, contacts: Sequence[Contact], width: int | None) -> str:
    """One short line a contact: the joint whose residual is highest for its threshold, and how many others alarmed."""
    listed = [(contact, contact_row(contact, result)) for contact in contacts]
    lines = []
    for contact, row in listed:
        residual, _, rest = row.worst.partition(" (γ ")
        gamma, _, joint = rest.partition("), ")
        others = len(contact.joints) - 1
        name = f"{joint or row.joints}{f' +{others}' if joint and others else ''}"
        force = row.force.partition(" (")[0].partition(",")[0].replace("at least", "≥")
        lines.append((row.onset, row.lasted, name, residual, gamma, row.link, force, row.kind))
    plain, unit = without_unit(lines, (3,))
    head = ("onset", "lasted", "joint", f"residual{unit}", "gamma", "link or further out", "force", "kind")
    return table(head, plain, (0, 1, 3, 4), width, fold=True)


def _near_misses(result: AuditResult, width: int | None) -> list[str]:
    """The closest near misses, a line each."""
    if not result.near_misses:
        return []
    closest = sorted(result.near_misses, key=lambda near: -near.ratio)[:_MOST_NEAR]
    rows = [near_miss_row(near, result) for near in sorted(closest, key=lambda near: near.onset_s)]
    lines = [(r.onset, r.lasted, r.joint, r.peak, r.gamma, r.closeness) for r in rows]
    more = f", the {_MOST_NEAR} closest" if len(result.near_misses) > _MOST_NEAR else ""
    head = ("onset", "lasted", "joint", "peak", "gamma", "how close")
    return [f"\nNear misses ({len(result.near_misses)}{more})\n", table(head, lines, (0, 1, 3, 4), width, fold=True)]


def sensitivity_text(result: AuditResult, width: int | None) -> list[str]:
    """The smallest torque by joint, and push by place, that would have alarmed."""
    listed = sensitivity_rows(result)
    if not listed:
        return []
    asks = any(r.asked != NONE for r in listed)
    names = (
        "joint",
        "judged",
        "friction a range",
        "not judged",
        "alarms in 50 %",
        "in 95 %",
        "whenever judged",
        "asked",
    )
    cells = [(r.joint, r.judged, r.as_range, r.not_judged, r.half, r.most, r.always, r.asked) for r in listed]
    plain, unit = without_unit(cells, (4, 5, 6))
    lines = plain if asks else [line[:-1] for line in plain]
    title = f"Smallest torque that would have alarmed{unit} (shares of the time watched)"
    parts = [f"\n{wrapped(title, width, '  ')}\n", table(names[: 7 + asks], lines, range(1, 7), width, fold=True)]
    time = None if result.sensitivity is None else result.sensitivity.time
    if time is not None:
        which = force_shares(result).index(time.share)
        text = ", ".join(f"{row.place} {row.forces[which]}" for row in force_rows(result))
        line = f"Smallest push from 80 % of the directions, {time_text(time)}: {visible(text)}"
        parts.append(f"{wrapped(line, width, '  ')}\n")
    return parts


def important_findings(result: AuditResult) -> list[tuple[Finding, int]]:
    """Warnings and errors that matter most first, and how many of a kind there are; without what the verdict says.

    Where nothing was judged, what is wrong with the whole log comes first: findings on joints follow from it.
    """
    idle = nothing_judged(result)
    said = {*result.reasons, *result.exclusions}
    left = [f for f in result.findings if f.severity != "info" and f.text not in said]
    order = sorted(
        left,
        key=lambda f: (
            idle and f.joint is not None,
            not f.forbids_pass,
            f.severity != "error",
            f.effect == "none",
            f.code,
        ),
    )
    return [(group[0], len(group)) for _, found in groupby(order, key=lambda f: f.code) if (group := list(found))]


def _findings(result: AuditResult, width: int | None) -> list[str]:
    found = important_findings(result)
    if not found:
        return []
    total = sum(count for _, count in found)
    shown = found[:_MOST_FINDINGS]
    parts = [f"\nFindings ({sum(count for _, count in shown)} of {total} warnings and errors)\n"]
    for finding, count in shown:
        others = f" (and {count - 1} more of this kind)" if count > 1 else ""
        line = f"  {finding.severity:<8}{finding.code}: {visible(finding.text)}{others}"
        parts.append(f"{wrapped(line, width, ' ' * 10)}\n")
    return parts


def _highest(result: AuditResult, contacts: Sequence[Contact], most: int) -> list[Contact]:
    """The contacts with the highest residual for its threshold, in order of time."""

    def height(contact: Contact) -> float:
        inside = [
            abs(a.peak_nm) / a.gamma_nm
            for a in result.collisions
            if a.joint in contact.joints and contact.onset_s <= a.onset_s <= contact.end_s
        ]
        return max(inside, default=0.0)

    ranked = contacts if len(contacts) <= most else sorted(contacts, key=height, reverse=True)[:most]
    return sorted(ranked, key=lambda contact: contact.onset_s)


def _listed(texts: Sequence[str], most: int | None, width: int | None) -> list[str]:
    shown = texts[:most]
    left = len(texts) - len(shown)
    more = [f"  - {plural(left, 'more line')}: -v lists all\n"] if left else []
    return [f"{wrapped(f'  - {visible(text)}', width, '    ')}\n" for text in shown] + more
