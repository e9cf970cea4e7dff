"""The topics of a log: which profile reads each, that of its type or one that the configuration states; decoding.

Of messages that no profile reads, where joint signals may stand: paths for ``[log.fields]``, proposed only.
"""

from __future__ import annotations

import difflib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import ConfigError, LogError
from collaudit.core.findings import Finding
from collaudit.core.logs.messages.layout import Chars, LayoutError, Node, Numbers
from collaudit.core.logs.messages.message_decoding import ChannelDecoder, Decoded, first_message, layouts_of
from collaudit.core.logs.messages.message_schema import SchemaError, read_definitions
from collaudit.core.logs.signals.signal_names import MOTION, Found
from collaudit.core.logs.storage.bounded_reading import ReadingBounds
from collaudit.core.logs.storage.readers import Batch, Channel, MessageReader
from collaudit.core.logs.tables.column_groups import choose, groups_of, meaning_of
from collaudit.core.numeric.parallel import Progress
from collaudit.core.vendors.message_profiles import PROFILES, Profile

Definitions = Mapping[str, Any]
#: Name of the profiles that the configuration makes.
CONFIGURED = "configured"
_BY_TYPE = {kind: profile for profile in PROFILES for kind in profile.types}
_UNREAD = Profile("none", "other", ())
Fields = Mapping[str, str | list[str]]
Leaves = Mapping[str, tuple[str, int]]
#: Pairs of words for seconds and nanoseconds.
_STAMPS = (("sec", "nanosec"), ("secs", "nsecs"), ("sec", "nsec"), ("seconds", "nanos"), ("s", "ns"))
#: What they stand under.
_STAMPED = ("", "stamp", "timestamp", "time", "header")
_NAMES = ("name", "names", "joint_name", "joint_names", "id", "ids")
#: Larger messages hold images or clouds, and more fields than this are no arm's.
_MOST_BYTES, _MOST = 1 << 20, 2000


@dataclass(slots=True, eq=False)
class Topic:
    """The channels of one topic.

    Attributes:
        name: topic name.
        channels: its channels.
        profile: what reads it.
        problem: why it cannot be read, or "".
        decoders: by channel key, when it can be read.
        decoded: where they put their columns.
        extra: definitions of types that the log does not hold, by name.
    """

    name: str
    channels: list[Channel]
    profile: Profile
    problem: str
    decoders: dict[int, ChannelDecoder]
    decoded: Decoded
    extra: Definitions = field(default_factory=dict)

    @property
    def type(self) -> str:
        """The message types, usually one."""
        return ", ".join(dict.fromkeys(channel.type or "no type" for channel in self.channels))

    def decode_into(self, decoded: Decoded) -> None:
        """Put the columns there from now on."""
        self.decoded = decoded
        for decoder in self.decoders.values():
            decoder.out = decoded


def topics_of(reader: MessageReader, settings: LogConfig, bounds: ReadingBounds) -> list[Topic]:
    """The topics of a log, sorted by name, each with a decoder where a profile or the configuration reads it.

    Args:
        reader: the log.
        settings: definitions and fields that the configuration states.
        bounds: how much may be read.

    Raises:
        ConfigError: the configured message definitions cannot be read, or paths are given for no topic.
    """
    extra = read_definitions(settings.msg_path)
    by_name: dict[str, list[Channel]] = {}
    for channel in reader.channels:
        by_name.setdefault(channel.topic, []).append(channel)
    return [_topic(name, by_name[name], settings, extra, bounds) for name in sorted(by_name)]


def _topic(name: str, channels: list[Channel], settings: LogConfig, extra: Definitions, bounds: ReadingBounds) -> Topic:
    """A topic read by the profile of its configuration, or else of its messages' type."""
    own = configured(settings, name, channels[0].type)
    known = [own] if own is not None else [profile_of(channel.type) for channel in channels]
    profiles = {profile.name: profile for profile in known if profile is not _UNREAD}
    if len(profiles) == 1:
        (profile,) = profiles.values()
        return read_by(name, channels, profile, extra, bounds)
    problem = f"it has messages of several kinds ({', '.join(profiles)})" if profiles else ""
    return Topic(name, channels, _UNREAD, problem, {}, Decoded(bounds=bounds), extra)


def read_by(name: str, channels: list[Channel], profile: Profile, extra: Definitions, bounds: ReadingBounds) -> Topic:
    """A topic read by a profile, as much as all topics of the log together may hold."""
    topic = Topic(name, channels, profile, "", {}, Decoded(bounds=bounds), extra)
    for channel in channels:
        if channel.type not in profile.types:
            topic.problem = f"messages of type {channel.type} on it are not read"
            continue
        try:
            topic.decoders[channel.key] = ChannelDecoder(channel, profile, topic.decoded, extra)
        except SchemaError as error:
            topic.problem = str(error)
    return topic


def decode(reader: MessageReader, topics: Sequence[Topic], progress: Progress | None = None, limit: int = 0) -> None:
    """Decode topics in one pass.

    Args:
        reader: the log.
        topics: what to decode; their ``decoded`` is filled.
        progress: called with (bytes done, bytes in all).
        limit: stop when each topic has this many messages; 0 reads all.
    """
    decoders: dict[int, list[ChannelDecoder]] = {}
    for topic in topics:
        topic.decoded.claimed = sum(decoder.channel.claimed for decoder in topic.decoders.values())
        for key, decoder in topic.decoders.items():
            decoders.setdefault(key, []).append(decoder)
    if not decoders:
        return
    for batch in reader.batches(frozenset(decoders), progress):
        for decoder in decoders[batch.key]:
            decoder.add(batch)
        if limit and all(topic.decoded.seen >= limit for topic in topics):
            return


def named(topics: Sequence[Topic], name: str | None) -> Topic | None:
    """The topic of a name, with or without slashes around it; None without."""
    return next((topic for topic in topics if _same(topic.name, name)), None)


def stated_topic(topics: Sequence[Topic], name: str, key: str) -> Topic:
    """The topic that a key of ``[log]`` names.

    Raises:
        LogError: the log does not have it.
    """
    found = named(topics, name)
    if found is None:
        close = difflib.get_close_matches(name, [topic.name for topic in topics], n=1)
        raise LogError(
            f"the log has no topic {name}, which [log] {key} names",
            where=f"[log] {key}",
            found=described(topics),
            hint=f'[log] {key} = "{close[0]}"' if close else "correct the name, or take the line out",
        )
    return found


def described(topics: Sequence[Topic], limit: int = 20) -> str:
    """Topics and their types, for messages."""
    if not topics:
        return "no topics"
    shown = ", ".join(f"{topic.name} ({topic.type})" for topic in topics[:limit])
    return shown + (f" and {len(topics) - limit} more" if len(topics) > limit else "")


def profile_of(type_name: str) -> Profile:
    """The profile that reads a message type, one of the role ``other`` where none does."""
    return _BY_TYPE.get(type_name, _UNREAD)


def configured(settings: LogConfig, topic: str, type_name: str) -> Profile | None:
    """The profile that the configuration itself gives for a topic, if it does.

    Raises:
        ConfigError: paths are given for a topic that is not named.
    """
    fields = settings.fields
    if fields is None:
        return None
    for named, path in (("joint_states", fields.position), ("wrench", fields.wrench)):
        if path is not None and getattr(settings, named) is None:
            raise ConfigError(f"[log.fields] says where fields stand on a topic that [log] {named} does not name")
    of_joints = fields.position is not None and _same(topic, settings.joint_states)
    if of_joints or (fields.effort is not None and _same(topic, settings.efforts)):
        path = fields.names if isinstance(fields.names, str) else None
        fixed = tuple(fields.names) if isinstance(fields.names, list) else ("joint{i}",)
        return Profile(
            name=CONFIGURED,
            role="joint_states",
            types=(type_name,),
            stamp=fields.stamp,
            names=path,
            fixed_names=fixed if path is None else (),
            position=fields.position if of_joints else None,
            velocity=fields.velocity if of_joints else None,
            effort=fields.effort if not of_joints or settings.efforts is None else None,
            temperature=fields.temperature if of_joints else None,
            joint_torque=fields.joint_torque if of_joints else None,
        )
    if fields.wrench is not None and _same(topic, settings.wrench):
        return Profile(CONFIGURED, "wrench", (type_name,), stamp=fields.stamp, wrench=fields.wrench)
    return None


def _same(topic: str, named: str | None) -> bool:
    return named is not None and topic.strip("/") == named.strip("/")


def skipped_findings(topic: Topic) -> tuple[Finding, ...]:
    """Findings for messages of a topic that were left out."""
    decoded = topic.decoded
    if not decoded.skipped:
        return ()
    text = f"{decoded.skipped} of {decoded.seen} messages were left out; the first because {decoded.problem}."
    return (Finding("log-left-out", "warning", text, where=topic.name),)


def fields_of_first(topic: Topic, batch: Batch) -> Fields:
    """The keys of ``[log.fields]`` that the first message of a batch suggests; empty without positions or efforts.

    Paths of positions, velocities and efforts by the words of columns, with names and stamp where they are found.
    """
    message = first_message(batch)
    if message is None or len(message) > _MOST_BYTES:
        return {}
    try:
        leaves = dict(_leaves(layouts_of(topic.channels[0], topic.extra)(message).root, ""))
    except (SchemaError, LayoutError):
        return {}
    groups = [*_rows(leaves), *_alike(leaves), *_counted(leaves)]
    first = choose(groups, "position")
    position = first.taken or next(iter(first.open), None)
    if position is None:
        return {}
    out: dict[str, str | list[str]] = {}
    for quantity in MOTION:
        choice = choose(groups, quantity, len(position.columns))
        taken = choice.taken or next(iter(choice.open), None)
        if taken is not None and len(taken.columns) == len(position.columns):
            out[quantity] = taken.pattern
    if "effort" not in out:
        return {}
    return {**_named(leaves, position), **out, **_stamped(leaves)}


def fields_line(topic: str, fields: Fields) -> str:
    """The lines of the configuration that read a topic by paths."""
    stated = (f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in fields.items())
    return f'[log] joint_states = "{topic}"; [log.fields] ' + "; ".join(stated)


def _leaves(node: Node | None, path: str) -> Iterator[tuple[str, tuple[str, int]]]:
    """Path of each number, text, or row of them, with its kind and how many it has."""
    if isinstance(node, dict):
        for name, inner in list(node.items())[:_MOST]:
            if "." not in name and "," not in name:
                yield from _leaves(inner, f"{path}.{name}" if path else name)
    elif isinstance(node, Numbers):
        yield path, ("number", node.count)
    elif isinstance(node, Chars):
        yield path, ("text", 1)
    elif isinstance(node, list) and node:
        if all(isinstance(item, Chars) for item in node):
            yield path, ("text", len(node))
        elif "[*]" not in path:
            for name, (kind, count) in _leaves(node[0], f"{path}[*]"):
                if count == 1:
                    yield name, (kind, len(node))


def _group(path: str, count: int, words: str) -> Iterator[Found]:
    meaning = meaning_of(words)
    if meaning is not None and count > 1:
        yield replace(Found.numbered(range(count), path), meaning=meaning)


def _rows(leaves: Leaves) -> Iterator[Found]:
    """Rows of numbers, and one number of every item."""
    for path, (kind, count) in leaves.items():
        if kind == "number" and count > 1:
            yield from _group(path, count, path.replace("[*]", ""))


def _alike(leaves: Leaves) -> Iterator[Found]:
    """Numbers that stand under each of several keys, as a joint's own: ``joints.a.q,joints.b.q``."""
    found: dict[tuple[str, str], list[str]] = {}
    for path, (kind, count) in leaves.items():
        above, _, leaf = path.rpartition(".")
        if kind == "number" and count == 1 and "." in above:
            found.setdefault((above.rpartition(".")[0], leaf), []).append(path)
    for (_, leaf), paths in found.items():
        yield from _group(",".join(paths), len(paths), leaf)


def _counted(leaves: Leaves) -> Iterator[Found]:
    """Numbers whose names count: ``q1``, ``q2`` …"""
    names = [path for path, (kind, count) in leaves.items() if kind == "number" and count == 1 and "[*]" not in path]
    for group in groups_of(names):
        yield replace(group, pattern=",".join(names[column] for column in group.columns))


def _named(leaves: Leaves, position: Found) -> Fields:
    """Names of the joints: texts beside them, or the keys that they stand under."""
    count = len(position.columns)
    for path, (kind, texts) in leaves.items():
        if kind == "text" and texts == count and path.rpartition(".")[2] in _NAMES:
            return {"names": path}
    keys = [path.split(".")[-2] for path in position.pattern.split(",") if "." in path]
    return {"names": keys} if len(set(keys)) == count else {}


def _stamped(leaves: Leaves) -> Fields:
    whole = [path for path, (kind, count) in leaves.items() if kind == "number" and count == 1]
    for seconds, rest in _STAMPS:
        for path in whole:
            above, dot, leaf = path.rpartition(".")
            if leaf == seconds and f"{above}{dot}{rest}" in whole and above.rpartition(".")[2] in _STAMPED:
                return {"stamp": f"{path},{above}{dot}{rest}"}
    return {}
