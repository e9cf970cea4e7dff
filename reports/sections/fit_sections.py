"""What a fit says of each joint, in a line or in full, and what it left out of the logs."""

from __future__ import annotations

from typing import assert_never

from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.friction_result import FrictionFit, FrictionPoint
from collaudit.core.data.identification_result import Identification, LeftOut
from collaudit.core.friction.law_candidates import parameter_symbol
from collaudit.core.friction_laws.law_registry import law_named
from collaudit.reports.sections.identified_sections import identified_sections, threshold_section
from collaudit.reports.sections.section import Section
from collaudit.reports.values.joint_lines import joint_lines
from collaudit.reports.values.numbers import interval, significant, with_interval
from collaudit.reports.values.words import NONE, effort_unit, parameter_meaning, parameter_unit, speed_unit

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
    rows = tuple(
        (
            ", ".join(text for text in (parameter_symbol(name), parameter_meaning(fit.model, name)) if text),
            significant(value),
            "none" if (bounds := fit.ci95.get(name)) is None else interval(*bounds),
            parameter_unit(name),
        )
        for name, value in fit.parameters.items()
    )
    return Section("Parameters", ("parameter", "value", "95 % interval", "unit"), rows)


def _known(fit: FrictionFit) -> Section:
    rows = tuple(
        (k.name.replace(" - ", " − "), f"{significant(k.value)} {k.unit}", interval(*k.ci95)) for k in fit.known
    )
    return Section("Known all the same", ("known all the same", "value", "95 % interval"), rows)


def _laws(fit: FrictionFit) -> Section:
    rows = tuple(
        (
            f"{row.model} (chosen)" if row.chosen else row.model,
            _number(row.parameters, 2),
            _number(row.rmse_nm),
            _number(row.held_out_rmse_nm),
            NONE
            if row.held_out_score is None
            else f"{significant(row.held_out_score)} ± {significant(row.held_out_score_se, 2)}",
            _number(row.aicc),
            row.note,
        )
        for row in fit.comparison
    )
    rmse = f"RMSE, {effort_unit(fit)}"
    head = ("law", "parameters", rmse, "RMSE held out", "score held out", "AICc", "remark")
    return Section(f"{len(rows)} friction laws compared on speeds held out", head, rows, folded=True)


def _number(value: float | None, digits: int = 3) -> str:
    return NONE if value is None else significant(value, digits)


def _points(fit: FrictionFit) -> Section:
    """A line a point; of more than one reads, the plot shows them and friction.json lists them."""
    all_disturbed = all(point.others_moving for point in fit.points)
    rows = tuple(_point(point, all_disturbed) for point in fit.points)
    if len(rows) > _MOST_POINTS:
        rows = ((f"{len(rows)} points: in the plot and in friction.json", "", "", "", ""),)
    torque, speed = effort_unit(fit), speed_unit(fit)
    head = (f"speed, {speed}", f"friction, {torque}", "standard error", "spread (sd)", "way")
    return Section(f"{len(fit.points)} friction points", head, rows, _points_notes(fit, all_disturbed), folded=True)


def _point(point: FrictionPoint, all_disturbed: bool) -> tuple[str, ...]:
    numbers = (significant(point.speed_rad_s, 4), significant(point.friction_nm, 4))
    spreads = (significant(point.se_nm, 2), significant(point.sd_nm, 2))
    way = "both" if point.source == "pair" else "+" if point.direction > 0 else "−"
    star = "*" if point.others_moving and not all_disturbed else ""
    return *numbers, *spreads, way + star


def _points_notes(fit: FrictionFit, all_disturbed: bool) -> tuple[str, ...]:
    """How the points were found; only what occurs is said."""
    notes = {
        "Both: from both directions, gravity cancels.": any(point.source == "pair" for point in fit.points),
        "+ or −: from one direction, relies on the robot model.": any(point.source != "pair" for point in fit.points),
        "Other joints moved during every one.": all_disturbed,
        "*: other joints moved.": not all_disturbed and any(point.others_moving for point in fit.points),
    }
    return tuple(note for note, occurs in notes.items() if occurs)
