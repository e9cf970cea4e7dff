"""Words for readers: verdicts, reasons, units, moments of the wall clock, what would have been noticed.

What an arm did after a contact, and causes of a residual that is off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta

from collaudit.core.data.audit_result import AuditResult, Cause, Verdict
from collaudit.core.data.detection_result import AfterContact, ToolMotion
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.sensitivity_result import (
    force_text,
    headline_forces,
    noticed_sentence,
    place_text,
    too_insensitive,
)
from collaudit.core.findings import Finding
from collaudit.core.friction.law_candidates import parameter_symbol
from collaudit.core.friction_laws.law_registry import law_named
from collaudit.reports.values.numbers import UNKNOWN, duration, fixed, percent, significant, speed, stated

#: What stands where there is no value.
NONE = "–"
STATEMENT = (
    "collaudit reads logs after the fact. It is no safety function, claims no performance level (PL or SIL), "
    "and does not replace a risk assessment or a measurement of contact forces. "
    "A verdict covers only what is shown here as judged."
)

#: For a screen; files and the page have :data:`STATEMENT`.
BRIEF_STATEMENT = (
    "collaudit is no safety function and claims no performance level; only what is shown as judged is covered."
)

VERDICT_WORD: dict[Verdict, str] = {"pass": "PASS", "fail": "FAIL", "not_judged": "NOT JUDGED"}
#: A pass that does not cover everything.
_WITH_EXCLUSIONS = "PASS, WITH EXCLUSIONS"
VERDICT_SENTENCE: dict[Verdict, str] = {
    "pass": "The policy is kept in all that could be judged.",
    "fail": "The log could be judged, and the policy is broken.",
    "not_judged": "The data do not allow a verdict. This is neither a pass nor a fail.",
}

_UNIT_WORDS = {"nm": "N·m", "n": "N", "raw": "raw", "s": "s", "rad": "rad", "m": "m"}


def verdict_word(verdict: Verdict, exclusions: Sequence[str] = ()) -> str:
    """A verdict in words; a pass says when something is excluded from it."""
    return _WITH_EXCLUSIONS if verdict == "pass" and exclusions else VERDICT_WORD[verdict]


def torque_unit(result: AuditResult, joint: str) -> str:
    """Unit of a joint's torque: N·m, N for a prismatic joint, raw when the log's unit is not known."""
    fit = result.friction.get(joint)
    if fit is not None and fit.effort_unit == "raw":
        return "raw"
    if result.log.units:
        return "N" if result.log.units.get(joint) == "N" else "N·m"
    return effort_unit(fit) if fit is not None else "N·m"


def with_unit(cell: str, joint: str, units: Mapping[str, str]) -> str:
    """A number with the unit of what the joint's drive exerts, N·m where none is stated; what is no number as it is."""
    return f"{cell} {units.get(joint, 'N·m')}" if cell[:1].isdigit() else cell


def effort_unit(fit: FrictionFit) -> str:
    """Unit of a fit's friction, from the few there are (the file's own text is not trusted)."""
    return fit.effort_unit if fit.effort_unit in ("N·m", "N", "raw") else "N·m"


def speed_unit(fit: FrictionFit | None) -> str:
    """Unit of a joint's speeds: m/s for prismatic ones, which the names of their friction's parameters tell."""
    names = () if fit is None else fit.parameters
    prismatic = (fit is not None and fit.effort_unit == "N") or any(name.endswith("_per_m") for name in names)
    return "m/s" if prismatic else "rad/s"


def parameter_unit(name: str) -> str:
    """``D_nm_s_per_rad`` → ``N·m·s/rad``."""
    above, _, below = name.partition("_")[2].partition("_per_")
    words = "·".join(_UNIT_WORDS.get(word, word) for word in above.split("_") if word)
    return f"{words}/{_UNIT_WORDS.get(below, below)}" if below else words


def law_text(model: str) -> str:
    """A friction law in words and as a formula."""
    law = law_named(model)
    return f"{law.title}: {law.formula}"


def parameter_meaning(model: str | None, name: str) -> str:
    """What a friction parameter stands for in its model."""
    parameters = law_named(model).parameters if model is not None else ()
    return next((p.meaning for p in parameters if p.symbol == parameter_symbol(name)), "")


def nothing_judged(result: AuditResult) -> bool:
    """Whether no sample of any joint was judged, so that a count of zero events means nothing."""
    return not any(joint.judged_s or joint.standing_s for joint in result.coverage.joints.values() if joint.watched)


def counted(count: int, result: AuditResult) -> str:
    """A count of events; a dash, never 0, where the log or all of its time was not judged."""
    none_means_nothing = result.verdict == "not_judged" or nothing_judged(result)
    return "–" if not count and none_means_nothing else str(count)


def plural(count: int, one: str, many: str | None = None) -> str:
    """``1 collision``, ``2 collisions``, ``no collisions``."""
    word = one if count == 1 else (many or f"{one}s")
    return f"{count or 'no'} {word}"


def clock_text(start: str | None, seconds: float) -> str:
    """The UTC time so many seconds after a log's start.

    Args:
        start: ISO 8601, or None where the log does not tell.
        seconds: from the log's first sample.

    Returns:
        Date and time to the millisecond, or a dash.
    """
    if start is None:
        return NONE
    try:
        moment = datetime.fromisoformat(start)
        moment = (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).astimezone(UTC) + timedelta(seconds=seconds)
        moment += timedelta(microseconds=500)  # to the nearest millisecond
    except (ValueError, OverflowError):
        return NONE
    return f"{moment:%Y-%m-%d %H:%M:%S}.{moment.microsecond // 1000:03d} UTC"


def noticed_line(result: AuditResult) -> str | None:
    """What would have been noticed, in a sentence; None where nothing is told, or the reasons say it is too much."""
    sensitivity = result.sensitivity
    return None if sensitivity is None or too_insensitive(sensitivity) else noticed_sentence(sensitivity)


def noticed_brief(result: AuditResult) -> str:
    """``52 N at the tool``: the first place of the headline; empty where nothing is told."""
    forces = headline_forces(result.sensitivity)
    if not forces or result.sensitivity is None or result.sensitivity.time is None:
        return ""
    return f"{force_text(noticed_n(result))} at {place_text(forces[0], brief=True)}"


def noticed_n(result: AuditResult) -> float | None:
    """The force of :func:`noticed_brief`, N; None where there is none."""
    sensitivity = result.sensitivity
    forces = headline_forces(sensitivity)
    return forces[0].at(sensitivity.time.share) if forces and sensitivity is not None and sensitivity.time else None


def rule_text(result: AuditResult) -> str:
    """Detector, persistence in samples, and thresholds in their units; joints that share one are said together."""
    rule = result.rule
    gamma = {
        name: f"{stated(x)} {torque_unit(result, name)}" for name, x in rule.gamma_nm.items() if name in rule.watch
    }
    asked = "" if rule.persistence_requested_ms is None else f" (asked: {rule.persistence_requested_ms:g} ms)"
    return (
        f"rule: {rule.detector}, n = {plural(rule.n, 'sample')} = {1e3 * rule.persistence_s:.4g} ms{asked}, "
        f"γ: {by_joint(gamma) or 'no joint is watched'}{_room(result)}"
    )


def _room(result: AuditResult) -> str:
    """Both distances of a threshold: from what motion does, and from what force alarms; empty where neither is told."""
    rule, noticed = result.rule, noticed_brief(result)
    times = {f"{rule.gamma_nm[joint] / level:.1f}" for joint, level in rule.motion_nm.items() if joint in rule.watch}
    known = [f"{' to '.join(sorted({min(times), max(times)}))} × what motion does"] if times else []
    known += [f"alarms from {noticed}"] if noticed else []
    return f": {', '.join(known)}" if known else ""


def by_joint(values: Mapping[str, str]) -> str:
    """Values of joints; those that share one are said together."""
    shared: dict[str, list[str]] = {}
    for name, value in values.items():
        shared.setdefault(value, []).append(name)
    if len(shared) == 1 and len(values) > 1:
        return f"all {len(values)} joints {next(iter(shared))}"
    return "; ".join(f"{', '.join(names)} {value}" for value, names in shared.items())


_MOTION: dict[ToolMotion, str] = {
    "went on": "the tool did not stop",
    "slowed": "the tool slowed to {share} of {speed}, from {slowing} on",
    "turned back": "the tool turned back, slowing from {slowing} on",
    "stopped": "the tool stopped after {stopped} and {way} mm, slowing from {slowing} on",
    "stood": "the tool stood already",
    "unknown": "what the tool did is not known",
}


def after_text(after: AfterContact | None) -> str:
    """``the tool stopped after 320 ms and 41 mm, …; transient (…)``; empty in files of earlier versions."""
    if after is None:
        return ""
    kept = duration(after.force_s)
    load = {
        "quasi-static": f"pressed on (quasi-static, {kept} above γ)",
        "transient": f"transient ({kept} above γ)",
        "unknown": f"above γ for at least {kept}",
    }[after.load]
    return f"{motion_text(after)}; {load}"


def motion_text(after: AfterContact) -> str:
    """What the tool did, with when and how far; times from the onset."""
    return _MOTION[after.motion].format(
        share=percent(after.slowest, 0),
        speed=speed(after.speed_m_s, "m/s"),
        slowing=_ms(after.slowing_s),
        stopped=_ms(after.stopped_s),
        way=significant(None if after.stopping_m is None else 1e3 * after.stopping_m),
    )


def _ms(seconds: float | None) -> str:
    return UNKNOWN if seconds is None else f"{fixed(1e3 * seconds, 0)} ms"


def speaking(result: AuditResult) -> Cause | None:
    """The cause that explains most, where it explains enough."""
    return next((cause for cause in result.causes if cause.speaks), None)


def cause_sentence(result: AuditResult) -> str | None:
    """The cause, its share and the runner-up of another kind; None where no residual is off."""
    if not result.causes:
        return None
    first = speaking(result)
    best = result.causes[0]
    if first is None:
        return f"No single cause explains the residual: at best {_share(best)} of it, by {best.text}."
    best_of: dict[str, Cause] = {}
    for cause in result.causes:
        best_of.setdefault(cause.code, cause)
    other = next(iter([*best_of.values()][1:]), None)
    beside = "" if other is None else f", next best: {other.code}, {_share(other)}"
    return f"Cause: {first.text} (explains {_share(first)}{beside})."


def cause_lines(result: AuditResult) -> list[str]:
    """Every cause that takes away a tenth of what is beyond the usual, the best first."""
    return [f"{_share(cause):>5}  {cause.text}{f' -> {cause.line}' if cause.line else ''}" for cause in result.causes]


def _share(cause: Cause) -> str:
    return f"{100.0 * cause.share:.0f} %"


def follows(result: AuditResult, finding: Finding) -> bool:
    """Whether a finding follows from the cause: alarms may be errors of the model. Those that forbid a pass stay."""
    return speaking(result) is not None and finding.doubts_alarms and not finding.forbids_pass
