"""The verdict: pass, fail, or not judged, each with its reasons.

Limits on what happened in a log, in words where they are exceeded.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from scipy.special import gammaincinv as gamma_quantile

from collaudit.core.config.schema import Config, PolicyConfig
from collaudit.core.data.audit_result import AuditResult, Coverage, NearMiss, Verdict
from collaudit.core.data.detection_result import Contact
from collaudit.core.data.sensitivity_result import Sensitivity, noticed_sentence
from collaudit.core.data.signals import reason_text
from collaudit.core.findings import Finding, without_errors_of
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.verdict.coverage import by_joint, seconds_text, too_much_lost

#: So many joints are named in a reason.
_MOST_NAMED = 3


@dataclass(frozen=True, slots=True)
class Evidence:
    """Evidence for a verdict.

    Attributes:
        contacts: alarms that belong together, one each contact.
        near_misses: of the watched joints.
        coverage: what was judged of them.
        sensitivity: how little would have alarmed on them, and on the arm.
        shortfalls: where that is less than the policy asks for.
        findings: of the log and its detection; their effects count.
    """

    contacts: Sequence[Contact]
    near_misses: Sequence[NearMiss]
    coverage: Coverage
    sensitivity: Sensitivity
    shortfalls: Sequence[Finding]
    findings: Sequence[Finding]


def decide(policy: PolicyConfig, evidence: Evidence) -> tuple[Verdict, tuple[str, ...]]:
    """Apply the policy. A broken policy wins; then whatever could not be judged; only then a pass.

    Args:
        policy: what is allowed, and what is to be noticeable.
        evidence: what the log shows.

    Returns:
        The verdict, and its reasons in words.
    """
    broken = [
        *contact_breach(counting(evidence.contacts, policy), policy.max_collisions, evidence.findings),
        *near_miss_breach(len(evidence.near_misses), evidence.coverage.recorded_s, policy.max_near_misses_per_hour),
    ]
    undecided = unjudged(policy, evidence)
    if broken:
        return "fail", tuple(broken + undecided)
    if undecided:
        return "not_judged", tuple(undecided)
    return "pass", (_found(policy, evidence),)


def counting(contacts: Sequence[Contact], policy: PolicyConfig) -> list[Contact]:
    """The contacts that may break the policy: all but accepted ones, and known ones where the policy allows those."""
    free = ("accepted", "known") if policy.known == "allow" else ("accepted",)
    return [contact for contact in contacts if contact.state not in free]


def uncounted_texts(contacts: Sequence[Contact], policy: PolicyConfig) -> list[str]:
    """What a verdict leaves out because of a person's word: each contact that does not count, and why."""
    counted_ids = {contact.id for contact in counting(contacts, policy)}
    texts = []
    for contact in contacts:
        if contact.id not in counted_ids:
            why = "" if contact.state == "accepted" else '; [policy] known = "allow"'
            texts.append(f"Contact {contact.id} at {contact.onset_s:.2f} s: {contact.state_text}{why}.")
    return texts


def _found(policy: PolicyConfig, evidence: Evidence) -> str:
    """What a pass says: events, those that do not count, and what would have been noticed."""
    events = f"{counted(len(evidence.contacts), 'contact')} and " + counted(
        len(evidence.near_misses), "near miss", "near misses"
    )
    said = noticed_sentence(evidence.sensitivity)
    text = f"{events} in {seconds_text(evidence.coverage.recorded_s)}, within the policy"
    accepted = sum(contact.state == "accepted" for contact in evidence.contacts)
    allowed = len(evidence.contacts) - len(counting(evidence.contacts, policy)) - accepted
    parts = [f"{accepted} accepted"] if accepted else []
    parts += [f'{allowed} known, which [policy] known = "allow" lets pass'] if allowed else []
    text += f" ({'; '.join(parts)})." if parts else "."
    return text if said is None else f"{text} {said}"


def unjudged(policy: PolicyConfig, evidence: Evidence) -> list[str]:
    """Why the log cannot pass, whatever happened in it: findings that forbid it, then what the policy lacks."""
    coverage = evidence.coverage
    reasons = _texts([f for f in evidence.findings if f.forbids_pass])
    if too_much_lost(coverage, policy.min_coverage):
        lack = " or lack a value of a watched joint" if coverage.missing_s > 0 else ""
        reasons.append(
            f"{seconds_text(coverage.lost_s)} of {seconds_text(coverage.whole_s)} lie in gaps of the log{lack} "
            f"(policy: at least {100 * policy.min_coverage:g} % must be recorded)."
        )
    sensitivity = evidence.sensitivity
    if sensitivity.push_alarms and all(s.largest_nm is None for s in sensitivity.joints.values()):
        return [*reasons, _nothing(evidence)]
    return reasons + [short.text for short in evidence.shortfalls]


def _texts(findings: Sequence[Finding]) -> list[str]:
    """Texts of findings; what is said of several joints in the same words is said once."""
    alike: dict[str, list[Finding]] = {}
    for finding in findings:
        words = finding.text if finding.joint is None else finding.text.replace(f"'{finding.joint}'", "")
        alike.setdefault(words, []).append(finding)
    out = []
    for group in alike.values():
        others = [f.joint for f in group[1:] if f.joint is not None]
        out.append(group[0].text + (f" The same holds for {', '.join(others)}." if others else ""))
    return out


def _nothing(evidence: Evidence) -> str:
    """Why no joint could be judged at any moment."""
    watched = {joint: cover for joint, cover in evidence.coverage.joints.items() if cover.watched}
    causes: dict[str, dict[str, float]] = {}
    for joint, cover in watched.items():
        for reason, seconds in cover.not_judged_s.items():
            causes.setdefault(reason_text(reason), {})[joint] = seconds
        if cover.standing_s > 0:
            causes.setdefault("friction known only as a range", {})[joint] = cover.standing_s
    parts = [f"{reason}: {by_joint(seconds, len(watched))}" for reason, seconds in causes.items()]
    return f"No joint could be judged: {'; '.join(parts) or 'nothing was watched'}."


def asked_findings(prepared: Prepared, config: Config, more: Sequence[Finding] = ()) -> tuple[Finding, ...]:
    """The findings of a prepared log, and more; errors of joints that are not to be judged are warnings.

    A joint is asked for when it is judged (``[robot] joints``) and watched (``[detect] watch``).

    Args:
        prepared: the log.
        config: which joints are watched.
        more: findings beside its own.
    """
    watch = config.detect.watch
    asked = {joint for joint in prepared.judged if watch == "auto" or joint in watch}
    return without_errors_of((*prepared.findings, *more), set(prepared.series.joint_names) - asked)


def contact_breach(contacts: Sequence[Contact], most: int, findings: Sequence[Finding]) -> list[str]:
    """Why contacts break the policy; nothing where they do not.

    Args:
        contacts: of the log, those that count.
        most: as many are allowed.
        findings: of the log; those that doubt alarms of these joints are said.
    """
    if len(contacts) <= most:
        return []
    joints = sorted({joint for contact in contacts for joint in contact.joints})
    named = ", ".join(joints) if len(joints) <= _MOST_NAMED else f"{len(joints)} joints"
    reasons = [f"{counted(len(contacts), 'contact')} (policy: at most {most}), on {named}."]
    states = Counter(contact.state_text for contact in contacts if contact.state_text)
    reasons += [f"{counted(count, 'contact')}: {text}." for text, count in states.items()]
    intended = sum(contact.kind == "meant" for contact in contacts)
    if intended:
        reasons.append(
            f"{intended} of them {'looks' if intended == 1 else 'look'} intended. The policy counts every contact, "
            "since what was intended is an estimate."
        )
    doubting = [f for f in findings if f.doubts_alarms and f.joint in joints]
    doubtful = sorted({f.joint for f in doubting if f.joint is not None})
    if doubtful:
        reasons.append(
            f"Alarms of {', '.join(doubtful)} may be errors of the model or of the effort: see the findings on it."
        )
    reasons += [f.text for f in doubting if f.kind.setting == "detect.gamma_nm"]
    return reasons


def near_miss_breach(count: int, recorded_s: float, most_per_hour: float | None, where: str = "") -> list[str]:
    """Why near misses break the policy: the lower bound of their rate exceeds it. Nothing where they do not.

    Args:
        count: of near misses.
        recorded_s: seconds recorded.
        most_per_hour: so many an hour are allowed; None for any number.
        where: words for the logs they are counted in, if not one alone.
    """
    least = least_per_hour(count, recorded_s)
    if most_per_hour is None or not count or least <= most_per_hour:
        return []
    hourly = f"{count / (recorded_s / 3600.0):.3g} an hour, at least {least:.3g}"
    return [
        f"{counted(count, 'near miss', 'near misses')} in {seconds_text(recorded_s)}{where}: {hourly} "
        f"(95 %; policy: at most {most_per_hour:g})."
    ]


def budget_breaches(logs: Sequence[tuple[str | None, AuditResult]]) -> list[str]:
    """Why the near misses of a night break the policy, a sentence a robot: single logs are too short to tell a rate.

    Args:
        logs: audited ones, each with its robot; None without a fleet.
    """
    breaches = []
    for robot in dict.fromkeys(robot for robot, _ in logs):
        own = [result for name, result in logs if name == robot]
        limits = [one.limits.max_near_misses_per_hour for one in own if one.limits is not None]
        limit = next((limit for limit in limits if limit is not None), None)
        if len(own) > 1:
            count, recorded_s = sum(len(one.near_misses) for one in own), sum(one.coverage.recorded_s for one in own)
            where = f", {len(own)} logs" + (f" of robot {robot}" if robot else "")
            breaches += near_miss_breach(count, recorded_s, limit, where)
    return breaches


def least_per_hour(count: int, recorded_s: float) -> float:
    """The lower 95 % bound of a rate an hour, of a count of Poisson events (exact; Garwood 1936)."""
    if not count or recorded_s <= 0:
        return 0.0
    return float(gamma_quantile(count, 0.05)) / (recorded_s / 3600.0)


def counted(number: int, one: str, many: str | None = None) -> str:
    """A number and its noun."""
    return f"{number} {one if number == 1 else many or one + 's'}"
