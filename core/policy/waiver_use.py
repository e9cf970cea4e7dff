"""Waivers: which breach each covers, until when, and what is said of those that are over; which logs patterns mean."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from datetime import date
from fnmatch import fnmatchcase

from collaudit.core.config.schema import PolicyOverride, Waiver
from collaudit.core.data.policy_result import RuleOutcome
from collaudit.core.findings import Finding


class WaiverBook:
    """The waivers of an audit; it remembers which were needed."""

    def __init__(self, waivers: Sequence[Waiver], today: date) -> None:
        self._waivers = tuple(waivers)
        self._today = today
        self._needed: set[int] = set()

    def applied(self, outcome: RuleOutcome, place: str, robot: str | None) -> RuleOutcome:
        """The outcome with what a waiver makes of it.

        Only a breach is waived. What could not be judged stays so, and the note says that a waiver was there.

        Args:
            outcome: of one rule.
            place: path or URL of the log.
            robot: whose it is.
        """
        if outcome.state not in ("broken", "not_judged"):
            return outcome
        matching = [(k, w) for k, w in enumerate(self._waivers) if self._means(w, outcome, place, robot)]
        notes = [] if outcome.note is None else [outcome.note]
        for k, waiver in matching:
            self._needed.add(k)
            who = f"waiver by {waiver.owner} until {waiver.expires}: {waiver.reason}"
            if self._today > waiver.expires:
                notes.append(f"expired {who}")
            elif outcome.state == "not_judged":
                notes.append(f"{who}; it does not cover what was not judged")
            elif waiver.up_to is not None and (outcome.value is None or outcome.value > waiver.up_to):
                notes.append(f"{who}; it covers no more than {waiver.up_to:g}")
            else:
                return replace(outcome, state="waived", note="; ".join([*notes, who]))
        return replace(outcome, note="; ".join(notes) or None)

    def findings(self) -> list[Finding]:
        """Waivers that are over, and those that nothing needed."""
        found = []
        for k, waiver in enumerate(self._waivers):
            what = f"The waiver of {waiver.rule} by {waiver.owner} ({waiver.reason})"
            if self._today > waiver.expires:
                text = f"{what} expired after {waiver.expires} and waives nothing."
                found.append(Finding("waiver-expired", "warning", text))
            elif k not in self._needed:
                text = f"{what}, until {waiver.expires}, was needed by no log of this audit."
                found.append(Finding("waiver-unused", "info", text))
        return found

    def _means(self, waiver: Waiver, outcome: RuleOutcome, place: str, robot: str | None) -> bool:
        if waiver.rule != outcome.rule or not concerns(waiver, place, robot):
            return False
        return not waiver.joints or (bool(outcome.joints) and set(outcome.joints) <= set(waiver.joints))


def matches(text: str, patterns: Iterable[str]) -> bool:
    """Whether a path, URL or name is meant by one of the patterns.

    Args:
        text: with ``/`` between folders.
        patterns: with ``*`` (over folders, too), ``?`` and ``[…]``. One that does not begin with ``/`` or a scheme is
            also tried from every folder on: ``cell1/*`` means ``logs/cell1/a.mcap``, and not ``logs/xcell1/a.mcap``.
    """
    plain = text.removeprefix("./")
    return any(fnmatchcase(plain, pattern) or fnmatchcase(plain, f"*/{pattern}") for pattern in patterns)


def concerns(rule: PolicyOverride | Waiver, place: str, robot: str | None) -> bool:
    """Whether an override or a waiver is for a log.

    Args:
        rule: with patterns of robots and logs; it is for every one where it has none.
        place: path or URL of the log.
        robot: whose it is, None without a fleet.
    """
    if rule.robots and (robot is None or not matches(robot, rule.robots)):
        return False
    return not rule.logs or matches(place, rule.logs)
