"""What happened in a log (contacts, alarms, near misses, pushes at rest), and what other detectors and labels say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import assert_never

import numpy as np

from collaudit.core.data.audit_result import AuditResult, Collision, NearMiss, RuleFacts
from collaudit.core.data.detection_result import (
    Contact,
    ContactKind,
    ControllerAlarmComparison,
    DelayFacts,
    RestDisturbance,
    Score,
)
from collaudit.reports.sections.section import Section, section_of
from collaudit.reports.values.first_words import (
    alarms_of,
    contact_limits,
    force_text,
    height,
    in_time,
    link_forces_text,
)
from collaudit.reports.values.numbers import against, apart, duration, fixed, percent, significant, speed, time_decimals
from collaudit.reports.values.words import NONE, after_text, clock_text, speed_unit, torque_unit

#: Kinds as readers are told them.
KIND_WORDS: dict[ContactKind, str] = {"meant": "intended", "accidental": "accidental", "undecided": "undecided"}
#: Alarms that a contact's row names.
_MOST_ALARMS = 8
#: Room around an event where its signals are shown, s.
_AROUND_S = 0.2
_AROUND_REST_S = 0.3
_RELATION = {
    "agreed": "agrees with a contact",
    "missed": "did not alarm",
    "spurious": "no contact found here (spurious)",
    "not-judged": "not judged: no contact could have been noticed here",
}


def contact_section(result: AuditResult, contacts: Mapping[int, Contact] | None = None) -> Section:
    """Contacts in order of time.

    Args:
        result: the audit.
        contacts: those to list, by their number from 1; None: all.
    """
    listed = dict(enumerate(result.contacts, 1)) if contacts is None else contacts
    alarms = in_time(result.collisions)
    records = (_contact(number, one, result, alarms_of(one, result, alarms)) for number, one in listed.items())
    note = f"Alarms that belong together: |residual| above γ for n = {result.rule.n} samples or more."
    windows = tuple(contact_limits(one, result.log.sample_period_s) for one in listed.values())
    return replace(section_of("Contacts in order of time", records, note), windows=windows)


#: Which residual an alarm is of.
_SPOKE = {"model": "the model", "cycle": "other cycles", "both": "both"}


def _contact(number: int, contact: Contact, result: AuditResult, alarms: Sequence[Collision]) -> dict[str, str]:
    worst = max(alarms, key=height, default=None)
    others = len(contact.joints) - 1
    first = contact.joints[0] if worst is None and contact.joints else NONE if worst is None else worst.joint
    peak, gamma = (NONE, NONE) if worst is None else _peak_and_gamma(worst, result)
    flags = () if result.detection is None else result.detection.flags
    mark = next((mark_text(flag) for flag in flags if flag.detected_s == contact.detected_s), "not compared")
    tool_speed = None if contact.scene is None else contact.scene.tool_speed_m_s
    evidence = "; ".join(part for part in (contact.state_text, *contact.evidence, contact.link_note) if part)
    return {
        "#": str(number),
        "onset": _time(contact.onset_s, result),
        "wall clock": _clock(contact.onset_s, result),
        "lasted": duration(contact.end_s - contact.onset_s),
        "joint": f"{first} +{others}" if others > 0 else first,
        "joints": ", ".join(contact.joints),
        "highest residual": peak,
        "γ": gamma,
        "alarms": "; ".join(_alarm_text(alarm, contact, result) for alarm in alarms[:_MOST_ALARMS]),
        "link or further out": contact.link or NONE,
        "force (95 %)": force_text(contact.force, contact.least_force),
        "by link": link_forces_text(contact.force),
        "after it": after_text(contact.after),
        "tool speed": "" if tool_speed is None else speed(tool_speed, "m/s"),
        "kind": KIND_WORDS[contact.kind],
        "state": contact.state,
        "controller": mark if flags else "",
        "id": contact.id,
        "to accept": f"collaudit accept OUT {contact.id}" if contact.id and contact.state != "accepted" else "",
        "evidence": evidence,
    }


def _alarm_text(alarm: Collision, contact: Contact, result: AuditResult) -> str:
    """One joint's alarm in a contact: peak and its margin to γ, how long, the joint's speed."""
    joint_speed = None if contact.scene is None else contact.scene.joint_speed_rad_s.get(alarm.joint)
    moved = "" if joint_speed is None else f", {speed(joint_speed, speed_unit(result.friction.get(alarm.joint)))}"
    margin = apart([height(alarm), 1.0])[0]
    delay = fixed(1e3 * (alarm.detected_s - alarm.onset_s), 0)
    return (
        f"{alarm.joint} {_peak_and_gamma(alarm, result)[0]} (× {margin} γ), alarm after {delay} ms, "
        f"{duration(alarm.duration_s)}{moved}"
    )


def alarm_section(result: AuditResult) -> Section:
    """Alarms of single joints in order of time."""
    return section_of("Alarms of single joints", (_alarm(alarm, result) for alarm in in_time(result.collisions)))


def near_miss_section(result: AuditResult) -> Section:
    """Near misses, those closest to an alarm first; their numbers count in order of time."""
    numbered = sorted(enumerate(in_time(result.near_misses), 1), key=lambda item: (-item[1].ratio, item[0]))
    note = (
        f"Amplitude: n samples beyond {near_levels(result)}; how close is the share of γ in force that n samples in a "
        f"row kept. Persistence: above γ for {100 * result.rule.near_miss_persistence:g} % of n or more."
    )
    records = (_near_miss(number, near, result) for number, near in numbered)
    windows = tuple((near.onset_s - _AROUND_S, near.onset_s + near.duration_s + _AROUND_S) for _, near in numbered)
    return replace(section_of("Near misses, closest to an alarm first", records, note), windows=windows)


def _alarm(alarm: Collision, result: AuditResult) -> dict[str, str]:
    peak, gamma = _peak_and_gamma(alarm, result)
    return {
        "joint": alarm.joint,
        "onset": _time(alarm.onset_s, result),
        "detected": _time(alarm.detected_s, result),
        "above γ": _lasted(alarm.duration_s, result),
        "peak": peak,
        "γ": gamma,
        "phase": alarm.phase,
        "told by": _SPOKE[alarm.spoke],
    }


def _near_miss(number: int, near: NearMiss, result: AuditResult) -> dict[str, str]:
    peak, gamma = _peak_and_gamma(near, result)
    return {
        "#": str(number),
        "joint": near.joint,
        "how close": closeness(near, result.rule),
        "peak": peak,
        "γ": gamma,
        "lasted": _lasted(near.duration_s, result),
        "kind": near.kind,
        "onset": _time(near.onset_s, result),
        "wall clock": _clock(near.onset_s, result),
        "phase": near.phase,
    }


def _disturbance(number: int, item: RestDisturbance, result: AuditResult) -> dict[str, str]:
    steps = (f"{j.joint} {significant(abs(j.torque_step_nm))} {torque_unit(result, j.joint)}" for j in item.joints)
    return {
        "#": str(number),
        "from": _time(item.onset_s, result),
        "to": _time(item.end_s, result),
        "joints, with the largest step of torque: a lower bound": ", ".join(steps),
    }


def near_levels(result: AuditResult) -> str:
    """From where on a near miss counts."""
    rule = result.rule
    shares = [100 * rule.near_miss_nm[joint] / gamma for joint, gamma in rule.gamma_nm.items() if gamma > 0]
    if not shares:
        return "a share of γ"
    return f"{' to '.join(dict.fromkeys(f'{x:.0f}' for x in (min(shares), max(shares))))} % of γ"


def closeness(near: NearMiss, rule: RuleFacts) -> str:
    """How close to an alarm a near miss came, in what its kind is told by."""
    match near.kind:
        case "amplitude":
            return f"{apart([100 * near.ratio, 100.0])[0]} % of γ"
        case "persistence":
            return f"{round(near.ratio * rule.n)} of {rule.n} samples above γ"
        case _:
            assert_never(near.kind)


def disturbance_section(result: AuditResult) -> Section:
    """Disturbances of standing joints below what alarms: neither contacts nor near misses, and yet seen."""
    title = "Pushes of standing joints too weak to alarm: friction hides how strong they were"
    records = (_disturbance(number, item, result) for number, item in enumerate(result.disturbances, 1))
    windows = tuple((item.onset_s - _AROUND_REST_S, item.end_s + _AROUND_REST_S) for item in result.disturbances)
    return replace(section_of(title, records), windows=windows)


def _peak_and_gamma(event: Collision | NearMiss, result: AuditResult) -> tuple[str, str]:
    """Peak and threshold, which compare as the numbers do."""
    unit = torque_unit(result, event.joint)
    peak, gamma = against(event.peak_nm, event.gamma_nm)
    return f"{peak} {unit}", f"{gamma} {unit}"


def _time(seconds: float, result: AuditResult) -> str:
    return f"{fixed(seconds, time_decimals(result.log.sample_period_s))} s"


def _clock(seconds: float, result: AuditResult) -> str:
    return "" if result.log.start is None else clock_text(result.log.start, seconds)


def _lasted(seconds: float, result: AuditResult) -> str:
    """How long, in as many digits as it takes to differ from the persistence."""
    return duration(seconds) if seconds >= 1 else f"{apart([1e3 * seconds, 1e3 * result.rule.persistence_s])[0]} ms"


def delay_text(delay: DelayFacts) -> str:
    """Filter, persistence and jitter apart."""
    return (
        f"{1e3 * delay.filter_s:.1f} ms filter + {1e3 * delay.persistence_s:.1f} ms persistence + up to "
        f"{1e3 * delay.jitter_s:.1f} ms jitter"
    )


def detection_sections(result: AuditResult) -> tuple[Section, ...]:
    """The log's labels, the controller's alarms among them, and scores against known events; what there is of them."""
    facts = result.detection
    if facts is None:
        return ()
    title = f"The log's labels ({len(facts.flags)})"
    marks = section_of(title, ({"mark": mark_text(flag)} for flag in facts.flags))
    return tuple(one for one in (marks, score_section(facts.scores)) if one.rows)


def mark_text(flag: ControllerAlarmComparison) -> str:
    """One mark: whose it is, how it relates to a contact, and how early or late it was."""
    if flag.flag_s is None:
        ours = "" if flag.detected_s is None else f" (ours at {flag.detected_s:.3f} s)"
        return f"no label{ours}"
    lead = ""
    if flag.lead_s is not None:
        lead = f", {1000 * abs(flag.lead_s):.0f} ms {'before' if flag.lead_s < 0 else 'after'} the detection"
    return f"label {flag.label} at {flag.flag_s:.3f} s{lead}: {_RELATION[flag.relation]}"


def score_section(scores: Sequence[Score]) -> Section:
    """Scores of an audit against known events."""
    records = (
        {
            "joint": row.joint or "all joints",
            "found": f"{row.found} of {row.events}",
            "not observable": str(row.not_observable),
            "recall": NONE if row.recall is None else percent(row.recall),
            "precision": NONE if row.precision is None else percent(row.precision),
            "false alarms/h": NONE if row.false_alarms_per_hour is None else significant(row.false_alarms_per_hour),
            "delay (5 to 95 %)": _delay(row.delay_s),
            "AUC": NONE if row.auc is None else f"{row.auc:.3f}",
        }
        for row in scores
    )
    note = "Recall leaves out events hidden at rest or where nothing was judged."
    return section_of("Against the known events", records, note)


def _delay(delays_s: Sequence[float]) -> str:
    if not delays_s:
        return NONE
    low, middle, high = (1e3 * x for x in np.percentile(delays_s, [5, 50, 95]))
    return f"{middle:.0f} ({low:.0f} to {high:.0f}) ms"
