"""Logs cut, pushed or spoilt in memory, and judged as the commands judge them: the one place that knows how."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from hashlib import sha256

import numpy as np

from collaudit.core import api
from collaudit.core.audit import audit_log
from collaudit.core.config import LoadedConfig
from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.preparation import prepare
from collaudit.core.prepare.prepared import Prepared

Change = Callable[[JointLog], JointLog]


def cut(log: JointLog, start: float, stop: float) -> JointLog:
    """The rows between two shares of a log's time, as a log of its own."""
    at = log.time_s[0] + np.array([start, stop]) * (log.time_s[-1] - log.time_s[0])
    return of_rows(log, np.flatnonzero((log.time_s >= at[0]) & (log.time_s < at[1])), f"{start:g}-{stop:g}")


def of_rows(log: JointLog, rows: np.ndarray, name: str) -> JointLog:
    """Some rows as a log of its own."""
    parts = {
        field: None if (values := getattr(log, field)) is None else values[rows]
        for field in ("position_rad", "velocity_rad_s", "effort", "temperature_c", "joint_torque_nm")
    }
    time_s = log.time_s[rows]
    whole = named(log, name)
    if whole.source.start_ns is not None:
        start_ns = whole.source.start_ns + round(1e9 * float(time_s[0]))
        whole = replace(whole, source=replace(whole.source, start_ns=start_ns))
    return replace(whole, time_s=time_s - time_s[0], annotations=(), phases=(), wrench=None, **parts)


def named(log: JointLog, name: str) -> JointLog:
    """The log under another name and hash, so that nothing takes it for the one that it was made of."""
    digest = sha256(f"{name} {log.source.name}".encode()).hexdigest()
    return replace(log, source=replace(log.source, name=f"{name} of {log.source.name}", digest=digest))


def prepared(log: JointLog, settings: LoadedConfig, friction: FrictionFile | None = None) -> Prepared:
    """A log in memory, as ``api.prepare`` prepares a file."""
    known = None if friction is None else Calibration.of(friction, settings.config)
    return prepare(log, api.load_robot(settings, log.joint_names), settings.config, known)


def judged(log: JointLog | Prepared, settings: LoadedConfig, friction: FrictionFile | None) -> Audit:
    """A log in memory, as ``api.audit`` judges a file."""
    ready = log if isinstance(log, Prepared) else prepared(log, settings, friction)
    return audit_log(ready, settings.config, friction, settings.provenance(None, ready.robot.sha256))


def fitted(logs: Sequence[JointLog | Prepared], settings: LoadedConfig) -> FrictionFile:
    """Friction, and what else the settings ask for, of logs in memory."""
    ready = [log if isinstance(log, Prepared) else prepared(log, settings) for log in logs]
    return api.fit(ready, settings)
