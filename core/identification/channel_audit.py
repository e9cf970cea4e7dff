"""The audit of a log's channels: what the effort is, delays, the wrist sensor."""

from __future__ import annotations

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import Bounds, ChannelFacts
from collaudit.core.findings import Finding
from collaudit.core.identification.channel_delays import audit_delays, effort_delay, is_significant, wrench_delay
from collaudit.core.identification.effort_audit import audit_effort
from collaudit.core.identification.force_sensor import audit_force_sensor, calibrate_sensor, sensor_facts
from collaudit.core.prepare.effort.delay_estimate import Delay
from collaudit.core.prepare.prepared import Prepared

_MATTERS_S = 0.02


def audit_channels(prepared: Prepared, config: Config) -> tuple[ChannelFacts, list[Finding]]:
    """Everything that can be said about the channels of one log."""
    effort, wrench = effort_delay(prepared), wrench_delay(prepared, config)
    told = effort if isinstance(effort, Delay) else None
    pulled = wrench if isinstance(wrench, Delay) else None
    spoils_gains = told is not None and is_significant(told, prepared.series.period_s)
    spoils_gains &= told is not None and abs(told.seconds) > _MATTERS_S
    calibration = calibrate_sensor(prepared, config)
    velocity = prepared.series.velocity_lag_s
    facts = ChannelFacts(
        effort_delay_ms=_ms(told),
        effort_delay_ci95_ms=_bounds_ms(told),
        velocity_delay_ms=None if velocity is None else 1e3 * velocity,
        wrench_delay_ms=_ms(pulled),
        wrench_delay_ci95_ms=_bounds_ms(pulled),
        sensor=None if calibration is None else sensor_facts(calibration, config),
    )
    findings = audit_effort(prepared, told if spoils_gains else None)
    findings += audit_delays(prepared, config, effort, wrench)
    return facts, findings + audit_force_sensor(prepared, config, facts.sensor)


def _ms(delay: Delay | None) -> float | None:
    return None if delay is None else 1e3 * delay.seconds


def _bounds_ms(delay: Delay | None) -> Bounds | None:
    return None if delay is None else (1e3 * delay.ci95[0], 1e3 * delay.ci95[1])
