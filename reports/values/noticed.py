"""What an audit would have noticed, in a sentence, a few words, and a number."""

from __future__ import annotations

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.verdict.noticed_words import (
    force_text,
    headline_forces,
    noticed_sentence,
    place_text,
    too_insensitive,
)


def noticed_line(result: AuditResult) -> str | None:
    """What would have been noticed, in a sentence; None where nothing is told, or the verdict's reasons say it."""
    sensitivity = result.sensitivity
    sentence = None if sensitivity is None else noticed_sentence(sensitivity)
    if sensitivity is None or sentence is None or too_insensitive(sensitivity):
        return None
    return None if any(sentence in reason for reason in result.reasons) else sentence


def noticed_brief(result: AuditResult) -> str:
    """``52 N at the tool``: the first place of the headline; empty where nothing is told."""
    sensitivity = result.sensitivity
    forces = headline_forces(sensitivity)
    if not forces or sensitivity is None or sensitivity.time is None:
        return ""
    return f"{force_text(forces[0].at(sensitivity.time.share))} at {place_text(forces[0], brief=True)}"


def noticed_n(result: AuditResult) -> float | None:
    """The force of :func:`noticed_brief`, N; None where there is none."""
    sensitivity = result.sensitivity
    forces = headline_forces(sensitivity)
    return forces[0].at(sensitivity.time.share) if forces and sensitivity is not None and sensitivity.time else None


def lost_share(result: AuditResult) -> float | None:
    """Share of the watched joints' time, all together, that could not be judged; None where nothing was watched.

    Time in which one of them was not watched, as under force control, counts as not judged here.
    """
    watched = [cover for cover in result.coverage.joints.values() if cover.watched]
    lost = sum(sum(cover.not_judged_s.values()) for cover in watched)
    time_s = lost + sum(cover.judged_s + cover.standing_s for cover in watched)
    return lost / time_s if time_s > 0 else None
