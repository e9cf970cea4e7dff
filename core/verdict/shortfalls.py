"""Joints on which less would have been noticed than the policy asks for."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from collaudit.core.config.schema import PolicyConfig
from collaudit.core.data.audit_result import Coverage, JointCoverage
from collaudit.core.data.sensitivity_result import JointSensitivity, TimeShares
from collaudit.core.dataclass import dataclass
from collaudit.core.findings import Finding
from collaudit.core.verdict.exclusions import seconds_text, state_text

#: Motion shorter than this that could not be judged is an exclusion, and does not take the verdict away.
_BRIEF_S = 0.5


@dataclass(frozen=True, slots=True)
class Shortfall:
    """A joint, and what is missing on it for the policy, in words."""

    joint: str
    text: str


def shortfalls(
    policy: PolicyConfig, coverage: Coverage, sensitivity: Mapping[str, JointSensitivity], forbidden: Collection[str]
) -> tuple[Shortfall, ...]:
    """What each watched joint lacks: motion that tells anything, motion that tells enough, rest that is not too long.

    Args:
        policy: what is asked.
        coverage: seconds by joint and reason.
        sensitivity: of the watched joints.
        forbidden: joints that a finding forbids judging; it says all there is to say.
    """
    out = []
    for joint, s in sensitivity.items():
        if joint in forbidden:
            continue
        cover = coverage.joints[joint]
        text = None
        if cover.moving_s > 0:
            text = _untold(policy, joint, s, cover) or _hidden(policy, joint, s, cover)
        if text is None and s.longest_hidden_s > policy.max_hidden_s:
            text = (
                f"Joint '{joint}' could hide {s.observable_nm:.3g} N·m for {seconds_text(s.longest_hidden_s)} without "
                f"a break (policy: at most {seconds_text(policy.max_hidden_s)}): {_what(s.all, s, cover)}"
            )
        if text is not None:
            out.append(Shortfall(joint, text))
    return tuple(out)


def coverage_findings(missing: tuple[Shortfall, ...]) -> list[Finding]:
    """The shortfalls as findings."""
    return [Finding("coverage-low", "warning", short.text, joint=short.joint) for short in missing]


def _untold(policy: PolicyConfig, joint: str, s: JointSensitivity, cover: JointCoverage) -> str | None:
    motion = s.motion
    told = motion.time_s - motion.not_judged_s
    if told >= policy.min_coverage * motion.time_s or motion.not_judged_s < _BRIEF_S:
        return None
    return (
        f"Joint '{joint}': only {_percent(told, motion)} of {seconds_text(motion.time_s)} of motion, gaps included, "
        f"could be judged (policy: at least {100 * policy.min_coverage:g} %){_reasons(cover)}."
    )


def _hidden(policy: PolicyConfig, joint: str, s: JointSensitivity, cover: JointCoverage) -> str | None:
    motion = s.motion
    seen = motion.detectable_s
    if seen >= policy.min_observable * motion.time_s or motion.time_s - seen < _BRIEF_S:
        return None
    asked = "as stated" if s.observable_stated else "its threshold and its friction"
    return (
        f"Joint '{joint}': a torque of {s.observable_nm:.3g} N·m ({asked}) would have alarmed in "
        f"{_percent(seen, motion)} of its {seconds_text(motion.time_s)} of motion (policy: at least "
        f"{100 * policy.min_observable:g} %): {_what(motion, s, cover)}"
    )


def _what(time: TimeShares, s: JointSensitivity, cover: JointCoverage) -> str:
    """How much friction hides, and what is not judged and why."""
    parts = []
    if time.hidden_s > 0 and s.largest_nm is not None:
        parts.append(f"in {seconds_text(time.hidden_s)} friction hides up to {s.largest_nm:.3g} N·m")
    if time.not_judged_s > 0:
        parts.append(f"in {seconds_text(time.not_judged_s)} nothing could be judged{_reasons(cover)}")
    return "; ".join(parts) + "."


def _reasons(cover: JointCoverage) -> str:
    worst = sorted(cover.not_judged_s.items(), key=lambda item: -item[1])[:2]
    return f" ({', '.join(f'{state_text(code)}, {seconds_text(value)}' for code, value in worst)})" if worst else ""


def _percent(part: float, time: TimeShares) -> str:
    return f"{100 * part / time.time_s:.3g} %"
