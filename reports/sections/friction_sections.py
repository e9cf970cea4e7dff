"""One joint's friction: parameters, what is known all the same, laws compared, points."""

from __future__ import annotations

from collaudit.core.data.friction_result import FrictionFit, FrictionPoint
from collaudit.core.friction.law_candidates import parameter_symbol
from collaudit.reports.sections.section import Section
from collaudit.reports.values.numbers import interval, significant
from collaudit.reports.values.words import NONE, effort_unit, parameter_meaning, parameter_unit, speed_unit

#: Points of a joint that the page lists one by one.
_MOST_POINTS = 40


def friction_sections(fit: FrictionFit) -> tuple[Section, ...]:
    """Every table behind a joint's curve; long ones are folded."""
    return tuple(one for one in (_parameters(fit), _known(fit), _laws(fit), _points(fit)) if one.rows)


def _parameters(fit: FrictionFit) -> Section:
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
