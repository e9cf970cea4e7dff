"""From what each rule says to the decision on a log: a breach wins, then what is not known; what waivers cover."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from datetime import date
from fnmatch import fnmatchcase

from collaudit.core.config.schema import PolicyOverride, Waiver
from collaudit.core.data.audit_result import Verdict
from collaudit.core.data.policy_result import LogDecision, RuleOutcome
from collaudit.core.findings import Finding
from collaudit.core.policy.baseline import Baseline
from collaudit.core.policy.rule_outcomes import LogInQuestion, RuleBook

#: Rules that a log's own verdict has judged already, in the same words.
_IN_CORE = ("contacts", "near_misses")


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


def decide_log(
    log: LogInQuestion, waivers: WaiverBook, baseline: Baseline | None, fail_on: Collection[str] = ()
) -> LogDecision:
    """Decide on one finished audit.

    Args:
        log: its result, and the policy for it.
        waivers: of the whole audit.
        baseline: what it is compared with, if anything.
        fail_on: ``warn`` makes warnings break the policy.
    """
    book = RuleBook(log, baseline)
    rules = [waivers.applied(one, log.place, log.robot) for one in book.outcomes()]
    fails = {"error", "warn"} if "warn" in fail_on else {"error"}
    broken = [one for one in rules if one.state == "broken" and one.level in fails]
    undecided = [one for one in rules if one.state == "not_judged" and one.level in fails]
    verdict: Verdict = "pass"
    if broken:
        verdict = "fail"
    elif undecided or log.result.unjudged or log.result.verdict == "not_judged":
        verdict = "not_judged"
    notes = [_sentence(one) for one in rules if one not in broken and one not in undecided and one.state != "kept"]
    notes += book.off()
    return LogDecision(
        log=log.result.log.name,
        robot=log.robot,
        place=log.place,
        folder=log.folder,
        verdict=verdict,
        reasons=_reasons(log, verdict, broken, undecided, notes),
        rules=tuple(rules),
    )


def _reasons(
    log: LogInQuestion, verdict: Verdict, broken: list[RuleOutcome], undecided: list[RuleOutcome], notes: list[str]
) -> tuple[str, ...]:
    result, near = log.result, log.near_misses_alone
    same = verdict == result.verdict and near == [one.text for one in broken if one.rule == "near_misses"]
    if same and not notes and not undecided and all(one.rule in _IN_CORE and one.note is None for one in broken):
        return result.reasons
    own = result.unjudged or (result.reasons if result.verdict == "not_judged" else ())
    if verdict == "pass":
        own = result.reasons if result.verdict == "pass" else ("Nothing else breaks the policy.",)
        if near and not notes:
            own = (f"Near misses of the night keep the policy, though not those of this log alone: {near[0]}",)
    why = (*(_sentence(one) for one in broken), *(one.text for one in undecided))
    return (*why, *notes, *own) if verdict == "pass" else (*why, *own, *notes)


def _sentence(one: RuleOutcome) -> str:
    head = {"known": "Known: ", "waived": "Waived: ", "broken": "", "not_judged": "Not judged: ", "kept": ""}[one.state]
    if one.level == "warn":
        head = f"Warning: {head}"
    return f"{head}{one.text}" + (f" ({one.note})" if one.note else "")
