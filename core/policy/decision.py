"""From what each rule says to the decision on a log: a breach wins, then what is not known, only then a pass."""

from __future__ import annotations

from collections.abc import Collection

from collaudit.core.data.audit_result import Verdict
from collaudit.core.data.policy_result import LogDecision, RuleOutcome
from collaudit.core.policy.baseline import Baseline
from collaudit.core.policy.rule_outcomes import LogInQuestion, RuleBook
from collaudit.core.policy.waiver_use import WaiverBook


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
    if same and not notes and not undecided and all(_in_core(one) for one in broken):
        return result.reasons
    own = result.unjudged or (result.reasons if result.verdict == "not_judged" else ())
    if verdict == "pass":
        own = result.reasons if result.verdict == "pass" else ("Nothing else breaks the policy.",)
        if near and not notes:
            own = (f"Near misses of the night keep the policy, though not those of this log alone: {near[0]}",)
    why = (*(_sentence(one) for one in broken), *(one.text for one in undecided))
    return (*why, *notes, *own) if verdict == "pass" else (*why, *own, *notes)


def _in_core(one: RuleOutcome) -> bool:
    """Rules that a log's own verdict has judged already, in the same words."""
    return one.rule in ("contacts", "near_misses") and one.note is None


def _sentence(one: RuleOutcome) -> str:
    head = {"known": "Known: ", "waived": "Waived: ", "broken": "", "not_judged": "Not judged: ", "kept": ""}[one.state]
    if one.level == "warn":
        head = f"Warning: {head}"
    return f"{head}{one.text}" + (f" ({one.note})" if one.note else "")
