"""Recordings of messages (MCAP, ROS bags) to a :class:`JointLog`."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import Annotation, Digest, JointLog, LogSource, WrenchSeries
from collaudit.core.errors import LogError
from collaudit.core.findings import Finding, fact
from collaudit.core.logs.messages.message_decoding import all_names
from collaudit.core.logs.signals.annotation_spans import absent_labels, annotation_findings
from collaudit.core.logs.signals.joint_naming import NameMap, listed, map_names
from collaudit.core.logs.signals.joint_values import angle_factor, check_joint_keys, to_si, with_currents
from collaudit.core.logs.signals.sample_clock import (
    Clock,
    choose_clock,
    compare_clocks,
    garbage_findings,
    header_steadiness,
    interpolate,
    seconds_since,
    start_of,
    steadiness,
)
from collaudit.core.logs.signals.stamp_conflicts import as_recorded, contradictions, set_back_findings
from collaudit.core.logs.storage.bounded_reading import ReadingBounds
from collaudit.core.logs.storage.readers import MessageReader, damage_findings
from collaudit.core.logs.topics.annotation_topics import (
    Times,
    alarm_annotations,
    alarm_series,
    annotation_topics,
    read_annotations,
    read_phases,
)
from collaudit.core.logs.topics.joined_series import (
    alternation,
    check_clocks,
    disagreement,
    spaced_evenly,
    with_efforts,
)
from collaudit.core.logs.topics.joint_states_topic import choose_efforts, choose_joint_states, companions
from collaudit.core.logs.topics.log_topics import Topic, decode, skipped_findings, stated_topic, topics_of
from collaudit.core.logs.topics.topic_series import Series, in_order, publishers_of, taken
from collaudit.core.numeric.arrays import FloatArray, frozen
from collaudit.core.numeric.parallel import Progress


def read_wrench(
    topic: Topic | None, clock: Clock, origin_ns: int, joints: Series
) -> tuple[WrenchSeries | None, list[Finding]]:
    """The wrench as recorded, on the clock of the joint states.

    Args:
        topic: the configured topic, decoded; None where none is configured.
        clock: the clock of the joint states.
        origin_ns: its time zero.
        joints: the joint states; where their clocks were set back, the wrench's were too.

    Returns:
        The series, or None with a finding when the wrench that was configured holds no usable messages.
    """
    if topic is None:
        return None, []
    problem = _problem(topic)
    if problem is not None:
        text = f"The wrench topic {topic.name} was configured, and {problem}."
        return None, [Finding("log-wrench", "warning", text, where=topic.name)]
    groups = list(topic.decoded.groups.values())
    series = in_order(groups, {"wrench": np.asarray(taken(groups, "wrench"))}, joints=joints)
    findings = garbage_findings(series.garbage, "message", topic.name)
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


def read_message_log(
    reader: MessageReader,
    name: str,
    settings: LogConfig,
    robot_joints: Sequence[str] | None,
    prismatic: Sequence[str],
    judged: Sequence[str],
    digest: Digest,
    progress: Progress | None,
    bounds: ReadingBounds,
) -> JointLog:
    """Read one log of messages.

    Args:
        reader: of its files; closed as soon as the messages are decoded.
        name: of the log, for messages and its source.
        settings, robot_joints, prismatic, judged, progress: as of :func:`collaudit.core.logs.log_reading.read_log`.
        digest: hash of the log.
        bounds: how much may be read.

    Raises:
        LogError, ConfigError: as of :func:`collaudit.core.logs.log_reading.read_log`.
    """
    with closing(reader):
        topics = topics_of(reader, settings, bounds)
        joints = choose_joint_states(reader, topics, settings, robot_joints, name)
        efforts = choose_efforts(reader, topics, joints, settings, name)
        wrench = None if settings.wrench is None else stated_topic(topics, settings.wrench, "wrench")
        wanted = [joints, *companions(topics, joints), *([efforts] if efforts else [])]
        wanted += [wrench] if wrench is not None and wrench not in wanted else []
        annotated, absent = annotation_topics(topics, settings)
        decode(reader, [*wanted, *annotated], progress)
        findings = [
            *damage_findings(reader.damage, name),
            *skipped_findings(joints),
            *(skipped_findings(efforts) if efforts else ()),
            *(skipped_findings(wrench) if wrench else ()),
        ]
    where = f"{name}, {joints.name}"
    if not joints.decoded.groups:
        raise _empty(joints, reader, where)
    logged = all_names([joints.decoded])
    names = map_names(
        logged,
        settings.joint_names,
        robot_joints,
        where,
        prismatic,
        numbered=bool(joints.profile.fixed_names) and not set(logged) & set(robot_joints or ()),
        judged=judged,
    )
    check_joint_keys(settings.units, [*all_names([joints.decoded]), *names.model, *(robot_joints or ())])
    currents = (efforts or joints).decoded.currents or settings.effort_kind == "motor-current"
    alarms = alarm_series(joints.decoded, joints.profile)
    publishers = publishers_of(joints.decoded, frozenset(names.log))
    merged = _merged(publishers, joints.name)
    if efforts is not None:
        publishers = with_efforts(publishers, efforts, frozenset(names.log), name)
    if settings.rate_hz is not None:
        publishers = [spaced_evenly(publisher, settings.rate_hz, where) for publisher in publishers]
    base = publishers[0]
    findings += [said for p in publishers for said in garbage_findings(p.garbage, "message", joints.name)]
    clock, clock_finding = _clock_of(publishers, settings, where, joints.name)
    stamps = base.stamps(clock)
    origin = int(stamps[0])
    as_stamped = None if base.stamp_ns is None else as_recorded(base.stamp_ns, base.stamp_breaks)
    if settings.rate_hz is None:
        findings += compare_clocks(as_stamped, as_recorded(base.log_ns, base.log_breaks), joints.name)
    findings += set_back_findings(base.stamp_breaks if clock == "header" else base.log_breaks, origin, joints.name)
    times = Times(base, clock, origin)
    annotations, phases, unreadable = _annotations(annotated, times)
    annotations = [*alarm_annotations(alarms, clock, origin, joints.name), *annotations]
    findings += [*unreadable, *absent_labels(absent, "[log] labels", name)]
    findings += annotation_findings(annotations)
    scale = angle_factor(settings.units.position)
    conflicts = [found for p in publishers for found in disagreement(p, p.stamps(clock), scale, joints.name)]
    columns = _columns(publishers, names, clock, origin)
    findings += [clock_finding, *names.findings, *merged]
    series, wrench_findings = read_wrench(wrench, clock, origin, base)
    findings += wrench_findings
    units = settings.units
    if currents and "effort" in columns:
        units = with_currents(units, where)
    unit = to_si(columns, names, units, prismatic, where)
    if "position" not in columns:
        hint = "record positions and efforts on one topic, or choose the topic with [log] joint_states"
        raise LogError("the joint states hold no positions", where=where, hint=hint)
    if clock != "header" and base.stamp_ns is not None:  # where two publishers stamp alike, theirs is not the clock
        origin_ns = int(base.stamp_ns[0])
        position, effort = columns["position"], columns.get("effort")
        conflicts += contradictions(seconds_since(base.stamp_ns, origin_ns), names.model, position, effort)
    findings += conflicts or alternation(columns, names.model, joints.name)
    if "effort" not in columns:
        text = "The joint states hold no efforts. If another topic has them, state it: [log] efforts."
        findings.append(Finding("log-effort-missing", "warning", text, where=joints.name))
    return JointLog(
        time_s=frozen(seconds_since(stamps, origin)),
        joint_names=names.model,
        position_rad=frozen(columns["position"]),
        velocity_rad_s=frozen(columns["velocity"]) if "velocity" in columns else None,
        effort=frozen(columns["effort"]) if "effort" in columns else None,
        effort_unit=unit,
        wrench=series,
        source=LogSource(
            name, digest, reader.format, start_of(origin), "rate" if settings.rate_hz else clock, joints.name
        ),
        findings=tuple(findings),
        annotations=tuple(annotations),
        phases=tuple(phases),
        temperature_c=frozen(columns["temperature"]) if "temperature" in columns else None,
        joint_torque_nm=frozen(columns["joint_torque"]) if "joint_torque" in columns else None,
    )


def _clock_of(publishers: Sequence[Series], settings: LogConfig, where: str, topic: str) -> tuple[Clock, Finding]:
    """The clock that all publishers have, and why; those of a stated rate are stamped by it."""
    if settings.rate_hz is not None:
        return "header", fact(f"Messages are spaced evenly, {settings.rate_hz:g} a second, as stated.", where=topic)
    base = publishers[0]
    headers = [header_steadiness(publisher.stamp_ns, publisher.log_ns) for publisher in publishers]
    check_clocks(base, where)
    alone = headers[0].usable and not all(header.usable for header in headers)  # the others have log time only
    return choose_clock(None if alone else base.stamp_ns, base.log_ns, settings.time, topic)


def _annotations(topics: Sequence[Topic], times: Times) -> tuple[list[Annotation], list[Annotation], list[Finding]]:
    """Annotations and phases of topics of their own, and what could not be read."""
    labels = [topic for topic in topics if topic.profile.role == "label"]
    annotations = [one for topic in labels for one in read_annotations(topic, times)]
    findings = [found for topic in topics for found in skipped_findings(topic)]
    phases: list[Annotation] = []
    for topic in (topic for topic in topics if topic.profile.role == "phase"):
        phases, unreadable = read_phases(topic, times)
        findings += unreadable
    return annotations, phases, findings


def _empty(topic: Topic, reader: MessageReader, where: str) -> LogError:
    if topic.decoded.seen == 0:
        damage = "; ".join(item.text for item in reader.damage)
        return LogError("the topic holds no messages", where=where, found=damage or "none recorded")
    return LogError(
        "none of its messages can be decoded",
        where=where,
        found=f"{topic.decoded.seen} messages; the first is refused because {topic.decoded.problem}",
    )


def _columns(publishers: Sequence[Series], names: NameMap, clock: Clock, origin: int) -> dict[str, FloatArray]:
    """Quantity to (n, j) in the robot's order; other publishers are brought to the stamps of the first."""
    base = publishers[0]
    if len(publishers) == 1 and base.names == names.log:
        return base.columns
    at_s = seconds_since(base.stamps(clock), origin)
    out: dict[str, FloatArray] = {}
    for publisher in publishers:
        time_s = seconds_since(publisher.stamps(clock), origin)
        places = [(index, publisher.names.index(log)) for index, log in enumerate(names.log) if log in publisher.names]
        for quantity in list(publisher.columns):
            own = publisher.columns.pop(quantity)
            if publisher is not base:
                own = interpolate(at_s, time_s, own)
            if quantity not in out:
                out[quantity] = np.full((at_s.shape[0], len(names.log)), np.nan, order="F")
            for index, place in places:
                out[quantity][:, index] = own[:, place]
    return out


def _merged(publishers: Sequence[Series], topic: str) -> list[Finding]:
    if len(publishers) < 2:
        return []
    parts = "; ".join(
        f"{listed(p.names)} ({p.log_ns.shape[0]} messages, every {steadiness(p.log_ns).period_s * 1e3:.3g} ms)"
        for p in publishers
    )
    text = f"{len(publishers)} publishers with different joints were merged by name onto the first's stamps: {parts}."
    return [fact(text, where=topic)]
