"""What settled motion shows beside the friction laws: corrections, trends and patterns of position, joint by joint.

All three look at the same samples, which take 100 MB a joint of an hour: made once, and let go before the next.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from collaudit.core.data.friction_result import FrictionCorrection, FrictionFit
from collaudit.core.data.identification_result import FrictionVariation
from collaudit.core.detection.position_pattern import settled_pattern_findings
from collaudit.core.findings import Finding
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.friction_variation import joint_variation, merged
from collaudit.core.friction.gear.correction_fit import joint_correction
from collaudit.core.friction.motion_points import settled_residual
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.stage_progress import Progress
from collaudit.core.prepare.prepared import Prepared


@dataclass(frozen=True, slots=True)
class SettledMotion:
    """What the settled motion of the fitted logs shows.

    Attributes:
        corrections: by joint, of all logs together; joints that need none are absent.
        variation: by joint, log after log.
        patterns: of each log the findings on torque that follows the position.
    """

    corrections: dict[str, FrictionCorrection]
    variation: dict[str, FrictionVariation]
    patterns: tuple[list[Finding], ...]


#: Of one joint: its correction, and of each log that has settled motion, by its number, variation and findings.
_Shown = tuple[FrictionCorrection | None, dict[int, FrictionVariation], dict[int, list[Finding]]]


def settled_motion(
    prepared: Sequence[Prepared], fits: Mapping[str, FrictionFit], progress: Progress | None = None
) -> SettledMotion:
    """What is left beside each joint's law while it moves steadily.

    Args:
        prepared: the logs that the friction was fitted on.
        fits: friction of all of them together.
        progress: called with joints done and in all.
    """

    def of_joint(joint: str) -> _Shown:
        law = FrictionModel.of(fits[joint])
        if law is None or fits[joint].effort_unit == "raw":
            return None, {}, {}
        logs = {k: log for k, log in enumerate(prepared) if joint in log.judged}
        parts = {k: left for k, log in logs.items() if (left := settled_residual(log, joint, law)) is not None}
        in_torque = [part for k, part in parts.items() if logs[k].series.effort_unit == "Nm"]
        return (
            joint_correction(in_torque) if in_torque else None,
            {k: joint_variation(logs[k].series.source.name, part) for k, part in parts.items()},
            {k: settled_pattern_findings(joint, part) for k, part in parts.items()},
        )

    joints, numbers = by_name(of_joint, fits, progress), range(len(prepared))
    return SettledMotion(
        {joint: correction for joint, (correction, _, _) in joints.items() if correction is not None},
        merged([{joint: its[k] for joint, (_, its, _) in joints.items() if k in its} for k in numbers]),
        tuple([finding for _, _, patterns in joints.values() for finding in patterns.get(k, [])] for k in numbers),
    )
