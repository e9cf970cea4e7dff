"""The first screen of an audit: the numbers that go with its verdict, and the whole log as one strip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.sensitivity_result import force_text, headline_forces
from collaudit.reports.page.figures import JointFigures
from collaudit.reports.plots.svg import tick_text, ticks
from collaudit.reports.sections.judged_sections import judged_section
from collaudit.reports.values.numbers import duration, significant, stated
from collaudit.reports.values.words import NONE, counted

#: Of a row of marks.
_WIDTH, _HEIGHT = 1000, 20


@dataclass(frozen=True, slots=True)
class Fact:
    """A value, what it is held against (empty: nothing), and whether it is within that: ``ok``, ``off``, or empty."""

    term: str
    value: str
    reference: str = ""
    flag: str = ""


def verdict_facts(result: AuditResult) -> tuple[Fact, ...]:
    """Values in the order of the box."""
    allowed = None if result.limits is None else result.limits.max_near_misses_per_hour
    at_most = "" if allowed is None else f"at most {significant(allowed)} /h"  # no flag: it holds for a robot's logs
    return (
        _contacts(result),
        Fact("Near misses", counted(len(result.near_misses), result), at_most),
        *_noticed(result),
        Fact("Joints watched", _watched(result)),
        Fact("Recorded", duration(result.coverage.recorded_s)),
    )


def _contacts(result: AuditResult) -> Fact:
    count, limits = len(result.contacts), result.limits
    text = counted(count, result)
    if limits is None:
        return Fact("Contacts", text)
    flag = "off" if count > limits.max_collisions else "ok" if text != NONE else ""
    return Fact("Contacts", text, f"at most {limits.max_collisions}", flag)


def _noticed(result: AuditResult) -> list[Fact]:
    """For each place of the headline the force that would have been noticed, and what is asked."""
    sensitivity = result.sensitivity
    if sensitivity is None or sensitivity.time is None:
        return []
    made = []
    for force in headline_forces(sensitivity):
        found, asked = force.at(sensitivity.time.share), force.asked
        text = force_text(found)
        flag = "" if asked is None else "ok" if found is not None and found <= asked.force_n else "off"
        reference = (
            "a bound, no interval" if asked is None else f"a bound, no interval; {stated(asked.force_n)} N asked"
        )
        made.append(
            Fact(f"Noticed at the {force.place}", f"from {text}" if found is not None else text, reference, flag)
        )
    return made


def _watched(result: AuditResult) -> str:
    """How many, and how many of them were left out in some phase."""
    joints = result.coverage.joints.values()
    parts = sum(joint.watched and "not-watched" in joint.not_judged_s for joint in joints)
    text = f"{sum(joint.watched for joint in joints)} of {len(joints)}"
    return f"{text}, {parts} in part" if parts else text


@dataclass(frozen=True, slots=True)
class LogStrip:
    """The strip.

    Attributes:
        phases: of each its name, left edge and width in per cent, and words; none where all is free motion.
        contacts, near_misses: rows of marks, None where there are none.
        bars: each joint with its states over the log, None when the signals lack it, and the share that was judged.
        ticks: place in per cent and label.
    """

    phases: tuple[tuple[str, float, float, str], ...]
    contacts: Markup | None
    near_misses: Markup | None
    bars: tuple[tuple[str, Markup | None, str], ...]
    ticks: tuple[tuple[float, str], ...]


def log_strip(result: AuditResult, end_s: float, figures: Sequence[JointFigures]) -> LogStrip:
    """The strip of one audit that lasts ``end_s``."""
    drawn = {figure.joint: figure.bar for figure in figures}
    contacts = [(contact.onset_s, contact.end_s) for contact in result.contacts]
    near = [(event.onset_s, event.onset_s + event.duration_s) for event in result.near_misses]
    values = ticks(0.0, end_s, 8)
    told = any(span.phase != "free" for span in result.phases)
    return LogStrip(
        phases=tuple(_phase(span.phase, span.start_s, span.end_s, end_s) for span in result.phases) if told else (),
        contacts=_marks(contacts, end_s, "mark-alarm", f"{len(contacts)} contacts over the log"),
        near_misses=_marks(near, end_s, "mark-near", f"{len(near)} near misses over the log"),
        bars=tuple((joint, drawn.get(joint), judged) for joint, judged, *_ in judged_section(result).rows),
        ticks=tuple((round(100 * t / end_s, 3), text) for t, text in zip(values, tick_text(values), strict=True)),
    )


def _phase(phase: str, start_s: float, end_s: float, end: float) -> tuple[str, float, float, str]:
    scale = 100 / end if end > 0 else 0.0
    left, right = (min(max(t, 0.0), end) * scale for t in (start_s, end_s))
    return phase, round(left, 3), round(right - left, 3), f"{phase}: {start_s:.3f} to {end_s:.3f} s"


def _marks(spans: Sequence[tuple[float, float]], end_s: float, kind: str, label: str) -> Markup | None:
    """Strokes at least 4 of 1000 wide; those that fall on one another are drawn once."""
    if not spans or end_s <= 0:
        return None
    strokes: dict[int, int] = {}
    for start, stop in spans:
        left = round(_WIDTH * min(max(start / end_s, 0.0), 1.0)) - 2
        strokes[left] = max(strokes.get(left, 0), left + 4, round(_WIDTH * min(stop / end_s, 1.0)))
    path = "".join(f"M{left} 0H{right}V{_HEIGHT}H{left}Z" for left, right in sorted(strokes.items()))
    return Markup(
        '<svg class="bar marks" viewBox="0 0 {} {}" preserveAspectRatio="none" role="img" aria-label="{}">'
        '<path class="{}" d="{}"/></svg>'
    ).format(_WIDTH, _HEIGHT, label, kind, path)
