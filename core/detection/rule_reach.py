"""Whether anything could ever exceed the rule: thresholds and persistences that no contact of the arm reaches."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from collaudit.core.data.audit_result import RuleFacts
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.errors import NotJudgedError
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import quantile_of
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel

#: Contacts as short as this are usual, s: a longer persistence lets them pass.
LONGEST_PERSISTENCE_S = 0.25
#: A threshold that many times beyond all that any joint of the arm exerted, or than a joint's limit, is a mistake.
_FAR = 10.0
#: A threshold above this share of the range of the joint's torque tells little of what people do to an arm.
_COARSE = 0.1
#: Samples, drawn evenly, that tell that range.
_DRAWN = 100_000


def reach_findings(series: UniformSeries, robot: RobotModel, rule: RuleFacts) -> list[Finding]:
    """Thresholds that nothing, or hardly anything, could exceed.

    A drive holds against an external torque with its own, so an external torque above the joint's limit does not build
    up for long. The largest torque on record says what the arm is used for: an alarm that needs more than that needs
    a harder contact than all that the arm did itself. Limits that the log itself exceeds are no limits and count for
    nothing.

    Args:
        series: the judged joints, effort in N·m or N.
        robot: their limits.
        rule: as applied.
    """
    out: list[Finding] = []
    if series.effort_unit != "Nm":
        return out
    largest = largest_efforts(series)
    limits = dict(zip(robot.joint_names, robot.effort_limit_nm.tolist(), strict=True))
    most = max(largest.values(), default=0.0)
    above_limit, above_record = [], []
    for joint in rule.watch:
        gamma, seen, limit = rule.gamma_nm[joint], largest.get(joint, 0.0), limits.get(joint, float("nan"))
        bounded = limit >= seen  # not where there is no limit, which is NaN, or the log exceeds it
        if not seen:
            continue
        if gamma > _FAR * most or (bounded and gamma > _FAR * limit):
            out.append(_hopeless(joint, gamma, most, limit if bounded else None))
        elif bounded and gamma > limit:
            above_limit.append(f"{joint} {gamma:.4g} (limit {limit:.4g})")
        elif gamma > seen:
            above_record.append(f"{joint} {gamma:.4g} (largest {seen:.4g})")
    if above_limit:
        text = f"Thresholds above the joints' limits, N·m: {', '.join(above_limit)}. Hardly any contact would alarm."
        out.append(Finding("rule-unfit", "warning", text))
    if above_record:
        text = (
            f"Thresholds above the largest torque on record, N·m: {', '.join(above_record)}. Only a contact "
            "stronger than every torque of the joint in this log would alarm."
        )
        out.append(Finding("rule-unfit", "warning", text))
    return out


def coarse_findings(series: UniformSeries, rule: RuleFacts) -> list[Finding]:
    """Thresholds that are large beside what the joints themselves exert in this log.

    Args:
        series: the judged joints, effort in N·m or N.
        rule: as applied.
    """
    if series.effort is None or series.effort_unit != "Nm":
        return []
    span = _range(series)
    coarse = [
        f"{joint} {rule.gamma_nm[joint]:.3g} of {span[joint]:.3g}"
        for joint in rule.watch
        if rule.gamma_nm[joint] > _COARSE * span[joint] > 0.0
    ]
    if not coarse:
        return []
    text = (
        f"Thresholds above a tenth of the range of the joint's own torque in this log, N·m: {', '.join(coarse)}. "
        "Contacts that are not small beside the arm's own torques go unseen there."
    )
    return [Finding("rule-unfit", "warning", text)]


def _range(series: UniformSeries) -> Mapping[str, float]:
    """From the lowest to the highest effort of each joint, one in a hundred left out at either end, N·m or N."""
    assert series.effort is not None
    some = series.effort[:: max(1, series.effort.shape[0] // _DRAWN)]
    known = [column[np.isfinite(column)] for column in some.T]
    ends = [[quantile_of(x, share) if x.size else 0.0 for share in (0.01, 0.99)] for x in known]
    return {joint: b - a for joint, (a, b) in zip(series.joint_names, ends, strict=True)}


def _hopeless(joint: str, gamma: float, most: float, limit: float | None) -> Finding:
    limit_text = "" if limit is None else f"; the joint's limit is {limit:.4g} N·m"
    text = (
        f"The threshold of joint '{joint}', {gamma:.4g} N·m, is more than {_FAR:g} times what this arm exerts (at most "
        f"{most:.4g} N·m on record{limit_text}): no contact exceeds it, and nothing is judged by it."
    )
    return Finding("rule-unfit", "error", text, joint=joint)


def check_persistence(series: UniformSeries, n: int) -> None:
    """Refuse a persistence of more samples than the log has, before anything takes memory for them.

    Raises:
        NotJudgedError: nothing could alarm.
    """
    if n > series.time_s.size:
        raise NotJudgedError(
            "the persistence is longer than the log: nothing could alarm",
            found=f"n = {n} samples ({n * series.period_s:.4g} s), of {series.time_s.size} in the log",
            hint="shorten [detect] persistence_ms or n; 25 ms is usual",
        )


def persistence_findings(rule: RuleFacts) -> list[Finding]:
    """A persistence that is longer than many contacts."""
    if rule.persistence_s <= LONGEST_PERSISTENCE_S:
        return []
    text = (
        f"The persistence n = {rule.n} is {rule.persistence_s:.4g} s: a contact shorter than that does not alarm, "
        "however hard it is."
    )
    return [Finding("rule-unfit", "warning", text)]


def largest_efforts(series: UniformSeries) -> Mapping[str, float]:
    """The largest effort of each joint, N·m or N; joints without any are absent."""
    effort: FloatArray | None = series.effort
    if effort is None:
        return {}
    ends = np.stack([np.fmax.reduce(effort, axis=0), -np.fmin.reduce(effort, axis=0)])
    size = np.abs(np.nan_to_num(np.maximum(*ends))).tolist()
    return dict(zip(series.joint_names, size, strict=True))


def known_limits(prepared: Prepared) -> FloatArray:
    """(j,) torque limits of the joints; NaN where none is known, or the log exceeds it: that is none."""
    largest = largest_efforts(prepared.series) if prepared.series.effort_unit == "Nm" else {}
    seen = np.array([largest.get(joint, 0.0) for joint in prepared.robot.joint_names])
    return np.where(prepared.robot.effort_limit_nm >= seen, prepared.robot.effort_limit_nm, np.nan)
