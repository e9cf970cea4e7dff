"""One small log in memory, spoilt in one way, and judged as `audit` judges: what becomes of its push."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from collaudit.core.audit import audit_log
from collaudit.core.config import parse_config
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.data.joint_log import JointLog, LogSource
from collaudit.core.errors import CollauditError
from collaudit.core.logs.signals.joint_values import without_impossible
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.preparation import prepare
from collaudit.core.robot.robot_building import build_robot

RATE_HZ = 250.0
#: The push, s from the log's first sample, and its size, N·m, on joint 1.
PUSH_S, PUSH_NM = (9.0, 9.3), 12.0
JOINTS = ("joint1", "joint2")


@dataclass
class Signals:
    """What a fault changes: stamps, the three quantities (n, 2), settings, the friction file."""

    t: np.ndarray
    q: np.ndarray
    dq: np.ndarray | None
    tau: np.ndarray | None
    settings: dict[str, object] = field(default_factory=dict)
    friction: Callable[[FrictionFile], FrictionFile] | None = None
    unit: str = "Nm"

    def rows(self, start: float, stop: float) -> slice:
        """Rows of a time."""
        return slice(round(start * RATE_HZ), round(stop * RATE_HZ))


Fault = Callable[[Signals], None]


def clean_signals(config_text: str, push_nm: float = PUSH_NM) -> Signals:
    """Both joints swing for 16 s at up to 0.6 rad/s; the push acts while joint 1 is fast."""
    config = parse_config(config_text, None).config
    model = build_robot(config.robot, Path(), JOINTS)
    t = np.arange(0, 16, 1 / RATE_HZ)
    phase = 2 * np.pi * np.outer(t, [0.2, 0.23]) + [0.3, 1.1]
    size = np.array([0.45, 0.4])
    rate = 2 * np.pi * np.array([0.2, 0.23])
    q, dq, ddq = size * np.sin(phase), size * rate * np.cos(phase), -size * rate**2 * np.sin(phase)
    friction = np.sign(dq) * (1.0 + 0.8 * np.exp(-np.abs(dq) / 0.08)) + 1.5 * dq
    tau = model.inverse_dynamics(q, dq, ddq) + friction
    tau += np.random.default_rng(3).normal(0, 0.05, tau.shape)
    found = Signals(t, q, dq, tau)
    tau[found.rows(*PUSH_S), 0] += push_nm
    return found


@dataclass(frozen=True)
class Judged:
    """Outcome of a case: ``found``, ``not judged``, ``refused``, ``stated`` or ``silent``; and why."""

    outcome: str
    why: str


def judge(config_text: str, friction: FrictionFile, spoilt: Signals, known: frozenset[str]) -> Judged:
    """Audit spoilt signals.

    Args:
        config_text: settings of the arm.
        friction: fitted on a whole log.
        spoilt: the signals.
        known: what is said of the unspoilt log too, and so states nothing.
    """
    try:
        loaded = parse_config(config_text, None, spoilt.settings)
        log = JointLog(
            spoilt.t, JOINTS, spoilt.q, spoilt.dq, spoilt.tau, spoilt.unit, None,  # type: ignore[arg-type]
            LogSource("case.csv", "0" * 64, "csv", None, "column", "case.csv"),
        )  # fmt: skip
        robot = build_robot(loaded.config.robot, Path(), JOINTS)
        used = spoilt.friction(friction) if spoilt.friction is not None else friction
        prepared = prepare(without_impossible(log, "row"), robot, loaded.config, Calibration.of(used, loaded.config))
        audit = audit_log(prepared, loaded.config, used, loaded.provenance(None, robot.sha256), siblings=None)
    except CollauditError as error:
        return Judged("refused", error.message)
    return outcome_of(audit.result, known)


def outcome_of(result: AuditResult, known: frozenset[str]) -> Judged:
    """What an audit said of the push."""
    if result.contacts:
        return Judged("found", "")
    if result.verdict != "pass":
        return Judged("not judged", result.reasons[0])
    said = [text for text in result.exclusions if text not in known]
    said += [f.text for f in result.findings if f.severity != "info" and f.text not in known]
    if result.log.duration_s < PUSH_S[0] and result.reasons:  # what a pass says of its time ends before the push
        said += [reason for reason in result.reasons if f" in {result.log.duration_s:.3g} s" in reason]
    return Judged("stated", said[0]) if said else Judged("silent", "")


def statements(config_text: str, friction: FrictionFile, whole: Signals) -> frozenset[str]:
    """What is said of a log without fault."""
    loaded = parse_config(config_text, None)
    log = JointLog(
        whole.t, JOINTS, whole.q, whole.dq, whole.tau, "Nm", None,
        LogSource("case.csv", "0" * 64, "csv", None, "column", "case.csv"),
    )  # fmt: skip
    robot = build_robot(loaded.config.robot, Path(), JOINTS)
    prepared = prepare(log, robot, loaded.config, Calibration.of(friction, loaded.config))
    result = audit_log(prepared, loaded.config, friction, loaded.provenance(None, robot.sha256), siblings=None).result
    return frozenset([*result.exclusions, *(finding.text for finding in result.findings)])


def spoil(whole: Signals, fault: Fault) -> Signals:
    """A copy of the signals, spoilt."""
    out = replace(whole, t=whole.t.copy(), q=whole.q.copy(), dq=_copy(whole.dq), tau=_copy(whole.tau), settings={})
    fault(out)
    return out


def _copy(values: Any) -> Any:
    return None if values is None else values.copy()
