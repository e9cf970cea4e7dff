"""Which topic holds the joint states, and the topics that complete it; what nobody measured is refused.

One ranking says which of several topics is meant, for every command and every hint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import ConfigError, LogError
from collaudit.core.logs.messages.message_decoding import Decoded, all_names
from collaudit.core.logs.signals.joint_naming import listed, matches
from collaudit.core.logs.signals.signal_names import (
    NO_CONTACT,
    is_usable,
    refusal_hint,
    role_of_path,
    strongest,
)
from collaudit.core.logs.storage.readers import MessageReader
from collaudit.core.logs.topics.log_topics import (
    CONFIGURED,
    Fields,
    Topic,
    decode,
    described,
    fields_line,
    fields_of_first,
    named,
    stated_topic,
)
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import bend_of, noise_of
from collaudit.core.vendors.vendor_words import USABLE, SignalRole

#: Messages that noise is told from.
_ROWS = 20_000


@dataclass(frozen=True, slots=True)
class TopicFacts:
    """What ranks a topic of joint states.

    Attributes:
        name: of the topic.
        known: how many of the robot's joints it has; 0 where no robot is known.
        role: what its efforts are, as of :func:`role_of`.
        position: whether it has positions.
        effort: whether it has efforts.
        noise: whether they have a sensor's noise; a model's are smooth.
        joints: how many joints it has.
        count: messages.
    """

    name: str
    known: int
    role: SignalRole
    position: bool
    effort: bool
    noise: bool
    joints: int
    count: int

    @property
    def decisive(self) -> tuple[int, bool, bool, bool, bool, int]:
        """Smaller comes first: most of the robot's joints, measured, with positions, with efforts, with noise in them.

        Between topics that are equal in this a person decides.
        """
        usable = is_usable(self.role)
        return (
            -self.known,
            not usable,
            not self.position,
            not self.effort,
            not self.noise,
            USABLE.index(self.role) if usable else 0,
        )


def role_of(topic: Topic, settings: LogConfig) -> SignalRole:
    """What the efforts of a topic are: by its name and the stated path of their field, unless all of it is stated."""
    if settings.effort_kind != "auto" and named([topic], settings.efforts or settings.joint_states) is not None:
        return "measured"
    field = topic.profile.effort if topic.profile.name == CONFIGURED else None
    return strongest({role_of_path(topic.name), role_of_path(field or "")})


def holds(parts: Sequence[Decoded], quantity: str) -> bool:
    """Whether any message has a number of a quantity."""
    return any(group.holds(quantity) for decoded in parts for group in decoded.groups.values())


def has_noise(parts: Sequence[Decoded]) -> bool:
    """Whether any joint's effort has a sensor's noise."""
    efforts = (group.look("effort") for decoded in parts for group in decoded.groups.values())
    return any(_noisy(np.ascontiguousarray(x)) for values in efforts if values is not None for x in values[:_ROWS].T)


def _noisy(x: FloatArray) -> bool:
    return bool(np.isfinite(x).any()) and noise_of(x, bend_of(x), np.ones(x.size, dtype=np.bool_)).measured


def in_order(topics: Sequence[TopicFacts]) -> list[TopicFacts]:
    """Topics from the likeliest on; of those that nothing decides between, the one with most joints, then messages."""
    return sorted(topics, key=lambda topic: (topic.decisive, -topic.joints, -topic.count, topic.name))


def foremost(topics: Sequence[TopicFacts]) -> list[TopicFacts]:
    """The topics that nothing decides between, of those that come first, in order."""
    ordered = in_order(topics)
    return [topic for topic in ordered if topic.decisive == ordered[0].decisive]


#: Topics of an own type that a refusal offers.
_OFFERED = 3
#: Messages looked at to learn a topic's joint names before one is chosen.
PEEK = 2000


def peek(reader: MessageReader, topics: Sequence[Topic]) -> dict[str, Decoded]:
    """What the first messages of each topic hold; the topics are left without data."""
    decode(reader, topics, limit=PEEK)
    held = {topic.name: topic.decoded for topic in topics}
    for topic in topics:
        topic.decode_into(Decoded(bounds=topic.decoded.bounds))
    return held


def choose_joint_states(
    reader: MessageReader, topics: Sequence[Topic], settings: LogConfig, robot: Sequence[str] | None, where: str
) -> Topic:
    """The topic of the joint states.

    Args:
        reader: the log, to look at the first messages when several topics could be meant.
        topics: all topics.
        settings: the topic that is stated, names, and what the efforts are.
        robot: the robot's joints, or None.
        where: the log, for messages.

    Raises:
        LogError: there is no readable topic of joint states, or not the one configured, or none that is measured.
        ConfigError: several could be meant.
    """
    if settings.joint_states is not None:
        chosen = _configured(reader, topics, settings.joint_states, "joint_states", where)
    else:
        chosen = _foremost(reader, topics, settings, robot, where)
    if settings.efforts is None:
        _check_measured(chosen, "joint_states", settings, where)
    return chosen


def choose_efforts(
    reader: MessageReader, topics: Sequence[Topic], joints: Topic, settings: LogConfig, where: str
) -> Topic | None:
    """The topic that the configuration states for the efforts; None where they are on that of the joint states.

    Raises:
        LogError: it is not there, cannot be read, or is measured by nobody.
    """
    if settings.efforts is None or named([joints], settings.efforts) is not None:
        return None
    chosen = _configured(reader, topics, settings.efforts, "efforts", where)
    _check_measured(chosen, "efforts", settings, where)
    return chosen


def _check_measured(topic: Topic, key: str, settings: LogConfig, where: str) -> None:
    role = role_of(topic, settings)
    if not is_usable(role):
        raise LogError(
            f"no joint states are measured by their names: these are {role}",
            where=where,
            found=f"{topic.name} ({topic.type})",
            expected=NO_CONTACT,
            hint=refusal_hint(f'[log] {key} = "{topic.name}"'),
        )


def _foremost(
    reader: MessageReader, topics: Sequence[Topic], settings: LogConfig, robot: Sequence[str] | None, where: str
) -> Topic:
    """The topic that the ranking puts first."""
    candidates = [topic for topic in topics if _readable(topic) and topic.profile.position is not None]
    if not candidates:
        raise _none(reader, topics, where)
    if len(candidates) == 1:
        return candidates[0]
    held = peek(reader, [topic for topic in topics if _readable(topic)])
    names = {topic.name: all_names([held[topic.name]]) for topic in candidates}
    known = {topic.name: matches(names[topic.name], settings.joint_names, robot or ()) for topic in candidates}
    if robot is not None and not any(known.values()):
        unnamed = [topic for topic in candidates if topic.profile.fixed_names]
        if len(unnamed) == 1:
            return unnamed[0]
        raise LogError(
            "none of the log's topics has joints of the robot",
            where=where,
            found="; ".join(f"{name}: {listed(joints)}" for name, joints in names.items()),
            expected=listed(robot),
            hint="map the names under [log] joint_names",
        )
    parts = {one.name: [held[x.name] for x in (one, *_siblings(topics, one)) if x.name in held] for one in candidates}
    facts = [
        TopicFacts(
            topic.name,
            known[topic.name],
            role_of(topic, settings),
            holds(parts[topic.name], "position"),
            holds(parts[topic.name], "effort"),
            has_noise(parts[topic.name]),
            len(names[topic.name]),
            held[topic.name].seen,
        )
        for topic in candidates
    ]
    chosen = foremost(facts)
    if len(chosen) > 1:
        types = {topic.name: topic.type for topic in candidates}
        raise ConfigError(
            "several topics could be the joint states",
            where=where,
            found="; ".join(f"{one.name} ({types[one.name]}): {listed(names[one.name])}" for one in chosen),
            hint=f'choose one: [log] joint_states = "{chosen[0].name}"',
        )
    if not chosen[0].effort and settings.efforts is None:
        _refuse_apart(chosen[0], in_order(facts), where)
    return next(topic for topic in candidates if topic.name == chosen[0].name)


def _refuse_apart(chosen: TopicFacts, others: Sequence[TopicFacts], where: str) -> None:
    """Refuse joint states without efforts where another topic has measured efforts of the same joints."""
    apart = next((one for one in others if one.effort and one.known == chosen.known and is_usable(one.role)), None)
    if apart is not None:
        raise LogError(
            f"the joint states on {chosen.name} hold no efforts, and {apart.name} holds some",
            where=where,
            hint=f'if these are the efforts of the same arm: [log] efforts = "{apart.name}"',
        )


def companions(topics: Sequence[Topic], chosen: Topic) -> list[Topic]:
    """Sibling topics of types that hold one quantity each; they decode into the chosen topic."""
    found = _siblings(topics, chosen)
    for topic in found:
        topic.decode_into(chosen.decoded)
    return found


def _siblings(topics: Sequence[Topic], chosen: Topic) -> list[Topic]:
    family, place = chosen.profile.family, chosen.name.rsplit("/", 1)[0]
    alike = [topic for topic in topics if topic is not chosen and topic.profile.family == family != ""]
    return [topic for topic in alike if topic.name.rsplit("/", 1)[0] == place]


def _readable(topic: Topic) -> bool:
    return topic.profile.role == "joint_states" and bool(topic.decoders)


def _configured(reader: MessageReader, topics: Sequence[Topic], wanted: str, key: str, where: str) -> Topic:
    topic = stated_topic(topics, wanted, key)
    if not _readable(topic):
        why = topic.problem or f"messages of type {topic.type} are not joint states"
        found = {} if topic.problem else _proposed_fields([topic], reader)
        hint = "" if topic.problem else "say where its joint signals stand: [log.fields] position, effort"
        if found:
            hint = "if these are measured, say where they stand: " + fields_line(topic.name, found[topic.name])
        raise LogError(f"the topic {wanted} cannot be read as joint states: {why}", where=where, hint=hint or None)
    return topic


def _none(reader: MessageReader, topics: Sequence[Topic], where: str) -> LogError:
    broken = [topic for topic in topics if topic.profile.role != "other" and not topic.decoders]
    if broken:
        problems = "; ".join(f"{topic.name}: {topic.problem}" for topic in broken)
        return LogError("its joint signals cannot be decoded", where=where, found=problems)
    lines = [fields_line(name, fields) for name, fields in _proposed_fields(topics, reader).items()]
    return LogError(
        "the log has no topic with joint states",
        where=where,
        found=described(topics),
        expected="a topic of type sensor_msgs/msg/JointState with names, positions and efforts",
        hint="if these are measured, say where they stand: " + "; or ".join(lines[:_OFFERED])
        if lines
        else "record the robot's joint states; where messages of an own type hold them, choose their topic with [log] "
        "joint_states and say where they stand, [log.fields] position, effort",
    )


def _proposed_fields(topics: Sequence[Topic], reader: MessageReader) -> dict[str, Fields]:
    """By topic that nothing reads, the keys of ``[log.fields]`` that its first message suggests; not those without any.

    Args:
        topics: of a log.
        reader: of it.
    """
    unread = {topic.channels[0].key: topic for topic in topics if topic.profile.role == "other"}
    out = {}
    for batch in reader.batches(frozenset(unread)) if unread else ():
        topic = unread.pop(batch.key, None)
        if topic is not None and (found := fields_of_first(topic, batch)):
            out[topic.name] = found
        if not unread:
            break
    return out
