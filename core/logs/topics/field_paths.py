"""Where joint signals may stand in messages that no profile reads: paths for ``[log.fields]``, proposed only."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from collaudit.core.logs.messages.layout import Chars, Layout, LayoutError, Node, Numbers
from collaudit.core.logs.messages.message_decoding import first_message, layouts_of
from collaudit.core.logs.messages.message_schema import SchemaError
from collaudit.core.logs.signals.signal_names import MOTION, Found
from collaudit.core.logs.storage.readers import Batch, MessageReader
from collaudit.core.logs.tables.column_groups import choose, groups_of, meaning_of
from collaudit.core.logs.topics.log_topics import Topic

Fields = Mapping[str, str | list[str]]
Leaves = Mapping[str, tuple[str, int]]
#: Pairs of words for seconds and nanoseconds.
_STAMPS = (("sec", "nanosec"), ("secs", "nsecs"), ("sec", "nsec"), ("seconds", "nanos"), ("s", "ns"))
#: What they stand under.
_STAMPED = ("", "stamp", "timestamp", "time", "header")
_NAMES = ("name", "names", "joint_name", "joint_names", "id", "ids")
#: Larger messages hold images or clouds, and more fields than this are no arm's.
_MOST_BYTES, _MOST = 1 << 20, 2000


def fields_of(topics: Sequence[Topic], reader: MessageReader) -> dict[str, Fields]:
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


def fields_of_first(topic: Topic, batch: Batch) -> Fields:
    """The keys of ``[log.fields]`` that the first message of a batch suggests; empty without positions or efforts."""
    message = first_message(batch)
    if message is None or len(message) > _MOST_BYTES:
        return {}
    try:
        layout = layouts_of(topic.channels[0], topic.extra)(message)
    except (SchemaError, LayoutError):
        return {}
    return suggested(layout)


def suggested(layout: Layout) -> Fields:
    """Paths of positions, velocities and efforts by the words of columns, with names and stamp where they are found."""
    leaves = dict(_leaves(layout.root, ""))
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
