"""Annotations and phases: alarms in the fields of joint states, and topics of alarms, notes, and phases of a task."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import Annotation
from collaudit.core.errors import LogError
from collaudit.core.findings import Finding
from collaudit.core.logs.messages.message_decoding import Decoded, Group
from collaudit.core.logs.signals.annotation_spans import phases_of, spans_of, until_changed
from collaudit.core.logs.signals.sample_clock import Clock, seconds_since
from collaudit.core.logs.topics.log_topics import CONFIGURED, Topic, named, read_by, stated_topic
from collaudit.core.logs.topics.topic_series import Series, in_order
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.vendors.message_profiles import ANNOTATION, Profile, Role

#: The field of std_msgs types, taken where none is named.
DEFAULT_FIELD = "data"
_PHASE = f"{ANNOTATION}phase"
#: Where each is configured.
_KEYS: dict[Role, str] = {"label": "labels", "phase": "phase"}


def alarm_series(decoded: Decoded, profile: Profile) -> list[Series]:
    """When the alarms of a topic were raised, those that ever were; to be asked before its groups are used up.

    Returns:
        Of each kind of message (n, m) True while an alarm is raised, in the order of the file; m is the number of
        joints of an alarm that each joint has.
    """
    out = []
    for group in decoded.groups.values():
        names = [name for name in group.columns if name.startswith(ANNOTATION)]
        raised = {name.removeprefix(ANNOTATION): _raised(group, profile, name) for name in names}
        raised = {name: values for name, values in raised.items() if values.any()}
        if raised:
            series = Series(raised, np.asarray(group.look("log_ns")), group.look("stamp_ns"), names=group.key.names)
            out.append(series.at(np.argsort(np.asarray(group.look("place")), kind="stable")))
    return out


def alarm_annotations(alarms: Sequence[Series], clock: Clock, origin_ns: int, topic: str) -> list[Annotation]:
    """The alarms as annotations, one a joint; each stretch ends at the last stamp at which the alarm was raised.

    Args:
        alarms: as of :func:`alarm_series`.
        clock: the clock of its samples.
        origin_ns: time zero of that clock.
        topic: their source.
    """
    found: dict[tuple[str, str | None], list[tuple[float, float]]] = {}
    for series in alarms:
        time_s = seconds_since(series.stamps(clock), origin_ns)
        for name, raised in series.columns.items():
            columns: list[tuple[str | None, BoolArray]] = [(None, np.asarray(raised.any(axis=1)))]
            if series.names and raised.shape[1] == len(series.names):
                columns = list(zip(series.names, raised.T, strict=True))
            for joint, column in columns:
                found.setdefault((name, joint), []).extend(spans_of(time_s, column))
    return [Annotation(name, topic, tuple(sorted(spans)), joint) for (name, joint), spans in found.items() if spans]


def annotation_topics(topics: Sequence[Topic], settings: LogConfig) -> tuple[list[Topic], list[str]]:
    """Which topics hold annotations and the phase: those of known types, and those configured.

    Returns:
        The topics, that of the phase last, and entries of labels that the log lacks.

    Raises:
        LogError: the log does not have the topic configured as the phase, or a topic has not the field.
    """
    chosen = [topic for topic in topics if _is_known(topic)]
    absent = [entry for entry in settings.labels if named(topics, entry.partition(":")[0]) is None]
    for entry in (entry for entry in settings.labels if entry not in absent):
        topic = _configured(topics, entry, "label")
        chosen = [known for known in chosen if ":" in entry or known.name != topic.name] + [topic]
    if settings.phase is not None:
        chosen.append(_configured(topics, settings.phase, "phase"))
    return chosen, absent


def _is_known(topic: Topic) -> bool:
    return topic.profile.role == "label" and bool(topic.decoders)


def _configured(topics: Sequence[Topic], entry: str, role: Role) -> Topic:
    """A topic read for one field."""
    name, _, path = entry.partition(":")
    found = stated_topic(topics, name, _KEYS[role])
    if role == "label" and not path and _is_known(found):
        return found
    annotation = "phase" if role == "phase" else path or found.name.strip("/").rsplit("/", 1)[-1]
    path = path or DEFAULT_FIELD
    profile = Profile(
        name=CONFIGURED,
        role=role,
        types=tuple(dict.fromkeys(channel.type for channel in found.channels)),
        names=path if role == "phase" else None,
        annotations=((annotation, path),),
    )
    topic = read_by(found.name, found.channels, profile, found.extra, found.decoded.bounds)
    if topic.decoders:
        return topic
    raise LogError(
        f"the topic {name} cannot be read as a {role}: {topic.problem}",
        where=f"[log] {_KEYS[role]}",
        hint=f"name its field: {name}:FIELD",
    )


@dataclass(frozen=True, slots=True, eq=False)
class Times:
    """From the clocks of a topic to seconds of the joint states.

    Attributes:
        joints: the joint states.
        clock: their clock.
        origin_ns: its time zero.
    """

    joints: Series
    clock: Clock
    origin_ns: int

    def seconds(self, log_ns: IntArray, stamp_ns: IntArray | None) -> FloatArray:
        """(n,) seconds; a time of recording is told by what the joints' header said at that time."""
        if self.clock == "log" or self.joints.stamp_ns is None:
            return seconds_since(log_ns, self.origin_ns)
        if stamp_ns is not None and bool((stamp_ns != 0).all()):
            return seconds_since(stamp_ns, self.origin_ns)
        first = int(self.joints.log_ns[0])
        recorded = seconds_since(self.joints.log_ns, first)
        stamped = seconds_since(self.joints.stamp_ns, self.origin_ns)
        asked = seconds_since(log_ns, first)
        near = np.clip(np.searchsorted(recorded, asked), 0, recorded.shape[0] - 1)
        return np.asarray(stamped[near] + (asked - recorded[near]))

    @property
    def end_s(self) -> float:
        """The last sample of the joint states."""
        return float(seconds_since(self.joints.stamps(self.clock), self.origin_ns)[-1])


def read_annotations(topic: Topic, times: Times) -> list[Annotation]:
    """The annotations of a topic; each holds from the message that raises it to the one that ends it.

    Raises:
        LogError: no message has the field that was configured.
    """
    profile, groups = topic.profile, list(topic.decoded.groups.values())
    if not topic.decoded.seen:
        return []
    stated = profile.name == CONFIGURED
    columns = {}
    for name, path in profile.annotations:
        if any(f"{ANNOTATION}{name}" in group.columns for group in groups):
            parts = [_raised(group, profile, f"{ANNOTATION}{name}").any(axis=1) for group in groups]
            columns[name] = np.concatenate(parts)
        elif stated:
            raise LogError(f"messages on {topic.name} hold no number at {path}", where="[log] labels")
    if not columns:
        return []
    time_s, series = _by_time(in_order(groups, columns, joints=times.joints), times)
    spans = {name: until_changed(time_s, raised, times.end_s) for name, raised in series.columns.items()}
    return [Annotation(name, topic.name, found) for name, found in spans.items() if found or stated]


def _raised(group: Group, profile: Profile, name: str) -> BoolArray:
    """(n, m) where messages say that it holds; nowhere in those that say nothing of it."""
    values = group.take(name)
    if values is None:
        return np.zeros((group.rows, 1), dtype=np.bool_)
    return profile.raised(name.removeprefix(ANNOTATION), np.asarray(values, dtype=np.float64))


def read_phases(topic: Topic, times: Times) -> tuple[list[Annotation], list[Finding]]:
    """The phases of a topic: one annotation a value, holding until the value changes."""
    groups = list(topic.decoded.groups.values())
    if not groups:
        why = topic.decoded.problem or "it holds no messages"
        text = f"The phase topic {topic.name} cannot be read: {why}."
        return [], [Finding("log-label-missing", "warning", text, where=topic.name)]
    words = np.array([word for group in groups for word in _words(group)], dtype=object)
    time_s, series = _by_time(in_order(groups, {_PHASE: words}, joints=times.joints), times)
    return phases_of(time_s, series.columns[_PHASE].tolist(), times.end_s, topic.name)


def _words(group: Group) -> list[str]:
    """The phase that each message names, by a text or by a number; "" where the number is none."""
    values = group.take(_PHASE)
    if values is None:
        return [group.key.names[0] if group.key.names else ""] * group.rows
    return [f"{value:g}" if np.isfinite(value) else "" for value in values[:, 0].tolist()]


def _by_time(series: Series, times: Times) -> tuple[FloatArray, Series]:
    """Samples in the order of the joint states' seconds, which come first."""
    time_s = times.seconds(series.log_ns, series.stamp_ns)
    order = np.argsort(time_s, kind="stable")
    return time_s[order], series.at(order)
