"""The audit of a log's channels: what the effort is, delays, the wrist sensor."""

from __future__ import annotations

from collaudit.core.config.schema import Config
from collaudit.core.findings import Finding
from collaudit.core.identification.delays import audit_delays, effort_delay, told
from collaudit.core.identification.effort_audit import audit_effort
from collaudit.core.identification.force_sensor import audit_force_sensor
from collaudit.core.prepare import Prepared

_MATTERS_S = 0.02


def audit_channels(prepared: Prepared, config: Config) -> list[Finding]:
    """Everything that can be said about the channels of one log."""
    delay = effort_delay(prepared)
    late = delay is not None and told(delay, prepared.series.period_s) and abs(delay.seconds) > _MATTERS_S
    kind = audit_effort(prepared, delay if late else None)
    return [*kind, *audit_delays(prepared, config, delay), *audit_force_sensor(prepared, config)]
