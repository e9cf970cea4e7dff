"""What was judged of each joint and cycle, what would have been noticed, the residual, supported thresholds."""

from __future__ import annotations

from dataclasses import replace

from collaudit.core.data.audit_result import AuditResult, JointCoverage, RecommendedRule
from collaudit.core.data.sensitivity_result import FOREARM, TOOL, NoticedForce, force_text, time_text
from collaudit.core.data.signals import reason_text
from collaudit.reports.sections.section import Section, section_of
from collaudit.reports.values.numbers import apart, duration, fixed, percent, significant, stated, time_decimals
from collaudit.reports.values.visible_text import joint_lines
from collaudit.reports.values.words import NONE, counted, torque_unit, with_unit

#: Shares of the time that tables show.
SHOWN = (0.5, 0.95)
_TORQUES = ("alarms 50 % of the time", "95 % of the time", "at any judged moment", "asked")
_BY = {"stated": "stated", "default": "default", "arm-limits": "half of what the arm can exert there"}


def judged_section(result: AuditResult) -> Section:
    """Shares of the log's time by joint, and the torque that would have alarmed."""
    sensitivity, joints = result.sensitivity, result.coverage.joints
    records = ({"joint": joint, **_shares(cover), **_torques(joint, result)} for joint, cover in joints.items())
    said = [(joint, why) for joint, cover in joints.items() if (why := _why_not(cover))]
    title = "Smallest torque that would have alarmed; shares of the log's time"
    if sensitivity is None or not sensitivity.joints:
        title = "Shares of the log's time; nothing is known of what would have been noticed"
    found = section_of(title, records, *joint_lines(said, len(joints)))
    return found.only(*found.columns)


def _shares(cover: JointCoverage) -> dict[str, str]:
    """Of the log's time: judged, friction known only as a range, nothing to be told."""
    shares = {"judged": cover.judged_s, "friction as a range": cover.standing_s, "not judged": cover.lost_s}
    if not cover.watched:
        return dict.fromkeys(shares, "") | {"judged": "not watched"}
    return {name: percent(part_s / cover.time_s) if cover.time_s > 0 else NONE for name, part_s in shares.items()}


def _torques(joint: str, result: AuditResult) -> dict[str, str]:
    """Torques that would have alarmed in half, in 95 % and in all of the time in which anything can be told; asked."""
    s = None if result.sensitivity is None else result.sensitivity.joints.get(joint)
    if s is None:
        return dict.fromkeys(_TORQUES, "")
    unit, asked, levels = torque_unit(result, joint), s.asked, {level.share: level.torque_nm for level in s.levels}
    limit = None if asked is None else asked.torque_nm
    values = (*(levels.get(share) for share in SHOWN), s.largest_nm)
    texts = [NONE if value is None else f"{_against_limit(value, limit)} {unit}" for value in values]
    text = "" if asked is None else f"{stated(asked.torque_nm)} {unit}: {percent(asked.share)} of its motion"
    return dict(zip(_TORQUES, (*texts, text), strict=True))


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
    which = "in motion" if sensitivity.time.moving else "watched"
    title = f"Smallest push that would have alarmed from 80 % of the directions, by share of the time {which}"
    return section_of(title, (_force_row(force, shares) for force in sensitivity.forces))


def _force_row(force: NoticedForce, shares: list[float]) -> dict[str, str]:
    named = {TOOL: force.place, FOREARM: f"end of {force.link} ({force.place})"}
    asked, met = "", ""
    if force.asked is not None:
        asked = f"{stated(force.asked.force_n)} N ({_BY[force.asked.by]})"
        met = f"{percent(force.asked.share)} of the time"
    felt = {share: force_text(force.at(share)) if force.unfelt < 1.0 else "not felt" for share in shares}
    return {
        "place": named.get(force.kind, f"end of {force.link}"),
        **{f"in {100 * share:.3g} %": text for share, text in felt.items()},
        "asked": asked,
        "met in": met,
    }


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
    return section_of(
        "Time of each joint",
        (
            {
                "joint": joint,
                "watched": "yes" if cover.watched else "no",
                "why": cover.why,
                "moving": duration(cover.moving_s),
                "alarms above γ": duration(cover.judged_s),
                "alarms beyond friction": duration(cover.standing_s),
            }
            for joint, cover in result.coverage.joints.items()
        ),
    )


def span_section(result: AuditResult) -> Section:
    """Longer stretches that were not judged."""
    decimals = time_decimals(result.log.sample_period_s)
    records = (
        {
            "joint": joint,
            "from": f"{fixed(span.start_s, decimals)} s",
            "to": f"{fixed(span.end_s, decimals)} s",
            "reason": reason_text(span.reason),
        }
        for joint, cover in result.coverage.joints.items()
        for span in sorted(cover.spans, key=lambda span: (span.start_s, span.end_s))
    )
    return section_of("Longer stretches that were not judged", records)


def residual_section(result: AuditResult) -> Section:
    """Level of each joint's residual over its judged samples."""
    note = "Alarms and near misses included; “clean” is without half a second around alarms; ▲: above γ."
    records = (_residual_row(joint, result) for joint in result.residual)
    return section_of("Statistics of the judged residual", records, note)


def _residual_row(joint: str, result: AuditResult) -> dict[str, str]:
    """``largest`` covers every alarm and near miss of the joint too, those beyond friction's range among them."""
    stats, gamma, unit = result.residual[joint], result.rule.gamma_nm.get(joint), torque_unit(result, joint)
    peaks = [abs(alarm.peak_nm) for alarm in result.collisions if alarm.joint == joint]
    peaks += [abs(near.peak_nm) for near in result.near_misses if near.joint == joint]
    values: dict[str, float | None] = {
        "mean |r|": stats.mean_abs_nm,
        "RMS": stats.rms_nm,
        "99 % below": stats.p99_nm,
        "largest": max((x for x in (stats.max_abs_nm, *peaks) if x is not None), default=None),
        "clean mean": stats.clean_mean_abs_nm,
    }
    pairs = {name: apart([value, gamma]) for name, value in values.items()}
    texts = {
        name: NONE
        if value is None
        else f"{pairs[name][0]} {unit}" + (" ▲" if gamma is not None and value > gamma else "")
        for name, value in values.items()
    }
    clean = texts.pop("clean mean")
    limit = max((limit for _, limit in pairs.values()), key=len)  # holds for every value
    return {
        "joint": joint,
        **texts,
        "γ": NONE if gamma is None else f"{limit} {unit}",
        "judged": duration(stats.judged_s),
        "clean mean": clean,
        "alarms, near misses": counted(len(peaks), result),
    }


def threshold_evidence(result: AuditResult) -> Section:
    """γ in force and recommended of each joint, with the evidence, and what is missing."""
    missing = [(joint, text) for joint, rule in result.recommended.items() for text in rule.missing]
    lines = [f"Missing: {line}" for line in joint_lines(missing, len(result.recommended))]
    records = [_threshold_row(joint, rule, result) for joint, rule in result.recommended.items()]
    if all(rule.gamma_nm is None for rule in result.recommended.values()):
        in_force = [(r["joint"], f"γ {r['γ in force']} in force; clean time {r['clean time']}") for r in records]
        notes = (*joint_lines(in_force, len(records)), *lines)
        return Section("None recommended: this log has too little evidence", (), (), notes)
    return section_of(f"γ in force and recommended, at n = {result.rule.n}", records, *lines)


def _threshold_row(joint: str, rule: RecommendedRule, result: AuditResult) -> dict[str, str]:
    unit, upper = torque_unit(result, joint), rule.false_alarms_per_hour_upper95
    numbers = {
        "γ in force": result.rule.gamma_nm.get(joint),
        "recommended γ": rule.gamma_nm,
        "largest clean level": rule.largest_clean_nm,
        "motion's level": rule.motion_nm,
    }
    texts = zip(numbers.items(), apart([*numbers.values()]), strict=True)
    return {
        "joint": joint,
        **{name: NONE if value is None else f"{text} {unit}" for (name, value), text in texts},
        "clean time": duration(3600 * rule.clean_hours),
        "false alarms at most (95 %)": NONE if upper is None else f"≤ {significant(upper)} /h",
    }


def cycle_section(result: AuditResult) -> Section:
    """The comparison of cycles: its thresholds, what it leaves of the spread, and what it cannot see."""
    facts = result.cycles
    if facts is None:
        return Section("Cycles", (), ())
    records = (
        {
            "joint": joint,
            "γ to other cycles": with_unit(significant(gamma), joint, result.log.units),
            "γ": with_unit(significant(result.rule.gamma_nm[joint]), joint, result.log.units),
            "spread left": f"{100 * facts.spread_share[joint]:.0f} %",
            "compared": duration(facts.judged_s[joint]),
        }
        for joint, gamma in facts.gamma_nm.items()
    )
    low, middle, high = facts.duration_s
    rests = f"{facts.nights} earlier nights" if facts.nights else "the other cycles of this log"
    said = (
        f"{len(facts.starts_s)} cycles, {'as stated' if facts.stated else 'found by the measured path'}, of "
        f"{middle:.3g} s ({low:.3g} to {high:.3g} s) and {facts.path_rad:.3g} rad over all joints; {facts.compared} "
        f"compared with {rests}."
    )
    found = section_of(f"Cycles ({len(facts.starts_s)})", records)
    return replace(found, notes=(said, *facts.unseen))
