"""An effort that is stamped late in the judged log: a model in time then leaves a residual wherever torque changes."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.audit_result import Collision
from collaudit.core.findings import Finding
from collaudit.core.prepare.effort.channel_shift import effort_shift
from collaudit.core.prepare.effort.delay_estimate import Delay
from collaudit.core.prepare.prepared import Prepared

#: A delay that is surely longer is said, s.
_LATE_S = 0.01
#: So much of the log is looked at, s: it tells as much as an hour.
_LOOKED_AT_S = 240.0


def late_effort_findings(prepared: Prepared, collisions: Sequence[Collision], stated: bool) -> list[Finding]:
    """A delay of the effort beside alarms that it may have made.

    Args:
        prepared: the log.
        collisions: alarms.
        stated: whether the configuration states a delay; it is taken off already.
    """
    series = prepared.series
    if not collisions or stated or series.effort_unit != "Nm" or not prepared.robot.has_inertials:
        return []
    samples = round(_LOOKED_AT_S / series.period_s)
    contact = None if prepared.contact_nm is None else prepared.contact_nm[:samples]
    delay = effort_shift(series.head(samples), prepared.robot, prepared.judged, contact)
    if not isinstance(delay, Delay) or delay.ci95[0] < _LATE_S:
        return []
    low, high = (1e3 * x for x in delay.ci95)
    text = (
        f"The effort is {1e3 * delay.seconds:.0f} ms behind the motion (95 %: {low:.0f} to {high:.0f} ms). Where the "
        "fitted log's was not, alarms in changing motion may come from that. To correct it: [log] effort_delay_ms = "
        f"{1e3 * delay.seconds:.0f}. Nothing was changed."
    )
    return [Finding("effort-delay", "warning", text)]
