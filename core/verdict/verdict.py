"""The verdict: pass, fail, or not judged, each with its reasons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field

from collaudit.core.config.schema import PolicyConfig
from collaudit.core.data.audit_result import Coverage, NearMiss, Verdict
from collaudit.core.data.detection_result import Contact
from collaudit.core.data.sensitivity_result import JointSensitivity
from collaudit.core.dataclass import dataclass
from collaudit.core.findings import Finding
from collaudit.core.verdict.breaches import contact_breach, counted, near_miss_breach
from collaudit.core.verdict.exclusions import by_joint, seconds_text, state_text
from collaudit.core.verdict.shortfalls import Shortfall


@dataclass(frozen=True, slots=True)
class Evidence:
    """Evidence for a verdict.

    Attributes:
        contacts: alarms that belong together, one each contact.
        near_misses: of the watched joints.
        coverage: what was judged of them.
        sensitivity: how little would have alarmed on them.
        shortfalls: where that is less than the policy asks for.
        findings: of the log and its detection; their effects count.
        units: by joint, of what its drive exerts; N·m where absent.
    """

    contacts: Sequence[Contact]
    near_misses: Sequence[NearMiss]
    coverage: Coverage
    sensitivity: Mapping[str, JointSensitivity]
    shortfalls: Sequence[Shortfall]
    findings: Sequence[Finding]
    units: Mapping[str, str] = field(default_factory=dict)


def decide(policy: PolicyConfig, evidence: Evidence) -> tuple[Verdict, tuple[str, ...]]:
    """Apply the policy. A broken policy wins; then whatever could not be judged; only then a pass.

    Args:
        policy: what is allowed, and what is to be noticeable.
        evidence: what the log shows.

    Returns:
        The verdict, and its reasons in words.
    """
    broken = _broken(policy, evidence)
    untold = unjudged(policy, evidence)
    if broken:
        return "fail", tuple(broken + untold)
    if untold:
        return "not_judged", tuple(untold)
    return "pass", (_found(evidence),)


def _found(evidence: Evidence) -> str:
    """What a pass says: events, and what would have been noticed in the motion of each joint."""
    events = f"{counted(len(evidence.contacts), 'contact')} and " + counted(
        len(evidence.near_misses), "near miss", "near misses"
    )
    seen = {j: s for j, s in evidence.sensitivity.items() if s.motion.detectable_s > 0}
    if not seen:
        return f"{events}, within the policy."
    share = [s.motion.detectable_s / s.motion.time_s for s in seen.values()]
    time = seconds_text(evidence.coverage.recorded_s)
    joints = counted(len(seen), "moving joint")
    return (
        f"{events} in {time}, within the policy. On {joints} {_asked(seen, evidence.units)} would have alarmed in "
        f"{_range([100 * x for x in share], '.0f')} % of the motion."
    )


def _asked(seen: Mapping[str, JointSensitivity], units: Mapping[str, str]) -> str:
    """What would have alarmed: torques of turning joints, forces of sliding ones."""
    forces = [s.observable_nm for joint, s in seen.items() if units.get(joint) == "N"]
    torques = [s.observable_nm for joint, s in seen.items() if units.get(joint) != "N"]
    kinds = (("a torque", torques, "N·m"), ("a force", forces, "N"))
    return " or ".join(f"{what} of {_range(values, '.3g')} {unit}" for what, values, unit in kinds if values)


def _range(values: Sequence[float], form: str) -> str:
    low, high = (format(value, form) for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def _broken(policy: PolicyConfig, evidence: Evidence) -> list[str]:
    near_misses, recorded_s = len(evidence.near_misses), evidence.coverage.recorded_s
    return [
        *contact_breach(evidence.contacts, policy.max_collisions, evidence.findings),
        *near_miss_breach(near_misses, recorded_s, policy.max_near_misses_per_hour),
    ]


def unjudged(policy: PolicyConfig, evidence: Evidence) -> list[str]:
    """Why the log cannot pass, whatever happened in it: findings that forbid it, then what the policy lacks."""
    coverage = evidence.coverage
    reasons = _texts([f for f in evidence.findings if f.forbids_pass])
    if coverage.gaps_s > (1.0 - policy.min_coverage) * (coverage.recorded_s + coverage.gaps_s):
        reasons.append(
            f"{seconds_text(coverage.gaps_s)} of {seconds_text(coverage.recorded_s + coverage.gaps_s)} lie in gaps of "
            f"the log (policy: at least {100 * policy.min_coverage:g} % must be recorded)."
        )
    if not any(s.all.detectable_s > 0 for s in evidence.sensitivity.values()):
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
            causes.setdefault(state_text(reason), {})[joint] = seconds
        if cover.standing_s > 0:
            causes.setdefault("friction known only as a range", {})[joint] = cover.standing_s
    parts = [f"{reason}: {by_joint(seconds, len(watched))}" for reason, seconds in causes.items()]
    return f"No joint could be judged: {'; '.join(parts) or 'nothing was watched'}."
