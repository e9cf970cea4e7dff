"""Choosing the topic of the joint states, and decoding topics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from collaudit.core.errors import ConfigError, LogError
from collaudit.core.logs.messages.message_decoding import ChannelDecoder
from collaudit.core.logs.messages.message_definitions import read_definitions
from collaudit.core.logs.messages.message_schema import SchemaError
from collaudit.core.logs.messages.message_tables import Decoded, all_names
from collaudit.core.logs.messages.profiles import Profile, configured, profile_of
from collaudit.core.logs.signals.joint_naming import listed, matches
from collaudit.core.logs.storage.records import Channel, LogReader, Progress

if TYPE_CHECKING:
    from collaudit.core.config.schema import LogConfig

Definitions = Mapping[str, Any]
#: Messages looked at to learn a topic's joint names before one is chosen.
PEEK = 2000
ENCODINGS = ("cdr", "ros1", "json", "protobuf")


@dataclass(slots=True, eq=False)
class Topic:
    """The channels of one topic.

    Attributes:
        name: topic name.
        channels: its channels.
        profile: what reads it, or None.
        problem: why it cannot be read, or "".
        decoders: by channel key, when it can be read.
        decoded: where they put their columns.
        extra: definitions of types that the log does not hold, by name.
    """

    name: str
    channels: list[Channel]
    profile: Profile | None
    problem: str
    decoders: dict[int, ChannelDecoder]
    decoded: Decoded
    extra: Definitions = field(default_factory=dict)

    @property
    def type(self) -> str:
        """The message types, usually one."""
        return ", ".join(dict.fromkeys(channel.type or "no type" for channel in self.channels))


def topics_of(reader: LogReader, settings: LogConfig | None = None) -> list[Topic]:
    """The topics of a log, sorted by name, each with a decoder where a profile or the configuration reads it.

    Raises:
        ConfigError: the configured message definitions cannot be read, or paths are given for no topic.
    """
    extra = read_definitions(settings.msg_path) if settings is not None and settings.msg_path else {}
    by_name: dict[str, list[Channel]] = {}
    for channel in reader.channels:
        by_name.setdefault(channel.topic, []).append(channel)
    out = []
    for name, channels in sorted(by_name.items()):
        own = configured(settings, name, channels[0].type) if settings is not None else None
        out.append(_topic(name, channels, extra) if own is None else read_by(name, channels, own, extra))
    return out


def read_by(name: str, channels: list[Channel], profile: Profile, extra: Definitions) -> Topic:
    """A topic read by a profile that the configuration makes."""
    topic = Topic(name, channels, profile, "", {}, Decoded(), extra)
    for channel in channels:
        _add_decoder(topic, channel)
    return topic


def _topic(name: str, channels: list[Channel], extra: Definitions) -> Topic:
    topic = Topic(name, channels, None, "", {}, Decoded(), extra)
    profiles = {profile.name: profile for channel in channels if (profile := profile_of(channel.type)) is not None}
    if len(profiles) > 1:
        topic.problem = f"it has messages of several kinds ({', '.join(profiles)})"
    elif profiles:
        topic.profile = next(iter(profiles.values()))
        for channel in channels:
            _add_decoder(topic, channel)
    return topic


def _add_decoder(topic: Topic, channel: Channel) -> None:
    assert topic.profile is not None
    if channel.encoding not in ENCODINGS:
        topic.problem = f"messages encoded as {channel.encoding!r} are not read"
        return
    if channel.type not in topic.profile.types:
        topic.problem = f"messages of type {channel.type} on it are not read"
        return
    try:
        topic.decoders[channel.key] = ChannelDecoder.of(channel, topic.profile, topic.decoded, topic.extra)
        topic.decoders[channel.key].tagged = len(topic.channels) > 1
    except SchemaError as error:
        topic.problem = str(error)


def decode(reader: LogReader, topics: Sequence[Topic], progress: Progress | None = None, limit: int = 0) -> None:
    """Decode topics in one pass.

    Args:
        reader: the log.
        topics: what to decode; their ``decoded`` is filled.
        progress: called with (bytes done, bytes in all).
        limit: stop when each topic has this many messages; 0 reads all.
    """
    decoders: dict[int, list[ChannelDecoder]] = {}
    for topic in topics:
        for key, decoder in topic.decoders.items():
            decoders.setdefault(key, []).append(decoder)
    if not decoders:
        return

    def note(done: int, total: int) -> None:
        for topic in topics:
            topic.decoded.share = done / total if total else 0.0
        if progress is not None:
            progress(done, total)

    for batch in reader.batches(frozenset(decoders), note):
        for decoder in decoders[batch.key]:
            decoder.add(batch)
        if limit and all(topic.decoded.seen >= limit for topic in topics):
            return


def peek_names(reader: LogReader, topics: Sequence[Topic]) -> dict[str, tuple[str, ...]]:
    """Joint names of each topic, from its first messages; the topics are left without data."""
    decode(reader, topics, limit=PEEK)
    names = {topic.name: all_names([topic.decoded]) for topic in topics}
    for topic in topics:
        fresh = Decoded()
        topic.decoded = fresh
        for decoder in topic.decoders.values():
            decoder.out = fresh
    return names


def choose_joint_states(
    reader: LogReader,
    topics: Sequence[Topic],
    wanted: str | None,
    robot: Sequence[str] | None,
    mapping: dict[str, str],
    where: str,
) -> Topic:
    """The topic of the joint states.

    Args:
        reader: the log, to look at joint names when several topics could be meant.
        topics: all topics.
        wanted: the configuration's choice, or None.
        robot: the robot's joints, or None.
        mapping: log name to model name.
        where: the log, for messages.

    Raises:
        LogError: there is no readable topic of joint states, or not the one configured.
        ConfigError: several could be meant.
    """
    if wanted is not None:
        return _configured(topics, wanted, where)
    candidates = [topic for topic in topics if topic.decoders and _is_joints(topic) and _has_position(topic)]
    if not candidates:
        raise _none(topics, where)
    if len(candidates) == 1:
        return candidates[0]
    names = peek_names(reader, candidates)
    scores = {topic.name: matches(names[topic.name], mapping, robot) for topic in candidates}
    best = max(scores.values())
    unnamed = [topic for topic in candidates if topic.profile is not None and topic.profile.fixed_names]
    if best == 0 and len(unnamed) == 1:
        return unnamed[0]
    if best == 0:
        raise LogError(
            "none of the log's topics has joints of the robot",
            where=where,
            found="; ".join(f"{name}: {listed(joints)}" for name, joints in names.items()),
            expected=listed(robot or ()),
            hint="map the names under [log] joint_names",
        )
    chosen = [topic for topic in candidates if scores[topic.name] == best]
    if robot is None:
        chosen = candidates
    if len(chosen) > 1:
        raise ConfigError(
            "several topics could be the joint states",
            where=where,
            found="; ".join(f"{topic.name} ({topic.type}): {listed(names[topic.name])}" for topic in chosen),
            hint=f'choose one: [log] joint_states = "{chosen[0].name}"',
        )
    return chosen[0]


def _has_position(topic: Topic) -> bool:
    return topic.profile is not None and topic.profile.position is not None


def companions(topics: Sequence[Topic], chosen: Topic) -> list[Topic]:
    """Sibling topics of types that hold one quantity each; they decode into the chosen topic."""
    family = chosen.profile.family if chosen.profile is not None else ""
    found = [
        topic
        for topic in topics
        if family
        and topic is not chosen
        and topic.profile is not None
        and topic.profile.family == family
        and topic.name.rsplit("/", 1)[0] == chosen.name.rsplit("/", 1)[0]
    ]
    for topic in [chosen, *found] if found else []:
        for decoder in topic.decoders.values():
            decoder.tagged = True
    for topic in found:
        topic.decoded = chosen.decoded
        for decoder in topic.decoders.values():
            decoder.out = chosen.decoded
    return found


def _is_joints(topic: Topic) -> bool:
    return topic.profile is not None and topic.profile.role == "joint_states"


def _configured(topics: Sequence[Topic], wanted: str, where: str) -> Topic:
    for topic in topics:
        if topic.name == wanted or topic.name.strip("/") == wanted.strip("/"):
            if not topic.decoders or not _is_joints(topic):
                why = topic.problem or f"messages of type {topic.type} are not joint states"
                raise LogError(f"the topic {wanted} cannot be read as joint states: {why}", where=where)
            return topic
    raise LogError(f"there is no topic {wanted}", where=where, found=described(topics))


def _none(topics: Sequence[Topic], where: str) -> LogError:
    broken = [topic for topic in topics if topic.profile is not None and not topic.decoders]
    if broken:
        problems = "; ".join(f"{topic.name}: {topic.problem}" for topic in broken)
        return LogError("its joint signals cannot be decoded", where=where, found=problems)
    return LogError(
        "the log has no topic with joint states",
        where=where,
        found=described(topics),
        expected="a topic of type sensor_msgs/msg/JointState with names, positions and efforts",
        hint="record the robot's joint states, or choose the topic with [log] joint_states",
    )


def described(topics: Sequence[Topic], limit: int = 20) -> str:
    """Topics and their types, for messages."""
    if not topics:
        return "no topics"
    shown = ", ".join(f"{topic.name} ({topic.type})" for topic in topics[:limit])
    return shown + (f" and {len(topics) - limit} more" if len(topics) > limit else "")
