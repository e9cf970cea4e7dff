"""The verdict, why, what it does not speak of, and the numbers that go with it."""

from __future__ import annotations

from dataclasses import dataclass

from collaudit.core.data.audit_result import AuditResult, Verdict
from collaudit.reports.values.contact_rows import contacts_of
from collaudit.reports.values.numbers import duration, percent
from collaudit.reports.values.rows import NONE
from collaudit.reports.values.sensitivity_rows import lost_share, noticed_facts, noticed_line
from collaudit.reports.values.words import VERDICT_SENTENCE, counted, verdict_word


@dataclass(frozen=True, slots=True)
class VerdictBox:
    """What stands in the box; ``noticed``: what would have been, unless a reason says it; ``facts``: terms, values."""

    verdict: Verdict
    word: str
    sentence: str
    noticed: str | None
    reasons: tuple[str, ...]
    exclusions: tuple[str, ...]
    facts: tuple[tuple[str, str], ...]


def verdict_box(result: AuditResult) -> VerdictBox:
    """The box of one audit."""
    return VerdictBox(
        verdict=result.verdict,
        word=verdict_word(result.verdict, result.exclusions),
        sentence=VERDICT_SENTENCE[result.verdict],
        noticed=noticed_line(result),
        reasons=result.reasons,
        exclusions=result.exclusions,
        facts=_facts(result),
    )


def _facts(result: AuditResult) -> tuple[tuple[str, str], ...]:
    lost = lost_share(result)
    return (
        ("Contacts", counted(len(contacts_of(result)), result)),
        ("Near misses", counted(len(result.near_misses), result)),
        *noticed_facts(result),
        ("Not judged", NONE if lost is None else percent(lost)),
        ("Joints watched", _watched(result)),
        ("Recorded", duration(result.coverage.recorded_s)),
    )


def _watched(result: AuditResult) -> str:
    """How many, and how many of them were left out in some phase."""
    joints = result.coverage.joints.values()
    parts = sum(joint.watched and "not-watched" in joint.not_judged_s for joint in joints)
    text = f"{sum(joint.watched for joint in joints)} of {len(joints)}"
    return f"{text}, {parts} in part" if parts else text
