"""What became of the entries of accepted.toml in a night: which counted, and which are to be looked at again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from typing import Literal

from collaudit.core.config.accepted import Acceptance
from collaudit.core.contacts.contact_states import Precedents, concerns, day_refusal, means, refusal
from collaudit.core.data.audit_result import AuditResult

UseState = Literal["counted", "expired", "too long", "no longer matches", "unused", "not asked"]


@dataclass(frozen=True, slots=True)
class AcceptanceUse:
    """One entry of accepted.toml in one night.

    Attributes:
        number: of the entry, from 1.
        state: ``counted``; ``expired``; ``too long``: its day is further ahead than the policy allows; ``no longer
            matches``: what it means came, and is not what was accepted; ``unused``: its logs were judged and nothing
            like it came; ``not asked``: no log of tonight is one that it means.
        text: the entry in words, and why.
    """

    number: int
    state: UseState
    text: str


def acceptance_uses(
    entries: Sequence[Acceptance], logs: Sequence[tuple[Precedents, AuditResult]], today: date
) -> list[AcceptanceUse]:
    """What became of each entry.

    Args:
        entries: of accepted.toml.
        logs: audited ones, each with what was known of it.
        today: day on which they are looked at.
    """
    uses = []
    for number, entry in enumerate(entries, 1):
        asked = [(known, result) for known, result in logs if concerns(entry, known, result.log.sha256)]
        meant = [c for known, result in asked for c in result.contacts if means(entry, c, known, result.log.sha256)]
        why = [refusal(entry, contact, today) for contact in meant]
        day = day_refusal(entry, today)
        state: UseState = "unused" if asked else "not asked"
        if day is not None:
            state = "expired" if entry.until < today else "too long"
        elif None in why:
            state = "counted"
        elif meant:
            state = "no longer matches"
        because = day or (why[0] if state == "no longer matches" else None)
        uses.append(AcceptanceUse(number, state, entry.words + (f" ({because})" if because else "")))
    return uses
