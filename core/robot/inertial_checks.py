"""What a built model cannot know: links without mass, inertias no body can have, joints held still."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from collaudit.core.findings import Finding
from collaudit.core.findings.finding_kinds import Severity
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.pinocchio_model import PinocchioModel
from collaudit.core.robot.robot_description import Description


def inertial_findings(description: Description, model: PinocchioModel) -> tuple[bool, tuple[Finding, ...]]:
    """Whether torques can be computed at all, and what limits them. To be called before a tool is added."""
    where = description.where
    parts = model.bodies()
    links = {joint.name: joint.link for joint in description.joints}
    empty = [name for name, mass, _ in parts if mass <= 0.0]
    if len(empty) == len(parts):
        text = (
            "No link of the robot has a mass: no model torque can be computed, and nothing is judged. Friction can be "
            "fitted from pairs of directions only."
        )
        return False, (Finding("model-no-inertials", "warning", text, where=where),)
    named = ", ".join(f"{links[name]} (moved by {name})" for name in empty)
    odd = [links[name] for name, mass, inertia in parts if mass > 0.0 and not _possible(inertia)]
    points = [f"link{i}" for i, row in enumerate(description.rows, 1) if row.mass_kg and not row.inertia_kg_m2]
    limits: list[tuple[list[str], Severity, str]] = [
        (empty, "warning", f"Links without mass are taken as weightless: {named}."),
        (odd, "warning", f"No rigid body has the inertia given for: {', '.join(odd)}; it is used as it stands."),
        (points, "info", f"Links without inertia_kg_m2 are taken as point masses: {', '.join(points)}."),
    ]
    return True, tuple(Finding("model-approximate", how, text, where=where) for some, how, text in limits if some)


#: A locked joint that moves less than this (a gripper's finger) changes no torque worth a warning, kg.
_LIGHT_KG = 0.2


def locked_findings(
    description: Description,
    locked: Mapping[str, float],
    parked: Sequence[str],
    names: Sequence[str],
    whole: PinocchioModel,
) -> list[Finding]:
    """Which joints are held, and how much that matters.

    A joint between the base and a judged joint changes every torque after it; one beside or beyond them changes
    where its mass is. With one between judged joints, whose position is not known, no torque of theirs is known.

    Args:
        description: the robot's.
        locked: joints that are held, and where.
        parked: those of them whose place was stated.
        names: joints of the log.
        whole: the model with all joints free.
    """
    heavy = [name for name, mass, _ in whole.bodies() if name in locked and mass >= _LIGHT_KG]
    place = {joint.name: number for number, joint in enumerate(description.joints)}
    first_judged = min(place[name] for name in names)
    last_judged = max(place[name] for name in names)
    before = [name for name in locked if name not in parked and place[name] < last_judged]
    at_zero = ", ".join(name for name in locked if name not in parked)
    stated = ", ".join(f"{name} at {locked[name]:.6g}" for name in locked if name in parked)
    text = f"Not in the log and held at zero: {at_zero}." if at_zero else ""
    text += f" Not in the log and parked as configured: {stated}." if stated else ""
    if any(place[name] < first_judged for name in before):
        text += " Torques are wrong if such a joint lies below the others and was not at zero."
    severe = before or any(name not in parked for name in heavy)
    out = [Finding("model-joint-locked", "warning" if severe else "info", text.strip(), where=description.where)]
    for name in whole.between([name for name in locked if name not in parked], names):
        text = (
            f"Joint '{name}' lies between joints of the log and is not in it: where it stood is not known, so no model "
            f"torque is, and nothing is judged. If it stood still: [robot.parked] {name} = its position."
        )
        out.append(Finding("model-joint-between", "error", text, where=description.where, joint=name))
    return out


def _possible(inertia: FloatArray) -> bool:
    """Principal moments are not negative and obey the triangle inequality (to rounding in the file)."""
    moments = np.linalg.eigvalsh(inertia)
    slack = 1e-6 + 1e-3 * float(moments[2])
    return bool(moments[0] >= -slack and moments[0] + moments[1] >= moments[2] - slack)
