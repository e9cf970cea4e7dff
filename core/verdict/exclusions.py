"""What a verdict does not cover: kinds of contact, gaps, joints not watched, time not judged, hidden torque."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from collaudit.core.data.audit_result import Coverage
from collaudit.core.data.sensitivity_result import JointSensitivity
from collaudit.core.data.signals import State
from collaudit.core.findings import Finding

#: Time that is worth saying, and that next to gaps and ends, which every log has.
_WORTH_SAYING_S, _WORTH_SAYING_OF_EDGES_S = 0.1, 1.0


def exclusions(
    coverage: Coverage,
    sensitivity: Mapping[str, JointSensitivity],
    findings: Iterable[Finding] = (),
    units: Mapping[str, str] | None = None,
) -> tuple[str, ...]:
    """One sentence for each kind of contact, time or joint that the verdict does not cover.

    Args:
        coverage: seconds by joint and reason.
        sensitivity: of the watched joints.
        findings: of the log and its detection; those that exclude a kind of contact are said first.
        units: by joint, of what its drive exerts; N·m where absent.
    """
    out = list(dict.fromkeys(finding.text for finding in findings if finding.effect == "excludes"))
    if coverage.gaps_s > 0:
        out.append(f"Gaps in the log: {seconds_text(coverage.gaps_s)}.")
    away = [joint for joint, cover in coverage.joints.items() if not cover.watched]
    if away:
        out.append(f"Joints not watched: {', '.join(away)}.")
    return (*out, *_not_judged(coverage), *_hidden(sensitivity, units or {}))


def _not_judged(coverage: Coverage) -> list[str]:
    """By reason, longest first."""
    watched = {joint: cover for joint, cover in coverage.joints.items() if cover.watched}
    total: dict[str, float] = {}
    for cover in watched.values():
        for reason, seconds in cover.not_judged_s.items():
            total[reason] = max(total.get(reason, 0.0), seconds)
    out = []
    for reason in sorted(total, key=lambda r: (-total[r], r)):
        least = _WORTH_SAYING_OF_EDGES_S if State.of(reason) is State.EDGE else _WORTH_SAYING_S
        joints = {joint: cover.not_judged_s.get(reason, 0.0) for joint, cover in watched.items()}
        said = {joint: seconds for joint, seconds in joints.items() if seconds >= least}
        if said and State.of(reason) is not State.GAP:
            out.append(f"Not judged ({state_text(reason)}): {by_joint(said, len(watched))}.")
    return out


def _hidden(sensitivity: Mapping[str, JointSensitivity], units: Mapping[str, str]) -> list[str]:
    """Joints on which friction hid more than what is to be noticeable, longest first."""
    parts = []
    for joint, s in sorted(sensitivity.items(), key=lambda item: -item[1].all.hidden_s):
        if s.all.hidden_s >= _WORTH_SAYING_S and s.largest_nm is not None:
            of = f"for {seconds_text(s.all.hidden_s)} of {seconds_text(s.all.time_s)}"
            unit = units.get(joint, "N·m")
            parts.append(f"{joint} up to {s.largest_nm:.3g} {unit} {of} (asked: {s.observable_nm:.3g})")
    where = "at rest, in slow motion, just after a reversal or beyond the fitted speeds"
    return [f"Hidden by friction {where}: {'; '.join(parts)}."] if parts else []


def by_joint(seconds: Mapping[str, float], watched: int) -> str:
    """Seconds of each joint; said once where all watched joints have the same."""
    texts = {joint: seconds_text(value) for joint, value in seconds.items()}
    if len(texts) == watched > 1 and len(set(texts.values())) == 1:
        return f"all {watched} joints {next(iter(texts.values()))}"
    return ", ".join(f"{joint} {text}" for joint, text in texts.items())


def state_text(code: str) -> str:
    """A reason code in words."""
    state = State.of(code)
    return code if state is None else state.text


def seconds_text(seconds: float) -> str:
    """A time in the unit a reader thinks in."""
    if seconds < 119.95:
        return f"{seconds:.3g} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60} h {minutes % 60} min"
