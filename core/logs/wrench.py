"""The wrist force/torque sensor of a recording of messages."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from collaudit.core.findings import Finding
from collaudit.core.logs.clock import Clock, steadiness
from collaudit.core.logs.publishers import seconds_since
from collaudit.core.logs.topics import Topic
from collaudit.core.series import FloatArray, IntArray, WrenchSeries, frozen

if TYPE_CHECKING:
    from collaudit.core.config.schema import LogConfig


def read_wrench(
    topic: Topic | None, settings: LogConfig, clock: Clock, origin_ns: int
) -> tuple[WrenchSeries | None, list[Finding]]:
    """The wrench as recorded, on the clock of the joint states.

    Args:
        topic: the configured topic, decoded; None when the log does not have it.
        settings: the configuration.
        clock: the clock of the joint states.
        origin_ns: its time zero.

    Returns:
        The series, or None with a finding when a wrench was configured and cannot be had.
    """
    if settings.wrench is None:
        return None, []
    problem = _problem(topic)
    if problem is not None or topic is None:
        text = f"The wrench topic {settings.wrench} was configured, and {problem}."
        return None, [Finding("log-wrench-missing", "warning", text, where=settings.wrench)]
    log_ns, stamp_ns, wrench = _stacked(topic)
    findings = []
    stamps = log_ns
    if clock == "header":
        if stamp_ns is not None and steadiness(stamp_ns).usable:
            stamps = stamp_ns
        else:
            text = "The wrench carries no usable header stamps; its log time was used beside the joints' stamps."
            findings.append(Finding("log-time-source", "warning", text, where=topic.name))
    return WrenchSeries(frozen(seconds_since(stamps, origin_ns)), frozen(wrench), topic.name), findings


def _problem(topic: Topic | None) -> str | None:
    if topic is None:
        return "the log does not have it"
    if topic.profile is None or topic.profile.role != "wrench" or not topic.decoders:
        return topic.problem or f"its type {topic.type} is no wrench"
    if not topic.decoded.groups:
        return "it holds no messages" if not topic.decoded.seen else f"none can be decoded: {topic.decoded.problem}"
    return None


def _stacked(topic: Topic) -> tuple[IntArray, IntArray | None, FloatArray]:
    """Log times, stamps and values of all groups, in order of recording."""
    groups = list(topic.decoded.groups.values())
    stamped = all(group.key.stamped for group in groups)
    logs, stamps, values = [], [], []
    for group in groups:
        logs.append(np.asarray(group.take("log_ns"), dtype=np.int64))
        values.append(np.asarray(group.take("wrench"), dtype=np.float64))
        if stamped:
            stamps.append(np.asarray(group.take("stamp_ns"), dtype=np.int64))
    topic.decoded.groups.clear()
    log_ns, wrench = np.concatenate(logs), np.concatenate(values)
    stamp_ns = np.concatenate(stamps) if stamped else None
    if (np.diff(log_ns) < 0).any():
        order = np.argsort(log_ns, kind="stable")
        log_ns, wrench = log_ns[order], wrench[order]
        stamp_ns = stamp_ns[order] if stamp_ns is not None else None
    return log_ns, stamp_ns, wrench
