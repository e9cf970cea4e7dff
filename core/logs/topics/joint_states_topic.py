"""Which topic holds the joint states, and the topics that complete it."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.errors import ConfigError, LogError, did_you_mean
from collaudit.core.logs.messages.decoded_columns import Decoded, all_names
from collaudit.core.logs.signals.joint_naming import listed, matches
from collaudit.core.logs.storage.records import MessageReader
from collaudit.core.logs.topics.log_topics import Topic, decode, described, named

#: Messages looked at to learn a topic's joint names before one is chosen.
PEEK = 2000


def peek_names(reader: MessageReader, topics: Sequence[Topic]) -> dict[str, tuple[str, ...]]:
    """Joint names of each topic, from its first messages; the topics are left without data."""
    decode(reader, topics, limit=PEEK)
    names = {topic.name: all_names([topic.decoded]) for topic in topics}
    for topic in topics:
        topic.decode_into(Decoded(bounds=topic.decoded.bounds))
    return names


def choose_joint_states(
    reader: MessageReader,
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
    candidates = [topic for topic in topics if _readable(topic) and topic.profile.position is not None]
    if not candidates:
        raise _none(topics, where)
    if len(candidates) == 1:
        return candidates[0]
    names = peek_names(reader, candidates)
    scores = {topic.name: matches(names[topic.name], mapping, robot) for topic in candidates}
    best = max(scores.values())
    unnamed = [topic for topic in candidates if topic.profile.fixed_names]
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
    chosen = [topic for topic in candidates if robot is None or scores[topic.name] == best]
    if len(chosen) > 1:
        raise ConfigError(
            "several topics could be the joint states",
            where=where,
            found="; ".join(f"{topic.name} ({topic.type}): {listed(names[topic.name])}" for topic in chosen),
            hint=f'choose one: [log] joint_states = "{chosen[0].name}"',
        )
    return chosen[0]


def companions(topics: Sequence[Topic], chosen: Topic) -> list[Topic]:
    """Sibling topics of types that hold one quantity each; they decode into the chosen topic."""
    family, place = chosen.profile.family, chosen.name.rsplit("/", 1)[0]
    alike = [topic for topic in topics if topic is not chosen and topic.profile.family == family != ""]
    found = [topic for topic in alike if topic.name.rsplit("/", 1)[0] == place]
    for topic in found:
        topic.decode_into(chosen.decoded)
    return found


def _readable(topic: Topic) -> bool:
    return topic.profile.role == "joint_states" and bool(topic.decoders)


def _configured(topics: Sequence[Topic], wanted: str, where: str) -> Topic:
    topic = named(topics, wanted)
    if topic is None:
        hint = did_you_mean(wanted, [topic.name for topic in topics])
        raise LogError(f"there is no topic {wanted}", where=where, found=described(topics), hint=hint)
    if not _readable(topic):
        why = topic.problem or f"messages of type {topic.type} are not joint states"
        raise LogError(f"the topic {wanted} cannot be read as joint states: {why}", where=where)
    return topic


def _none(topics: Sequence[Topic], where: str) -> LogError:
    broken = [topic for topic in topics if topic.profile.role != "other" and not topic.decoders]
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
