"""The wrist force/torque sensor of a recording of messages."""

from __future__ import annotations

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import WrenchSeries
from collaudit.core.errors import LogError
from collaudit.core.findings import Finding
from collaudit.core.logs.signals.impossible_values import garbage_finding
from collaudit.core.logs.signals.sample_clock import Clock, steadiness
from collaudit.core.logs.signals.stamps import seconds_since
from collaudit.core.logs.topics.log_topics import Topic
from collaudit.core.logs.topics.publishers import Ordered, Publisher, clocks_of, in_order
from collaudit.core.numeric.arrays import FloatArray, frozen


def read_wrench(
    topic: Topic | None, settings: LogConfig, clock: Clock, origin_ns: int, joints: Publisher
) -> tuple[WrenchSeries | None, list[Finding]]:
    """The wrench as recorded, on the clock of the joint states.

    Args:
        topic: the configured topic, decoded; None when the log does not have it.
        settings: the configuration.
        clock: the clock of the joint states.
        origin_ns: its time zero.
        joints: the joint states; where their clocks were set back, the wrench's were too.

    Returns:
        The series, or None with a finding when the wrench that was configured holds no usable messages.

    Raises:
        LogError: the log does not have the topic that was configured.
    """
    if settings.wrench is None:
        return None, []
    if topic is None:
        raise LogError(
            f"the log has no topic {settings.wrench}, which the configuration names as the wrench",
            where="[log] wrench",
            hint="collaudit inspect LOG lists the topics; take the line out to judge without a wrench",
        )
    problem = _problem(topic)
    if problem is not None:
        text = f"The wrench topic {settings.wrench} was configured, and {problem}."
        return None, [Finding("log-wrench-missing", "warning", text, where=settings.wrench)]
    ordered, wrench = _stacked(topic, joints)
    log_ns, stamp_ns = ordered.log_ns, ordered.stamp_ns
    findings = [] if ordered.garbage is None else [garbage_finding(*ordered.garbage, "message", topic.name)]
    if not ordered.followed:
        text = "The clock was set back in the joint states and not alike in the wrench, which was left out."
        return None, [Finding("log-wrench-missing", "warning", text, where=topic.name)]
    stamps = log_ns
    if clock == "header":
        if stamp_ns is not None and steadiness(stamp_ns).usable:
            stamps = stamp_ns
        else:
            text = "The wrench carries no usable header stamps; its log time was used beside the joints' stamps."
            findings.append(Finding("clock-drift", "warning", text, where=topic.name))
    return WrenchSeries(frozen(seconds_since(stamps, origin_ns)), frozen(wrench), topic.name), findings


def _problem(topic: Topic) -> str | None:
    if topic.profile is None or topic.profile.role != "wrench" or not topic.decoders:
        return topic.problem or f"its type {topic.type} is no wrench"
    if not topic.decoded.groups:
        return "it holds no messages" if not topic.decoded.seen else f"none can be decoded: {topic.decoded.problem}"
    return None


def _stacked(topic: Topic, joints: Publisher) -> tuple[Ordered, FloatArray]:
    """The clocks of all groups in order of recording, and the values."""
    groups = list(topic.decoded.groups.values())
    parts = [np.asarray(group.take("wrench"), dtype=np.float64) for group in groups]
    wrench = parts[0] if len(parts) == 1 else np.concatenate(parts)
    ordered = in_order(*clocks_of(groups), joints.log_breaks, joints.stamp_breaks)
    topic.decoded.groups.clear()
    return ordered, wrench if ordered.sort is None else wrench[ordered.sort]
