"""Annotations and phases: alarms in the fields of joint states, and topics of alarms, notes, and phases of a task."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import Annotation
from collaudit.core.errors import LogError
from collaudit.core.findings import Finding
from collaudit.core.logs.messages.decoded_columns import Decoded
from collaudit.core.logs.signals.annotation_spans import phases_of, spans_of, until_changed
from collaudit.core.logs.signals.sample_clock import Clock
from collaudit.core.logs.signals.stamps import seconds_since
from collaudit.core.logs.topics.log_topics import Topic, described, read_by
from collaudit.core.logs.topics.publishers import Publisher, clocks_of, in_order
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.vendors.message_profiles import ANNOTATION, Profile, Role

#: The field of std_msgs types, taken where none is named.
DEFAULT_FIELD = "data"
_PHASE = f"{ANNOTATION}phase"
_STATED = "configured-"
#: Where each is configured.
_KEYS: dict[Role, str] = {"label": "[log] label_topics", "phase": "[log] phase_topic"}


@dataclass(frozen=True, slots=True, eq=False)
class AlarmField:
    """One alarm, in one kind of message.

    Attributes:
        name: of the alarm.
        joints: joint of each column; empty when the alarm belongs to the whole arm.
        log_ns: (n,) recording times.
        stamp_ns: (n,) header stamps, or None.
        raised: (n, m) True while it is raised.
    """

    name: str
    joints: tuple[str, ...]
    log_ns: IntArray
    stamp_ns: IntArray | None
    raised: BoolArray


def alarm_fields(decoded: Decoded, profile: Profile | None) -> list[AlarmField]:
    """The alarms of a topic that were ever raised; to be asked before its groups are used up."""
    out = []
    for group in decoded.groups.values():
        names = [key for key in group.columns if key.startswith(ANNOTATION)]
        if not names:
            continue
        at = np.argsort(np.asarray(group.look("place")), kind="stable")
        for name in names:
            values = np.asarray(group.take(name), dtype=np.float64)
            if profile is None or not (raised := profile.raised(name.removeprefix(ANNOTATION), values)).any():
                continue
            log_ns = np.asarray(group.look("log_ns"), dtype=np.int64)
            stamps = group.look("stamp_ns")
            stamp_ns = None if stamps is None else np.asarray(stamps, dtype=np.int64)[at]
            joints = group.key.names if raised.shape[1] == len(group.key.names) else ()
            out.append(AlarmField(name.removeprefix(ANNOTATION), joints, log_ns[at], stamp_ns, raised[at]))
    return out


def alarm_annotations(fields: list[AlarmField], clock: Clock, origin_ns: int, topic: str) -> list[Annotation]:
    """The alarms as annotations, one a joint; each stretch ends at the last stamp at which the alarm was raised.

    Args:
        fields: of the topic.
        clock: the clock of its samples.
        origin_ns: time zero of that clock.
        topic: their source.
    """
    found: dict[tuple[str, str | None], list[tuple[float, float]]] = {}
    for field in fields:
        stamps = field.stamp_ns if clock == "header" and field.stamp_ns is not None else field.log_ns
        time_s = seconds_since(stamps, origin_ns)
        columns: list[tuple[str | None, BoolArray]] = [
            (joint, field.raised[:, k]) for k, joint in enumerate(field.joints)
        ]
        for joint, raised in columns or [(None, np.asarray(field.raised.any(axis=1)))]:
            found.setdefault((field.name, joint), []).extend(spans_of(time_s, raised))
    return [Annotation(name, topic, tuple(sorted(spans)), joint) for (name, joint), spans in found.items() if spans]


@dataclass(frozen=True, slots=True)
class AnnotationTopics:
    """The topics that hold annotations, the one that holds the phase, and topics of labels that the log lacks."""

    annotations: tuple[Topic, ...]
    phase: Topic | None
    absent: tuple[str, ...]

    @property
    def topics(self) -> tuple[Topic, ...]:
        """All of them."""
        return self.annotations if self.phase is None else (*self.annotations, self.phase)


def annotation_topics(topics: Sequence[Topic], settings: LogConfig) -> AnnotationTopics:
    """Which topics hold annotations and the phase: those of known types, and those configured.

    Raises:
        LogError: the log does not have the topic configured as the phase, or a topic has not the field.
    """
    chosen = [topic for topic in topics if _is_known(topic)]
    held = {topic.name.strip("/") for topic in topics}
    absent = [entry for entry in settings.label_topics if entry.partition(":")[0].strip("/") not in held]
    for entry in (entry for entry in settings.label_topics if entry not in absent):
        topic = _configured(topics, entry, "label")
        chosen = [known for known in chosen if ":" in entry or known.name != topic.name] + [topic]
    phase = None
    if settings.phase_topic is not None:
        phase = _configured(topics, settings.phase_topic, "phase")
    return AnnotationTopics(tuple(chosen), phase, tuple(absent))


def _is_known(topic: Topic) -> bool:
    return topic.profile is not None and topic.profile.role == "label" and bool(topic.decoders)


def _configured(topics: Sequence[Topic], entry: str, role: Role) -> Topic:
    """A topic read for one field."""
    name, _, path = entry.partition(":")
    found = next((topic for topic in topics if topic.name.strip("/") == name.strip("/")), None)
    if found is None:
        raise LogError(
            f"the log has no topic {name}, which the configuration names as a {role}",
            where=_KEYS[role],
            found=described(topics),
            hint="correct the name, or take it out",
        )
    if role == "label" and not path and _is_known(found):
        return found
    annotation = "phase" if role == "phase" else path or found.name.strip("/").rsplit("/", 1)[-1]
    path = path or DEFAULT_FIELD
    profile = Profile(
        name=f"{_STATED}{role}",
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
        where=_KEYS[role],
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

    joints: Publisher
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
        stamps = self.joints.stamp_ns if self.clock == "header" else None
        return float(seconds_since(stamps if stamps is not None else self.joints.log_ns, self.origin_ns)[-1])


@dataclass(frozen=True, slots=True, eq=False)
class _Series:
    time_s: FloatArray
    columns: dict[str, FloatArray]
    words: tuple[str, ...]
    which: IntArray


def read_annotations(topic: Topic, times: Times) -> list[Annotation]:
    """The annotations of a topic; each holds from the message that raises it to the one that ends it.

    Raises:
        LogError: no message has the field that was configured.
    """
    series = _series(topic, times)
    if topic.profile is None or (series is None and not topic.decoded.seen):
        return []
    stated = topic.profile.name.startswith(_STATED)
    out = []
    for name, path in topic.profile.annotations:
        values = None if series is None else series.columns.get(f"{ANNOTATION}{name}")
        if values is None and stated:
            raise LogError(f"messages on {topic.name} hold no number at {path}", where=_KEYS["label"])
        if series is None or values is None:
            continue
        raised = np.asarray(topic.profile.raised(name, values).any(axis=1))
        spans = until_changed(series.time_s, raised, times.end_s)
        if spans or stated:
            out.append(Annotation(name, topic.name, spans))
    return out


def read_phases(topic: Topic, times: Times) -> tuple[list[Annotation], list[Finding]]:
    """The phases of a topic: one annotation a value, holding until the value changes."""
    series = _series(topic, times)
    if series is None:
        why = topic.decoded.problem or "it holds no messages"
        text = f"The phase topic {topic.name} cannot be read: {why}."
        return [], [Finding("log-label-missing", "warning", text, where=topic.name)]
    numbers = series.columns.get(_PHASE)
    words = np.array(series.words, dtype=object)[series.which]
    if numbers is not None:
        counted = np.isfinite(numbers[:, 0])
        words[counted] = [f"{value:g}" for value in numbers[counted, 0].tolist()]
    return phases_of(series.time_s, words.tolist(), times.end_s, topic.name)


def _series(topic: Topic, times: Times) -> _Series | None:
    """All groups of a topic in one, in time order."""
    groups = list(topic.decoded.groups.values())
    if not groups:
        return None
    rows = [group.rows for group in groups]
    words = tuple(dict.fromkeys(group.key.names[0] if group.key.names else "" for group in groups))
    which = np.repeat([words.index(group.key.names[0] if group.key.names else "") for group in groups], rows)
    names = dict.fromkeys(name for group in groups for name, _ in group.key.present)
    columns = {}
    for name in names:
        width = max(dict(group.key.present).get(name, 0) for group in groups)
        out = np.full((sum(rows), width), np.nan)
        for group, stop in zip(groups, np.cumsum(rows).tolist(), strict=True):
            values = group.take(name)
            if values is not None:
                out[stop - group.rows : stop, : values.shape[1]] = values
        columns[name] = out
    ordered = in_order(*clocks_of(groups), times.joints.log_breaks, times.joints.stamp_breaks)
    time_s = times.seconds(ordered.log_ns, ordered.stamp_ns)
    by_time = np.argsort(time_s, kind="stable")
    sort = by_time if ordered.sort is None else ordered.sort[by_time]
    return _Series(time_s[by_time], {name: values[sort] for name, values in columns.items()}, words, which[sort])
