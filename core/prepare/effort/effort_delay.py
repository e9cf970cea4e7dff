"""An effort that seems inverted because it is late: the delay is said, and no sign is advised."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from collaudit.core.conditioning.channel_delay import moved
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.findings.finding_kinds import Severity
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.effort.channel_shift import effort_shift
from collaudit.core.prepare.effort.delay_estimate import Delay
from collaudit.core.prepare.effort.effort_gain import EffortGain, effort_gains
from collaudit.core.prepare.effort.gain_findings import sign_findings, unknown_sign_findings
from collaudit.core.robot.robot_model import RobotModel

_LATE_S = 0.02


def effort_findings(
    series: UniformSeries,
    robot: RobotModel,
    rigid: FloatArray,
    contact: FloatArray | None,
    gains: tuple[EffortGain, ...],
    judged: tuple[str, ...],
    taken_off_ms: float | None,
    stated: Collection[str] = (),
) -> tuple[list[Finding], Delay | None]:
    """What the gains say of the effort; a delay in place of signs that it explains.

    Args:
        series: the log.
        robot: with inertials.
        rigid: (n, j) rigid-body torque.
        contact: (n, j) torque of the commanded tool force, or None.
        gains: effort against both together.
        judged: joints to speak of.
        taken_off_ms: delay that the configuration states, and that is taken off already; None where it states none.
        stated: joints whose sign the configuration states.

    Returns:
        The findings, and the delay where it explains signs.
    """
    findings = sign_findings(gains, judged, stated)
    inverted = {g.joint for g in gains if g.inverted}
    if not inverted:
        return findings, None
    delay = effort_shift(series, robot, [g.joint for g in gains], contact)
    if not isinstance(delay, Delay) or delay.ci95[0] < _LATE_S:
        return findings, None
    undone = {g.joint for g in gains_at(series, rigid, delay, contact) if not g.inverted} & inverted
    if not undone:
        return findings, None
    low, high = (1e3 * x for x in delay.ci95)
    text = (
        f"The effort is {1e3 * delay.seconds:.0f} ms behind the motion (95 %: {low:.0f} to {high:.0f} ms). As stamped "
        f"it seems to run against the model's torque on {', '.join(sorted(undone))}; with the delay taken off it does "
        f"not: no sign is inverted there. To correct it: [log] effort_delay_ms = "
        f"{(taken_off_ms or 0.0) + 1e3 * delay.seconds:.0f}. Nothing was changed."
    )
    still = tuple(g for g in gains if g.inverted and g.joint not in undone)
    findings = sign_findings(still, (), stated)
    findings += unknown_sign_findings(gains, judged)
    severity: Severity = "error" if taken_off_ms is None else "warning"  # what is stated is no veto against itself
    return [Finding("effort-delay", severity, text), *findings], delay


def gains_at(
    series: UniformSeries, expected: FloatArray, delay: Delay, contact: FloatArray | None = None
) -> tuple[EffortGain, ...]:
    """Gains of the effort with a delay taken off."""
    assert series.effort is not None
    shifted = replace(series, effort=moved(series.effort, series, delay.seconds))
    return effort_gains(shifted, np.asarray(expected), contact)
