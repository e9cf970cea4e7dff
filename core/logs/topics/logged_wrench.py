"""The wrist force/torque sensor of a recording of messages."""

from __future__ import annotations

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import WrenchSeries
from collaudit.core.errors import LogError
from collaudit.core.findings import Finding
from collaudit.core.logs.signals.impossible_values import garbage_finding
from collaudit.core.logs.signals.sample_clock import Clock, header_steadiness
from collaudit.core.logs.signals.stamps import seconds_since
from collaudit.core.logs.topics.log_topics import Topic
from collaudit.core.logs.topics.topic_series import Series, in_order, taken
from collaudit.core.numeric.arrays import frozen


def read_wrench(
    topic: Topic | None, settings: LogConfig, clock: Clock, origin_ns: int, joints: Series
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
        return None, [Finding("log-wrench", "warning", text, where=settings.wrench)]
    groups = list(topic.decoded.groups.values())
    series = in_order(groups, {"wrench": np.asarray(taken(groups, "wrench"))}, joints=joints)
    findings = [] if series.garbage is None else [garbage_finding(*series.garbage, "message", topic.name)]
    if not series.followed:
        text = "The clock was set back in the joint states and not alike in the wrench, which was left out."
        return None, [Finding("log-wrench", "warning", text, where=topic.name)]
    if clock == "header" and not header_steadiness(series.stamp_ns, series.log_ns).usable:
        clock = "log"
        text = "The wrench carries no usable header stamps; its log time was used beside the joints' stamps."
        findings.append(Finding("log-clock", "warning", text, where=topic.name))
    time_s, wrench = seconds_since(series.stamps(clock), origin_ns), series.columns["wrench"]
    return WrenchSeries(frozen(time_s), frozen(wrench), topic.name), findings


def _problem(topic: Topic) -> str | None:
    if topic.profile.role != "wrench" or not topic.decoders:
        return topic.problem or f"its type {topic.type} is no wrench"
    if not topic.decoded.groups:
        return "it holds no messages" if not topic.decoded.seen else f"none can be decoded: {topic.decoded.problem}"
    return None
