"""Recommended thresholds in the form of a configuration, or of a controller whose interface is public."""

from __future__ import annotations

from collaudit.core.config.toml_text import key_item
from collaudit.core.recommend.arm_recommendation import ArmRecommendation

#: What :func:`snippet` makes.
SNIPPETS = ("config", "franka", "ur")

_FRANKA = """\
// libfranka, from collaudit: {claim}
// Joints in this order: {joints}
// Torques only. What these logs say of forces is not here: keep the force limits that are set ({{...}} below).
// The controller estimates external torque by a filter of its own: try these before relying on them.
const std::array<double, {count}> torque_nm{{{{{values}}}}};
robot.setCollisionBehavior(torque_nm, torque_nm, {{...}}, {{...}});
"""
_UR = """\
# Universal Robots: not comparable. Safety limits bound force, power, momentum, speed and stopping at the level of the
# safety system, which computes torques in its own way and does not take thresholds of a residual per joint.
# Do not set them from these numbers: {values}
"""


def snippet(kind: str, found: ArmRecommendation) -> str:
    """The thresholds as text to paste.

    Args:
        kind: one of :data:`SNIPPETS`.
        found: the recommendation.
    """
    from collaudit.reports.terminal.recommendation_text import claim

    gammas = {joint: rule.gamma_nm for joint, rule in found.joints.items() if rule.gamma_nm is not None}
    if kind == "config":
        return _config(found, gammas)
    if kind == "franka":
        values = ", ".join(f"{gamma:g}" for gamma in gammas.values())
        return _FRANKA.format(claim=claim(found), joints=", ".join(gammas), count=len(gammas), values=values)
    values = ", ".join(f"{joint} {gamma:g} {found.units.get(joint, 'N·m')}" for joint, gamma in gammas.items())
    return _UR.format(values=values)


def _config(found: ArmRecommendation, gammas: dict[str, float]) -> str:
    """``[detect]`` with thresholds, persistence, and the range of the evidence of each joint."""
    import tomlkit

    from collaudit.reports.terminal.recommendation_text import claim

    detect = tomlkit.table()
    detect.add(tomlkit.comment(claim(found)))
    detect.append("persistence_ms", round(1e3 * found.persistence_s, 6))
    thresholds = tomlkit.table()
    for joint, gamma in gammas.items():
        thresholds.append(key_item(joint, quoted=True), gamma)
    detect.append("gamma_nm", thresholds)
    ranges = tomlkit.table(is_super_table=True)
    for joint, known in found.ranges.items():
        table = tomlkit.table()
        table.append("fastest_rad_s", float(f"{known.fastest_rad_s:.4g}"))
        table.append("hardest_rad_s2", float(f"{known.hardest_rad_s2:.4g}"))
        table.append("load_nm", [float(f"{known.least_nm:.4g}"), float(f"{known.most_nm:.4g}")])
        if known.phases:
            table.append("phases", sorted(known.phases))
        if known.temperature_c is not None:
            table.append("temperature_c", [float(f"{x:.4g}") for x in known.temperature_c])
        if known.reversals_per_h is not None:
            table.append("reversals_per_h", float(f"{known.reversals_per_h:.3g}"))
        table.append("standing", known.standing > 0)
        ranges.append(key_item(joint, quoted=True), table)
    detect.append("evidence", ranges)
    made = tomlkit.document()
    made.append("detect", detect)
    return tomlkit.dumps(made)
