"""Friction, sensor delays, gains, inertials and trends for a terminal."""

from __future__ import annotations

from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.identification_result import Identification
from collaudit.reports.terminal.text_table import table, table_with_text, wrapped
from collaudit.reports.values.identified import NONE, identification_tables, threshold_table
from collaudit.reports.values.joint_lines import joint_lines


def fit_text(friction: FrictionFile, width: int | None = None, detail: bool = False) -> str:
    """Friction and threshold of every joint, and what to do; in detail sensor delays, gains, inertials and trends, too.

    Args:
        friction: the fit.
        width: columns of the terminal that tables are cut to; None: any.
        detail: all that was identified.
    """
    text = f"{_fit_table(friction, width)}\n{_left_out_text(friction)}"
    return text + (_identification_text(friction, width) if detail else "")


def _left_out_text(friction: FrictionFile) -> str:
    """What the fit did without, one line a log."""
    why = {"found": "looks like contact, a stop or a fault", "labels": "labelled as contact"}
    lines = []
    for name, facts in friction.left_out.items():
        if facts.by == "stated":
            lines.append(f"{name}: stated to be free of contact, nothing left out\n")
        elif facts.refused:
            lines.append(f"{name}: mostly contact, nothing of it was fitted\n")
        elif facts.spans:
            what = f"{len(facts.spans)} stretches, {facts.seconds:.3g} s, {100 * facts.share:.2g} % of the motion"
            lines.append(f"{name}: left out of the fit: {what} ({why[facts.by]})\n")
    return "".join(lines)


def _identification_text(friction: FrictionFile, width: int | None) -> str:
    """Sensor delays, gains, inertials and trends, table by table; long tables stay in friction.json and the page."""

    found = Identification(friction.identified, friction.channels, friction.trends, friction.coupled, friction.choice)
    parts = []
    tables = identification_tables(found)
    if friction.thresholds is not None and friction.thresholds.joints:
        tables = (threshold_table(friction.thresholds), *tables)
    for each in tables:
        if not each.folded:
            notes = "".join(f"{wrapped(f'  {note}', width, '    ')}\n" for note in each.notes)
            parts.append(f"\n{each.title}\n{table(each.head, each.rows, width=width, fold=True)}{notes}")
    return "".join(parts)


def _fit_table(friction: FrictionFile, width: int | None) -> str:
    """One line a joint: model, threshold, quality, parameters with intervals; below it what to do for the rest."""
    rows = []
    said: list[tuple[str, str]] = []
    gamma = {}
    if friction.thresholds is not None:
        for joint, level, _, _, why in threshold_table(friction.thresholds).rows:
            gamma[joint] = level
            said += [(joint, f"no threshold from this fit: {why}")] if level == NONE else []
    for name, fit in friction.joints.items():
        told = (name, fit.model or "not fitted", gamma.get(name, NONE), _quality(fit), _speeds(fit), _parameters(fit))
        rows.append(told)
        if fit.reason:
            said.append((name, fit.reason))
        said += [(name, text) for text in fit.not_identifiable]
        if fit.identifiability is not None and fit.identifiability.motion_needed:
            said.append((name, f"to determine it: {'; '.join(fit.identifiability.motion_needed)}"))
    remarks = [wrapped(f"  {line}", width, "    ") for line in joint_lines(said, len(friction.joints), brief=True)]
    head = ("joint", "model", "auto gamma N·m", "RMSE (of rated)", "speeds rad/s", "parameters [95 % interval]")
    return "\n".join([table_with_text(head, rows, (2,), width).rstrip(), *remarks])


def _parameters(fit: FrictionFit) -> str:
    parts = []
    for name, value in fit.parameters.items():
        bounds = fit.ci95.get(name)
        interval = "" if bounds is None else f" [{_bound(bounds[0])}, {_bound(bounds[1])}]"
        if bounds is not None and bounds[0] is not None and bounds[0] == bounds[1]:
            interval = " (held at its limit)"  # where the data ask for what friction cannot have
        parts.append(f"{name.partition('_')[0]} {value:.4g}{interval}")
    return "  ".join(parts)


def _bound(value: float | None) -> str:
    return "open" if value is None else f"{value:.3g}"


def _quality(fit: FrictionFit) -> str:
    """RMSE with its share of the joint's rated torque."""
    if fit.rmse_nm is None:
        return ""
    share = "" if fit.rmse_share is None else f" ({100 * fit.rmse_share:.2g} %)"
    return f"{fit.rmse_nm:.3g} {fit.effort_unit}{share}"


def _speeds(fit: FrictionFit) -> str:
    return "" if fit.speed_range_rad_s is None else f"{fit.speed_range_rad_s[0]:.3g} to {fit.speed_range_rad_s[1]:.3g}"
