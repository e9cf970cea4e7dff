"""What was judged of each joint and cycle, what would have been noticed, the residual, supported thresholds."""

from __future__ import annotations

from collaudit.core.data.audit_result import AuditResult, JointCoverage, RecommendedRule
from collaudit.core.data.sensitivity_result import FOREARM, TOOL, NoticedForce
from collaudit.core.data.signals import reason_text
from collaudit.core.verdict.noticed_words import force_text, time_text
from collaudit.reports.sections.section import Section
from collaudit.reports.values.joint_lines import joint_lines
from collaudit.reports.values.numbers import apart, duration, fixed, percent, significant, stated, time_decimals
from collaudit.reports.values.words import NONE, counted, torque_unit, with_unit

#: Shares of the time that tables show.
SHOWN = (0.5, 0.95)
_OF_CYCLES = ("joint", "γ to other cycles", "γ", "spread left", "compared")
_BY = {"stated": "stated", "default": "default", "arm-limits": "half of what the arm can exert there"}


def judged_section(result: AuditResult) -> Section:
    """Shares of the log's time by joint, and the torque that would have alarmed."""
    sensitivity = result.sensitivity
    joints = result.coverage.joints
    rows = [(joint, *_shares(cover), *_torques(joint, result)) for joint, cover in joints.items()]
    head = (
        "joint",
        "judged",
        "friction as a range",
        "not judged",
        "alarms 50 % of the time",
        "95 % of the time",
        "at any judged moment",
        "asked",
    )
    said = [(joint, why) for joint, cover in joints.items() if (why := _why_not(cover))]
    title = "Smallest torque that would have alarmed; shares of the log's time"
    if sensitivity is None or not sensitivity.joints:
        title = "Shares of the log's time; nothing is known of what would have been noticed"
    return Section(title, head, tuple(rows), tuple(joint_lines(said, len(joints)))).only(*head)


def _shares(cover: JointCoverage) -> tuple[str, str, str]:
    """Of the log's time: judged, friction known only as a range, nothing to be told."""
    if not cover.watched:
        return "not watched", "", ""
    parts = (cover.judged_s, cover.standing_s, cover.lost_s)
    judged, as_range, lost = (percent(part_s / cover.time_s) if cover.time_s > 0 else NONE for part_s in parts)
    return judged, as_range, lost


def _torques(joint: str, result: AuditResult) -> tuple[str, str, str, str]:
    """Torques that would have alarmed in half, in 95 % and in all of the time in which anything can be told; asked."""
    s = None if result.sensitivity is None else result.sensitivity.joints.get(joint)
    if s is None:
        return "", "", "", ""
    unit = torque_unit(result, joint)
    levels = {level.share: level.torque_nm for level in s.levels}
    limit = None if s.asked is None else s.asked.torque_nm
    half, most, always = (
        NONE if value is None else f"{_against_limit(value, limit)} {unit}"
        for value in (*(levels.get(share) for share in SHOWN), s.largest_nm)
    )
    asked = "" if s.asked is None else f"{stated(s.asked.torque_nm)} {unit}: {percent(s.asked.share)} of its motion"
    return half, most, always, asked


def _against_limit(value: float, limit: float | None) -> str:
    """A torque in three digits, or as many as it takes to differ from what was asked for."""
    text = significant(value)
    if limit is None or text != significant(limit) or value == limit:
        return text
    return apart([value, limit], 1)[0]


def _why_not(cover: JointCoverage) -> str:
    if not cover.watched:
        return f"not watched: {cover.why}"
    longest = sorted(cover.not_judged_s.items(), key=lambda item: (-item[1], item[0]))
    text = "; ".join(f"{duration(seconds)}: {reason_text(code)}" for code, seconds in longest if seconds > 0)
    return f"not judged, of {duration(cover.time_s)}, {text}" if text else ""


def force_section(result: AuditResult) -> Section:
    """What push would have been noticed along the arm, base to tool, by share of the time."""
    sensitivity = result.sensitivity
    if sensitivity is None or sensitivity.time is None:
        return Section("", (), ())
    shares = sorted({*SHOWN, sensitivity.time.share})
    rows = tuple(_force_row(force, shares) for force in sensitivity.forces)
    head = ("place", *(f"in {100 * share:.3g} %" for share in shares), "asked", "met in")
    which = "in motion" if sensitivity.time.moving else "watched"
    title = f"Smallest push that would have alarmed from 80 % of the directions, by share of the time {which}"
    return Section(title, head, rows)


def _force_row(force: NoticedForce, shares: list[float]) -> tuple[str, ...]:
    named = {TOOL: force.place, FOREARM: f"end of {force.link} ({force.place})"}
    place = named.get(force.kind, f"end of {force.link}")
    asked, met = "", ""
    if force.asked is not None:
        asked = f"{stated(force.asked.force_n)} N ({_BY[force.asked.by]})"
        met = f"{percent(force.asked.share)} of the time"
    return place, *(force_text(force.at(share)) if force.unfelt < 1.0 else "not felt" for share in shares), asked, met


def force_line(result: AuditResult) -> str:
    """The pushes of :func:`force_section` at the share that the policy asks for, in a line; empty without any."""
    sensitivity = result.sensitivity
    if sensitivity is None or sensitivity.time is None or not sensitivity.forces:
        return ""
    column = f"in {100 * sensitivity.time.share:.3g} %"
    pushes = ", ".join(f"{record['place']} {record[column]}" for record in force_section(result).records)
    return f"Smallest push from 80 % of the directions, {time_text(sensitivity.time)}: {pushes}"


def coverage_section(result: AuditResult) -> Section:
    """How long each joint moved and was judged."""
    rows = tuple(
        (
            joint,
            "yes" if cover.watched else "no",
            cover.why,
            duration(cover.moving_s),
            duration(cover.judged_s),
            duration(cover.standing_s),
        )
        for joint, cover in result.coverage.joints.items()
    )
    head = ("joint", "watched", "why", "moving", "alarms above γ", "alarms beyond friction")
    return Section("Time of each joint", head, rows)


def span_section(result: AuditResult) -> Section:
    """Longer stretches that were not judged."""
    decimals = time_decimals(result.log.sample_period_s)
    rows = tuple(
        (joint, f"{fixed(span.start_s, decimals)} s", f"{fixed(span.end_s, decimals)} s", reason_text(span.reason))
        for joint, cover in result.coverage.joints.items()
        for span in sorted(cover.spans, key=lambda span: (span.start_s, span.end_s))
    )
    return Section("Longer stretches that were not judged", ("joint", "from", "to", "reason"), rows)


def residual_section(result: AuditResult) -> Section:
    """Level of each joint's residual over its judged samples."""
    rows = tuple(_residual_row(joint, result) for joint in result.residual)
    head = ("joint", "mean |r|", "RMS", "99 % below", "largest", "γ", "judged", "clean mean", "alarms, near misses")
    notes = ("Alarms and near misses included; “clean” is without half a second around alarms; ▲: above γ.",)
    return Section("Statistics of the judged residual", head, rows, notes if rows else ())


def _residual_row(joint: str, result: AuditResult) -> tuple[str, ...]:
    """``largest`` covers every alarm and near miss of the joint too, those beyond friction's range among them."""
    stats, gamma, unit = result.residual[joint], result.rule.gamma_nm.get(joint), torque_unit(result, joint)
    alarms = [abs(alarm.peak_nm) for alarm in result.collisions if alarm.joint == joint]
    peaks = [*alarms, *(abs(near.peak_nm) for near in result.near_misses if near.joint == joint)]
    largest_nm = max((x for x in (stats.max_abs_nm, *peaks) if x is not None), default=None)
    values = (stats.mean_abs_nm, stats.rms_nm, stats.p99_nm, largest_nm, stats.clean_mean_abs_nm)
    pairs = [apart([value, gamma]) for value in values]
    above = [gamma is not None and (value or 0.0) > gamma for value in values]
    texts = [
        NONE if value is None else f"{text} {unit}{' ▲' if high else ''}"
        for value, (text, _), high in zip(values, pairs, above, strict=True)
    ]
    limit = NONE if gamma is None else f"{max((limit for _, limit in pairs), key=len)} {unit}"  # holds for every value
    count = counted(len(peaks), result)
    return joint, *texts[:4], limit, duration(stats.judged_s), texts[4], count


def threshold_evidence(result: AuditResult) -> Section:
    """γ in force and recommended of each joint, with the evidence, and what is missing."""
    rows = tuple(_threshold_row(joint, rule, result) for joint, rule in result.recommended.items())
    head = (
        "joint",
        "γ in force",
        "recommended γ",
        "largest clean level",
        "motion's level",
        "clean time",
        "false alarms at most (95 %)",
    )
    missing = [(joint, text) for joint, rule in result.recommended.items() for text in rule.missing]
    lines = (f"Missing: {line}" for line in joint_lines(missing, len(result.recommended)))
    title = f"γ in force and recommended, at n = {result.rule.n}"
    if all(rule.gamma_nm is None for rule in result.recommended.values()):
        in_force = [(row[0], f"γ {row[1]} in force; clean time {row[5]}") for row in rows]
        notes = (*joint_lines(in_force, len(rows)), *lines)
        return Section("None recommended: this log has too little evidence", (), (), notes)
    return Section(title, head, rows, tuple(lines))


def _threshold_row(joint: str, rule: RecommendedRule, result: AuditResult) -> tuple[str, ...]:
    unit, used = torque_unit(result, joint), result.rule.gamma_nm.get(joint)
    numbers = (used, rule.gamma_nm, rule.largest_clean_nm, rule.motion_nm)
    values = zip(numbers, apart(numbers), strict=True)
    upper = rule.false_alarms_per_hour_upper95
    return (
        joint,
        *(NONE if value is None else f"{text} {unit}" for value, text in values),
        duration(3600 * rule.clean_hours),
        NONE if upper is None else f"≤ {significant(upper)} /h",
    )


def cycle_section(result: AuditResult) -> Section:
    """The comparison of cycles: its thresholds, what it leaves of the spread, and what it cannot see."""
    facts = result.cycles
    if facts is None:
        return Section("Cycles", (), ())
    rows = tuple(
        (
            joint,
            with_unit(significant(gamma), joint, result.log.units),
            with_unit(significant(result.rule.gamma_nm[joint]), joint, result.log.units),
            f"{100 * facts.spread_share[joint]:.0f} %",
            duration(facts.judged_s[joint]),
        )
        for joint, gamma in facts.gamma_nm.items()
    )
    low, middle, high = facts.duration_s
    rests = f"{facts.nights} earlier nights" if facts.nights else "the other cycles of this log"
    said = (
        f"{len(facts.starts_s)} cycles, {'as stated' if facts.stated else 'found by the measured path'}, of "
        f"{middle:.3g} s ({low:.3g} to {high:.3g} s) and {facts.path_rad:.3g} rad over all joints; {facts.compared} "
        f"compared with {rests}."
    )
    return Section(f"Cycles ({len(facts.starts_s)})", _OF_CYCLES, rows, (said, *facts.unseen))
