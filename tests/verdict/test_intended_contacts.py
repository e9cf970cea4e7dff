"""Contacts that look intended count, and the verdict says that they do."""

from __future__ import annotations

from collaudit.core.config.schema import PolicyConfig
from collaudit.core.data.audit_result import Coverage
from collaudit.core.data.detection_result import Contact, ContactKind
from collaudit.core.data.sensitivity_result import Sensitivity
from collaudit.core.verdict.verdict import Evidence, decide


def reasons(*kinds: ContactKind, allowed: int = 0) -> tuple[str, ...]:
    contacts = [Contact(k, k + 0.03, k + 0.1, ("j",), "link", "", None, kind, ()) for k, kind in enumerate(kinds)]
    evidence = Evidence(contacts, (), Coverage(10.0, 0.0, {}), Sensitivity({}), (), ())
    verdict, told = decide(PolicyConfig(max_collisions=allowed), evidence)
    assert verdict == ("fail" if len(kinds) > allowed else "not_judged")
    return told


def test_intended_contacts_count_and_the_reasons_say_why() -> None:
    told = reasons("meant", "accidental", "meant")
    assert told[0] == "3 contacts (policy: at most 0), on j."
    assert told[1].startswith("2 of them look intended. The policy counts every contact")
    assert reasons("meant")[1].startswith("1 of them looks intended.")


def test_nothing_is_said_of_intentions_where_none_shows_or_the_policy_is_kept() -> None:
    assert not any("intended" in text for text in reasons("accidental", "undecided"))
    assert not any("intended" in text for text in reasons("meant", allowed=1))
