"""The verdict: pass, fail, or not judged, each with its reasons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from collaudit.core.config.schema import PolicyConfig
from collaudit.core.data.audit_result import Collision, Coverage, JointCoverage, NearMiss, Verdict
from collaudit.core.findings import Finding

#: Reasons that concern the whole log and are said once.
_NOT_THE_JOINTS = frozenset({"gap", "edge"})
_WORTH_SAYING_S = 0.1
_INTERVAL = "at rest, reversing or slower than friction was measured"


def decide(
    policy: PolicyConfig,
    collisions: Sequence[Collision],
    near_misses: Sequence[NearMiss],
    coverage: Coverage,
    findings: Sequence[Finding],
) -> tuple[Verdict, tuple[str, ...]]:
    """Apply the policy. A broken policy wins; then whatever could not be judged; only then a pass.

    Args:
        policy: what is allowed, and how much is to be judged.
        collisions, near_misses: of the watched joints.
        coverage: what was judged of them.
        findings: of the log and its detection; their effects count.

    Returns:
        The verdict, and its reasons in words.
    """
    broken = _broken(policy, collisions, near_misses, coverage, findings)
    unjudged = _not_judged(policy, coverage, findings)
    if broken:
        return "fail", tuple(broken + unjudged)
    if unjudged:
        return "not_judged", tuple(unjudged)
    judged = {j: c for j, c in coverage.joints.items() if c.watched and c.judged_s > 0}
    seconds = sum(c.judged_s for c in judged.values())
    found = (
        f"{_count(len(collisions), 'collision')} and {_count(len(near_misses), 'near miss', 'near misses')} in "
        f"{seconds:.4g} joint-seconds judged on {_count(len(judged), 'joint')}, within the policy."
    )
    return "pass", (found, *_left_out(coverage))


def _left_out(coverage: Coverage) -> list[str]:
    """What a pass does not speak of: time in gaps, joints not watched, time not judged."""
    parts = []
    if coverage.gaps_s > 0:
        parts.append(f"{coverage.gaps_s:.4g} s in gaps of the log")
    away = [joint for joint, cover in coverage.joints.items() if not cover.watched]
    if away:
        parts.append("joints not watched: " + ", ".join(away))
    for joint, cover in coverage.joints.items():
        if cover.watched:
            seconds = sum(s for reason, s in cover.not_judged_s.items() if reason not in _NOT_THE_JOINTS)
            if seconds >= _WORTH_SAYING_S:
                causes = _causes({joint: replace(cover, standing_s=0.0)})
                parts.append(f"{joint}: {causes.rstrip('.')}")
    return ["Not judged, so not part of this pass: " + "; ".join(parts) + "."] if parts else []


def _count(number: int, one: str, many: str | None = None) -> str:
    return f"{number} {one if number == 1 else many or one + 's'}"


def _broken(
    policy: PolicyConfig,
    collisions: Sequence[Collision],
    near_misses: Sequence[NearMiss],
    coverage: Coverage,
    findings: Sequence[Finding],
) -> list[str]:
    reasons = []
    if len(collisions) > policy.max_collisions:
        joints = sorted({c.joint for c in collisions})
        reasons.append(
            f"{_count(len(collisions), 'collision')} (policy: at most {policy.max_collisions}), on {', '.join(joints)}."
        )
        doubtful = sorted({f.joint for f in findings if f.effect == "doubts-alarms" and f.joint in joints})
        if doubtful:
            reasons.append(
                f"The model or friction of {', '.join(doubtful)} fits too poorly for the threshold: alarms there may "
                "be errors of the model (see the findings)."
            )
    if policy.max_near_misses_per_hour is not None and near_misses and coverage.recorded_s > 0:
        rate = len(near_misses) / (coverage.recorded_s / 3600.0)
        if rate > policy.max_near_misses_per_hour:
            reasons.append(
                f"{_count(len(near_misses), 'near miss', 'near misses')} in {coverage.recorded_s:.4g} s is "
                f"{rate:.4g} an hour (policy: at most {policy.max_near_misses_per_hour:g})."
            )
    return reasons


def _not_judged(policy: PolicyConfig, coverage: Coverage, findings: Sequence[Finding]) -> list[str]:
    """Findings that forbid a pass, then what is missing for the policy; a joint named by a finding is not repeated."""
    reasons = [f.text for f in findings if f.forbids_pass]
    named = {f.joint for f in findings if f.effect == "not-judged-joint"}
    if coverage.gaps_s > (1.0 - policy.min_coverage) * (coverage.recorded_s + coverage.gaps_s):
        reasons.append(
            f"{coverage.gaps_s:.4g} s of {coverage.recorded_s + coverage.gaps_s:.4g} s lie in gaps of the log (policy: "
            f"at least {100 * policy.min_coverage:g} % must be judged)."
        )
    watched = {j: c for j, c in coverage.joints.items() if c.watched}
    if not any(c.judged_s > 0 for c in watched.values()):
        return [*reasons, "No joint could be judged: " + _causes(watched)]
    for joint, cover in watched.items():
        if joint in named:
            continue
        moving = cover.moving_s + coverage.gaps_s  # in a gap it may have moved: nobody can tell
        if cover.moving_s > 0 and cover.judged_s < policy.min_coverage * moving:
            share = 100.0 * cover.judged_s / moving
            lost = f" and {coverage.gaps_s:.4g} s of gaps" if coverage.gaps_s > 0 else ""
            reasons.append(
                f"Joint '{joint}': only {share:.3g} % of its {cover.moving_s:.4g} s of motion{lost} could be judged "
                f"(policy: at least {100 * policy.min_coverage:g} %): {_causes({joint: cover})}"
            )
    return reasons


def _causes(joints: dict[str, JointCoverage]) -> str:
    """The main reasons of not judging, with their seconds."""
    total: dict[str, float] = {}
    for cover in joints.values():
        for reason, seconds in cover.not_judged_s.items():
            total[reason] = total.get(reason, 0.0) + seconds
        if cover.standing_s:
            total[_INTERVAL] = total.get(_INTERVAL, 0.0) + cover.standing_s
    if not total:
        return "nothing was watched."
    parts = sorted(total.items(), key=lambda item: -item[1])
    return ", ".join(f"{reason} {seconds:.4g} s" for reason, seconds in parts) + "."
