"""Where the effort is measured: at the motor, before the gear's friction, or by a torque sensor behind it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

from collaudit.core.findings import Finding

if TYPE_CHECKING:
    from collaudit.core.config.schema import LogConfig

EffortSource = Literal["motor", "joint"]

#: Arms whose drivers publish joint-side torque sensors, by the names of their joints.
_SENSED = re.compile(
    r"(^|[_/])(panda|fer|fr3|fp3|franka|iiwa\d*|lbr(_\w+)?|lwr|med7|med14|gen3|rizon\d*|diana\d*|sawyer)(_|$)", re.I
)


def effort_source(settings: LogConfig, joints: Sequence[str]) -> tuple[EffortSource, tuple[Finding, ...]]:
    """What ``[log] effort_source`` states; for ``auto`` what the joints' names say of the arm, which is a finding.

    Args:
        settings: ``[log]``.
        joints: the model's names of the joints.

    Returns:
        The source. ``motor`` is the careful choice: a resting joint's friction may then hide torque.
    """
    if settings.effort_source != "auto":
        return settings.effort_source, ()
    named = [joint for joint in joints if _SENSED.search(joint)]
    if not named or 2 * len(named) <= len(joints):
        return "motor", ()
    text = (
        f"The effort was taken to be that of torque sensors behind the gears, as arms with joints called '{named[0]}' "
        "have them: little friction hides external torque at rest. If it is a motor's torque or current, state "
        '[log] effort_source = "motor".'
    )
    return "joint", (Finding("effort-source", "info", text),)
