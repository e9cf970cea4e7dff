"""What a fit says of each joint, in a line or in full, and what it left out of the logs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import assert_never

from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.friction_result import FrictionFit, FrictionPoint
from collaudit.core.data.identification_result import (
    AngleTorque,
    ChannelFacts,
    CoupledFriction,
    EstimateChoice,
    FrictionVariation,
    Identification,
    Identified,
    LeftOut,
    SensorFacts,
    Trend,
)
from collaudit.core.data.recommendation_result import FittedThresholds, JointThreshold
from collaudit.core.friction.law_candidates import parameter_symbol
from collaudit.core.friction_laws.law_registry import law_named
from collaudit.reports.sections.section import Section, section_of
from collaudit.reports.values.numbers import duration, interval, percent, significant, with_interval
from collaudit.reports.values.visible_text import joint_lines
from collaudit.reports.values.words import NONE, effort_unit, parameter_meaning, parameter_unit, speed_unit

Bounds = tuple[float | None, float | None]


def identified_sections(found: Identification) -> tuple[Section, ...]:
    """Every section there is something for."""
    every = (
        *(() if found.choice is None else (_choice(found.choice),)),
        *(() if found.identified is None else _identified(found.identified)),
        _coupled(found.coupled),
        _channels(found.channels),
        *(_sensor(log, facts.sensor) for log, facts in found.channels.items() if facts.sensor is not None),
        _trends(found.trends),
    )
    return tuple(one for one in every if one.rows)


def _choice(choice: EstimateChoice) -> Section:
    """What each way to fit leaves of motion that it has not seen."""
    joints = tuple(dict.fromkeys(joint for one in choice.tried for joint in one.held_out_rms_nm))
    records = (
        {
            "Identified": f"{'→ ' if one.what == choice.taken else ''}{one.what}"
            + (f" (not taken: {one.refused})" if one.refused else ""),
            **{joint: significant(one.held_out_rms_nm.get(joint)) for joint in joints},
        }
        for one in choice.tried
    )
    rule = "the simplest whose error on motion left out of the fit lies within one standard error of the least"
    note = f"Taken: {choice.taken}. It is {rule} among those that can be."
    if choice.better is not None:
        note = f'Stated: {choice.taken}. {choice.better} is {rule}: [fit] estimate = "auto" would take it.'
    return section_of("Ways to fit: RMS on held-out motion, N·m", records, note)


def threshold_section(found: FittedThresholds) -> Section:
    """What motion does by itself at the fitted persistence, and what it rests on."""
    margins = [one.levels[-1].margin for one in found.joints.values() if one.levels]
    note = (
        "What contact-free motion reaches at the rule's persistence, about once in ten hours of the arm, times "
        f'{max(margins, default=1.0):.3g} for other recordings. gamma_nm = "auto" stands above it, "sharpest" at it.'
    )
    return section_of("Motion's level", (_motion_level(joint, one) for joint, one in found.joints.items()), note)


def _motion_level(joint: str, one: JointThreshold) -> dict[str, str]:
    level = min(one.levels, key=lambda x: x.gamma_nm, default=None)
    passed = one.reason or NONE
    if level is not None:
        low, high = level.false_alarms_ci95
        passed = f"{significant(level.false_alarms_per_hour)} [{significant(low)} to {significant(high)}]"
    return {
        "Joint": joint,
        "Motion's level, N·m": NONE if level is None else significant(level.gamma_nm),
        "RMS on held-out motion": significant(one.rms_nm),
        "Motion": duration(3600.0 * one.hours),
        "Passed an hour [95 %]": passed,
    }


def _coupled(axes: dict[str, CoupledFriction]) -> Section:
    records = (
        {
            "Motor of": joint,
            "Turns with": " + ".join(
                name if w == 1 else f"{significant(w)}·{name}" for name, w in axis.weights.items()
            ),
            "Coulomb, N·m": with_interval(axis.coulomb_nm, axis.ci95.get("coulomb_nm")),
            "Viscous, N·m·s/rad": with_interval(axis.viscous_nm_s_per_rad, axis.ci95.get("viscous_nm_s_per_rad")),
            "Drive inertia, kg·m²": NONE
            if axis.inertia_kg_m2 is None
            else with_interval(axis.inertia_kg_m2, axis.ci95.get("inertia_kg_m2")),
        }
        for joint, axis in axes.items()
    )
    note = "Subtracted from the effort of each of these joints. Their own friction is in the table of friction."
    return section_of("Friction of coupled axes", records, note)


def _springs(springs: Mapping[str, AngleTorque]) -> Section:
    records = (
        {
            "Joint": name,
            "Angle, rad": significant(angle),
            "Torque, N·m": with_interval(torque, spring.ci95_nm[k] if spring.ci95_nm else None),
        }
        for name, spring in springs.items()
        for k, (angle, torque) in enumerate(zip(spring.angle_rad, spring.torque_nm, strict=True))
    )
    note = (
        "What a spring, a counterbalance or a cable adds by the angle of its joint alone, beside the offset: taken "
        "out of the effort; beyond these angles nothing of the joint is judged."
    )
    return section_of("Torque by the joint's angle", records, note)


def _identified(found: Identified) -> Iterator[Section]:
    joints = (
        {
            "Joint": name,
            "Effort per N·m": NONE
            if j.gain is None
            else with_interval(j.gain, j.gain_ci95)
            if j.gain_ci95
            else "1, not estimated",
            "Offset, N·m": with_interval(j.offset_nm, j.offset_ci95),
            "Rotor inertia (on file), kg·m²": f"{with_interval(j.armature_kg_m2, j.armature_ci95)} "
            f"({significant(j.armature_file_kg_m2)})",
            "RMS on held-out time, N·m": f"{significant(j.held_out_rms_file_nm)} → {significant(j.held_out_rms_nm)}",
        }
        for name, j in found.joints.items()
    )
    said = f"{found.samples} samples, {significant(found.sample_rate_hz)} a second: {found.loss}."
    yield section_of("Drives, as identified", joints, found.prior, said)
    yield _springs({name: j.angle_torque for name, j in found.joints.items() if j.angle_torque is not None})
    if "inertials" in found.estimate:
        yield from _inertials(found)
    if found.tool is not None:
        tool = found.tool
        row = {
            "In frame": tool.frame,
            "Mass, kg": with_interval(tool.mass_kg, tool.mass_ci95),
            "Centre of mass, m": NONE if tool.com_m is None else ", ".join(significant(x) for x in tool.com_m),
            "95 % of mass · centre (x; y; z), kg·m": "; ".join(interval(*b) for b in tool.moment_ci95_kg_m),
        }
        yield section_of("Tool, as the joints feel it", [row])


def _inertials(found: Identified) -> Iterator[Section]:
    bodies = (
        {
            "Moved by joint": name,
            "Mass (on file), kg": f"{significant(b.mass_kg)} ({significant(b.parameters_file[0])})",
            "Centre of mass, m": ", ".join(significant(x) for x in b.com_m),
            "Physically possible": "yes" if b.consistent else "no",
        }
        for name, b in found.bodies.items()
    )
    note = (
        "No motion determines every mass on its own: only the base parameters below are determined. "
        f"Physical consistency: {found.consistency}."
    )
    yield section_of("Inertials, as identified", bodies, note)
    base = (
        {
            "Combination": b.name,
            "Value": with_interval(b.value, b.ci95),
            "On file": significant(b.value_file),
            "Known from the data": percent(b.from_data, 0),
        }
        for b in found.base_parameters
    )
    yield section_of(f"{len(found.base_parameters)} base parameters, best known first", base, folded=True)


def _channels(channels: dict[str, ChannelFacts]) -> Section:
    records = (
        {
            "Log": log,
            "Effort": _delay(c.effort_delay_ms, c.effort_delay_ci95_ms),
            "Logged velocity": NONE if c.velocity_delay_ms is None else f"{c.velocity_delay_ms:.1f} ms",
            "Wrench": _delay(c.wrench_delay_ms, c.wrench_delay_ci95_ms),
        }
        for log, c in channels.items()
    )
    note = f"{NONE}: not in the log, or not determinable from this motion."
    return section_of("Sensor delays: lag behind the positions", records, note)


def _sensor(log: str, sensor: SensorFacts) -> Section:
    lines = [("mass carried, kg", with_interval(sensor.mass_kg, sensor.mass_ci95))]
    if sensor.com_m is not None and sensor.com_ci95 is not None:
        lines += _axes("centre of mass {}, m", "xyz", sensor.com_m, sensor.com_ci95)
    lines += _axes("offset of force {}, N", "xyz", sensor.offset[:3], sensor.offset_ci95[:3])
    lines += _axes("offset of moment {}, N·m", "xyz", sensor.offset[3:], sensor.offset_ci95[3:])
    if sensor.turn_deg is not None and sensor.turn_half_deg is not None:
        turn = ", ".join(f"{x:.2f}" for x in sensor.turn_deg)
        lines.append(("turned against its frame (rotation vector), degrees", f"{turn} ± {sensor.turn_half_deg:.2f}"))
    lines += _axes("drift of force {} over the log, N", "xyz", sensor.drift[:3], sensor.drift_ci95[:3])
    lines += _axes("drift of moment {} over the log, N·m", "xyz", sensor.drift[3:], sensor.drift_ci95[3:])
    title = f"Wrist sensor in {sensor.frame}, from {sensor.poses} poses at rest of {log}"
    return Section(title, ("Quantity", "Value"), tuple(lines), sensor.missing)


def _axes(text: str, names: str, values: tuple[float, ...], bounds: tuple[Bounds, ...]) -> list[tuple[str, str]]:
    return [(text.format(n), with_interval(x, b)) for n, x, b in zip(names, values, bounds, strict=True)]


def _trends(trends: dict[str, FrictionVariation]) -> Section:
    untold = [(joint, f"{text}.") for joint, found in trends.items() for text in found.untold]
    records = (
        {
            "Joint": joint,
            "Friction with running time, % a minute": _each(found.trends, "time", 100),
            "With temperature, % a kelvin": _each(found.trends, "temperature", 100),
            "With load, N·m per N·m": _each(found.trends, "load", 1),
        }
        for joint, found in trends.items()
    )
    return section_of("Friction trends (time, temperature, load)", records, *joint_lines(untold, len(trends)))


def _each(trends: Sequence[Trend], against: str, scale: float) -> str:
    """One entry a log; what is not told apart from nothing says so."""
    cells = []
    for t in trends:
        if t.against != against:
            continue
        low, high = (None if b is None else scale * b for b in t.ci95)
        if low is not None and low == high:  # of friction that is itself held at a limit
            cells.append("not determined")
            continue
        text = f"{significant(scale * t.per_unit, 2)} [{interval(low, high, 2)}]"
        cells.append(text if t.shown else f"{text}, not significant")
    return "; ".join(cells) or NONE


def _delay(value: float | None, bounds: Bounds | None) -> str:
    return NONE if value is None or bounds is None or None in bounds else f"{with_interval(value, bounds)} ms"


#: Points of a joint that the page lists one by one.
_MOST_POINTS = 40


def fit_sections(friction: FrictionFile, detail: bool = False) -> tuple[Section, ...]:
    """Friction and threshold of every joint, and what to do.

    Args:
        friction: the fit.
        detail: sensor delays, gains, inertials and trends, too.
    """
    joints = _joints(friction, detail)
    if not detail:
        return (joints,)
    left_out = tuple(f"{name}: {said}" for name, facts in friction.left_out.items() if (said := _left_out(facts)))
    found = Identification(friction.identified, friction.channels, friction.trends, friction.coupled, friction.choice)
    thresholds = friction.thresholds
    known = (threshold_section(thresholds),) if thresholds is not None and thresholds.joints else ()
    return (joints, Section("Contact in the logs", (), (), left_out), *known, *identified_sections(found))


def _left_out(facts: LeftOut) -> str:
    """What the fit of one log did without; empty where it used all."""
    if facts.refused:
        return "most of its motion is inconsistent with the rest, nothing of it was fitted"
    what = f"{len(facts.spans)} stretches, {facts.seconds:.3g} s, {100 * facts.share:.2g} % of the motion, left out"
    match facts.by:
        case "stated":
            return "stated to be free of contact, nothing left out"
        case "found":
            return f"{what}: looks like contact, a stop or a fault" if facts.spans else ""
        case "labels":
            return f"{what}: labelled as contact" if facts.spans else ""
        case _:
            assert_never(facts.by)


def _joints(friction: FrictionFile, detail: bool) -> Section:
    """One line a joint: model, threshold, quality, in detail parameters, too; below it what to do for the rest."""
    rows: list[tuple[str, ...]] = []
    said: list[tuple[str, str]] = []
    gamma = {}
    if friction.thresholds is not None:
        for joint, level, _, _, why in threshold_section(friction.thresholds).rows:
            gamma[joint] = level
            said += [(joint, f"no threshold from this fit: {why}")] if level == NONE else []
    for name, fit in friction.joints.items():
        speeds = "" if fit.speed_range_rad_s is None else " to ".join(f"{x:.3g}" for x in fit.speed_range_rad_s)
        parameters = (_parameters(fit),) if detail else ()
        quality = _quality(fit) if detail else _number(fit.rmse_nm)
        rows.append(
            (name, fit.model or "not fitted", _evidence(fit), gamma.get(name, NONE), quality, speeds, *parameters)
        )
        said += [(name, fit.reason)] if fit.reason else []
        if detail:
            said += [(name, text) for text in fit.not_identifiable]
            needed = () if fit.identifiability is None else fit.identifiability.motion_needed
            said += [(name, f"what would tell that, and nothing else needs: {'; '.join(needed)}")] if needed else []
    units = {fit.effort_unit for fit in friction.joints.values()}
    rmse = "RMSE (of rated)" if detail else f"RMSE, {' or '.join(sorted(units))}"
    head: tuple[str, ...] = ("joint", "model", "from", "auto γ, N·m", rmse, "speeds, rad/s")
    notes = joint_lines(said, len(friction.joints), brief=True)
    if detail:
        head = (*head, "parameters [95 % interval]")
    else:
        undetermined = [name for name, fit in friction.joints.items() if not fit.identifiable]
        named = "all joints" if len(undetermined) == len(friction.joints) else ", ".join(undetermined)
        left_open = f", and what is not determined ({named})" if undetermined else ""
        notes = [*notes, f"Parameters with 95 % intervals{left_open}: -v, and friction.json."]
    return Section("", head, tuple(rows), tuple(notes))


def _evidence(fit: FrictionFit) -> str:
    """What the law of a joint was told by."""
    if fit.model is None:
        return NONE
    if fit.motion == "sections":
        return f"{fit.n_pairs} pairs" if fit.n_pairs else f"{fit.section_count} sections"
    return "any motion" if fit.motion == "any" else fit.motion


def _parameters(fit: FrictionFit) -> str:
    if fit.model is None or law_named(fit.model).data_driven:
        return ""
    return "  ".join(
        f"{name.partition('_')[0]} {with_interval(value, fit.ci95.get(name))}" for name, value in fit.parameters.items()
    )


def _quality(fit: FrictionFit) -> str:
    """RMSE with its share of the joint's rated torque."""
    if fit.rmse_nm is None:
        return ""
    share = "" if fit.rmse_share is None else f" ({100 * fit.rmse_share:.2g} %)"
    return f"{fit.rmse_nm:.3g} {fit.effort_unit}{share}"


def friction_sections(fit: FrictionFit) -> tuple[Section, ...]:
    """Every table behind a joint's curve; long ones are folded."""
    return tuple(one for one in (_parameter_table(fit), _known(fit), _laws(fit), _points(fit)) if one.rows)


def _parameter_table(fit: FrictionFit) -> Section:
    return section_of(
        "Parameters",
        (
            {
                "parameter": ", ".join(t for t in (parameter_symbol(name), parameter_meaning(fit.model, name)) if t),
                "value": significant(value),
                "95 % interval": "none" if (bounds := fit.ci95.get(name)) is None else interval(*bounds),
                "unit": parameter_unit(name),
            }
            for name, value in fit.parameters.items()
        ),
    )


def _known(fit: FrictionFit) -> Section:
    return section_of(
        "Known all the same",
        (
            {
                "known all the same": k.name.replace(" - ", " − "),
                "value": f"{significant(k.value)} {k.unit}",
                "95 % interval": interval(*k.ci95),
            }
            for k in fit.known
        ),
    )


def _laws(fit: FrictionFit) -> Section:
    records = (
        {
            "law": f"{row.model} (chosen)" if row.chosen else row.model,
            "parameters": _number(row.parameters, 2),
            f"RMSE, {effort_unit(fit)}": _number(row.rmse_nm),
            "RMSE held out": _number(row.held_out_rmse_nm),
            "score held out": NONE
            if row.held_out_score is None
            else f"{significant(row.held_out_score)} ± {significant(row.held_out_score_se, 2)}",
            "AICc": _number(row.aicc),
            "remark": row.note,
        }
        for row in fit.comparison
    )
    return section_of(f"{len(fit.comparison)} friction laws compared on speeds held out", records, folded=True)


def _number(value: float | None, digits: int = 3) -> str:
    return NONE if value is None else significant(value, digits)


def _points(fit: FrictionFit) -> Section:
    """A line a point; of more than one reads, the plot shows them and friction.json lists them."""
    all_disturbed = all(point.others_moving for point in fit.points)
    records = [_point(point, fit, all_disturbed) for point in fit.points]
    if len(records) > _MOST_POINTS:
        records = [dict.fromkeys(records[0], "")]
        records[0][f"speed, {speed_unit(fit)}"] = f"{len(fit.points)} points: in the plot and in friction.json"
    return section_of(f"{len(fit.points)} friction points", records, *_points_notes(fit, all_disturbed), folded=True)


def _point(point: FrictionPoint, fit: FrictionFit, all_disturbed: bool) -> dict[str, str]:
    way = "both" if point.source == "pair" else "+" if point.direction > 0 else "−"
    return {
        f"speed, {speed_unit(fit)}": significant(point.speed_rad_s, 4),
        f"friction, {effort_unit(fit)}": significant(point.friction_nm, 4),
        "standard error": significant(point.se_nm, 2),
        "spread (sd)": significant(point.sd_nm, 2),
        "way": way + ("*" if point.others_moving and not all_disturbed else ""),
    }


def _points_notes(fit: FrictionFit, all_disturbed: bool) -> tuple[str, ...]:
    """How the points were found; only what occurs is said."""
    notes = {
        "Both: from both directions, gravity cancels.": any(point.source == "pair" for point in fit.points),
        "+ or −: from one direction, relies on the robot model.": any(point.source != "pair" for point in fit.points),
        "Other joints moved during every one.": all_disturbed,
        "*: other joints moved.": not all_disturbed and any(point.others_moving for point in fit.points),
    }
    return tuple(note for note, occurs in notes.items() if occurs)
