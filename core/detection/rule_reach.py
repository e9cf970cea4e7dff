"""Whether anything could ever exceed the rule: thresholds that no contact of the arm reaches, or hardly any.

How hard a push must be, and how long, is what ``core/verdict/sensitivity.py`` tells of the whole arm.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from collaudit.core.data.audit_result import RuleFacts
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import quantile_of
from collaudit.core.prepare.prepared import Prepared

#: A threshold that many times beyond all that any joint of the arm exerted, or than a joint's limit, is a mistake.
_FAR = 10.0
#: A threshold above this share of the range of the joint's torque tells little of what people do to an arm.
_COARSE = 0.1
#: Samples, drawn evenly, that tell that range.
_DRAWN = 100_000


def reach_findings(prepared: Prepared, rule: RuleFacts) -> list[Finding]:
    """Thresholds that nothing could exceed, and those that are large beside what the joints themselves exert.

    A drive holds against an external torque with its own, so an external torque above the joint's limit does not build
    up for long. The largest torque on record says what the arm is used for: an alarm that needs more than that needs
    a harder contact than all that the arm did itself.

    Args:
        prepared: the log, and the limits of its joints.
        rule: as applied.
    """
    series = prepared.judged_series
    if series.effort is None or series.effort_unit != "Nm":
        return []
    out, coarse = [], []
    largest, span = _largest_efforts(series), _range(series)
    limits = dict(zip(prepared.robot.joint_names, known_limits(prepared).tolist(), strict=True))
    most = max(largest.values(), default=0.0)
    for joint in rule.watch:
        gamma, limit = rule.gamma_nm[joint], limits[joint]
        if largest[joint] and (gamma > _FAR * most or gamma > _FAR * limit):
            limited = "" if np.isnan(limit) else f"; the joint's limit is {limit:.4g} N·m"
            text = (
                f"The threshold of joint '{joint}', {gamma:.4g} N·m, is more than {_FAR:g} times what this arm exerts "
                f"(at most {most:.4g} N·m on record{limited}): no contact exceeds it, and nothing is judged by it."
            )
            out.append(Finding("rule-unfit", "error", text, joint=joint))
        elif gamma > _COARSE * span[joint] > 0.0:
            coarse.append(f"{joint} {gamma:.3g} of {span[joint]:.3g}")
    if coarse:
        text = (
            f"Thresholds above a tenth of the range of the joint's own torque in this log, N·m: {', '.join(coarse)}. "
            "Contacts that are not small beside the arm's own torques go unseen there."
        )
        out.append(Finding("rule-unfit", "warning", text))
    return out


def known_limits(prepared: Prepared) -> FloatArray:
    """(j,) torque limits of the joints; NaN where none is known, or the log exceeds it: that is none."""
    largest = _largest_efforts(prepared.series) if prepared.series.effort_unit == "Nm" else {}
    seen = np.array([largest.get(joint, 0.0) for joint in prepared.robot.joint_names])
    return np.where(prepared.robot.effort_limit_nm >= seen, prepared.robot.effort_limit_nm, np.nan)


def _range(series: UniformSeries) -> Mapping[str, float]:
    """From the lowest to the highest effort of each joint, one in a hundred left out at either end, N·m or N."""
    assert series.effort is not None
    some = series.effort[:: max(1, series.effort.shape[0] // _DRAWN)]
    known = [column[np.isfinite(column)] for column in some.T]
    ends = [[quantile_of(x, share) if x.size else 0.0 for share in (0.01, 0.99)] for x in known]
    return {joint: b - a for joint, (a, b) in zip(series.joint_names, ends, strict=True)}


def _largest_efforts(series: UniformSeries) -> Mapping[str, float]:
    """The largest effort of each joint, N·m or N; joints without any are absent."""
    if series.effort is None:
        return {}
    ends = np.stack([np.fmax.reduce(series.effort, axis=0), -np.fmin.reduce(series.effort, axis=0)])
    size = np.abs(np.nan_to_num(np.maximum(*ends))).tolist()
    return dict(zip(series.joint_names, size, strict=True))
