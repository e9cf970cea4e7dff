"""The audit of a log's channels: what the effort is, delays, the wrist sensor."""

from __future__ import annotations

from collaudit.core.config.schema import Config
from collaudit.core.findings import Finding
from collaudit.core.identification.delays import audit_delays
from collaudit.core.identification.effort_audit import audit_effort
from collaudit.core.identification.force_sensor import audit_force_sensor
from collaudit.core.prepare import Prepared


def audit_channels(prepared: Prepared, config: Config) -> list[Finding]:
    """Everything that can be said about the channels of one log."""
    return [*audit_effort(prepared), *audit_delays(prepared, config), *audit_force_sensor(prepared, config)]
