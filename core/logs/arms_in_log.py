"""Several arms in one log: what states the signals of each, by topics, by joint names, or by columns."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from collaudit.core.data.joint_log import JointLog
from collaudit.core.logs.log_summary import LogSummary, TopicInfo
from collaudit.core.logs.signals.joint_naming import guess_joints
from collaudit.core.logs.signals.sample_clock import interpolate
from collaudit.core.logs.signals.signal_names import MARK, families

#: Poses of two topics this close, rad and share of the range, are two reports on one arm (measured and commanded …).
_SAME_POSE, _SAME_SHARE = 0.02, 0.02


@dataclass(frozen=True, slots=True)
class Arm:
    """One arm of a log.

    Attributes:
        keys: dotted keys of the configuration that state its signals.
        topics: its topic, where that tells the arm from the others.
        joints: its joints in the log (of a table without their names its columns), where these tell it.
    """

    keys: Mapping[str, object]
    topics: tuple[str, ...] = ()
    joints: tuple[str, ...] = field(default=())


def arms_of(
    summary: LogSummary, robot: Sequence[str], prismatic: Sequence[str], columns: Mapping[str, Mapping[str, str]]
) -> dict[str, Arm]:
    """The arms of a log by name; empty where it is of one, or where names do not tell.

    Args:
        summary: of the log.
        robot: joints of the description in model order: of one arm, or of all.
        prismatic: those that are prismatic.
        columns: side to quantity to pattern, of a table whose columns are of several sides; one without efforts, such
            as a second encoder's, is no arm.
    """
    if not robot:
        return {}
    columns = {side: patterns for side, patterns in columns.items() if "effort" in patterns}
    if len(columns) > 1:
        return {side: _of_columns(patterns, summary.csv_columns) for side, patterns in columns.items()}
    tables = [topic for topic in summary.topics if topic.role == "joint_states" and topic.readable and topic.joints]
    tables = [topic for topic in tables if topic.has_effort is not False]
    turning = [name for name in robot if name not in set(prismatic)]
    for topic in tables:
        groups = _groups(topic.joints, turning)
        if len(groups) > 1:
            stated = {} if summary.csv_columns else {"log.joint_states": topic.name}
            return {
                name: Arm({**stated, "log.joint_names": dict(names)}, joints=tuple(names))
                for name, names in groups.items()
            }
    return _by_topics(tables, robot, prismatic)


def same_arm(one: JointLog, other: JointLog) -> bool:
    """Whether two topics report the same poses of the same joints at the same time."""
    if one.joint_names != other.joint_names:
        return False
    later_s = ((other.source.start_ns or 0) - (one.source.start_ns or 0)) / 1e9
    there = interpolate(one.time_s, other.time_s + later_s, other.position_rad)
    known = np.isfinite(there).all(axis=1)
    near = _SAME_POSE + _SAME_SHARE * np.ptp(one.position_rad, axis=0)
    return bool(known.any() and (np.abs(one.position_rad - there)[known] <= near).all(axis=1).mean() > 0.5)


def _of_columns(patterns: Mapping[str, str], names: Sequence[str]) -> Arm:
    first = re.escape(patterns["position"]).replace(r"\{i\}", r"\d+").replace(r"\{i0\}", r"\d+")
    own = tuple(name for name in names if re.fullmatch(first, name.strip()))
    return Arm({f"log.csv.{quantity}": pattern for quantity, pattern in patterns.items()}, joints=own)


def _groups(names: Sequence[str], robot: Sequence[str]) -> dict[str, dict[str, str]]:
    """Names of one topic by arm, each log name with the robot's: by the words they have beyond the robot's names.

    Where the robot's names are none of the log's, names that differ in one number are an arm's if they are as many.
    """
    found: dict[str, dict[str, str]] = {}
    by_words = sorted(robot, key=lambda joint: -len(_words(joint)))
    for name in names:
        for joint in by_words:
            if (more := _beyond(_words(name), _words(joint))) is not None:
                found.setdefault("_".join(more) or "arm", {}).setdefault(name, joint)
                break
    if found := {arm: pairs for arm, pairs in found.items() if set(pairs.values()) == set(robot)}:
        return found
    arms = [family for family in families(names) if len(family.places) == len(robot)]
    guesses = [guess_joints([names[place] for place in family.places], robot) for family in arms]
    called = _distinguished([_words(family.stem.replace(MARK, "_")) for family in arms])
    return {name: dict(guess.mapping) for name, guess in zip(called, guesses, strict=True) if guess.sure}


def _by_topics(tables: Sequence[TopicInfo], robot: Sequence[str], prismatic: Sequence[str]) -> dict[str, Arm]:
    """Topics with equally many of the robot's joints, the same ones or others each, under different namespaces."""
    known: dict[str, frozenset[str]] = {}
    for topic in tables:
        guess = guess_joints(topic.joints, robot, prismatic)
        mapping = guess.mapping if guess.sure else {}
        known[topic.name] = frozenset(mapping.get(name, name) for name in topic.joints) & frozenset(robot)
    most = max((len(joints) for joints in known.values()), default=0)
    names = [name for name, joints in known.items() if len(joints) == most > 1]
    called = _distinguished([name.strip("/").split("/")[:-1] or [""] for name in names])
    if len(names) < 2 or len(set(called)) < len(names):
        return {}
    return {arm: Arm({"log.joint_states": topic}, (topic,)) for arm, topic in zip(called, names, strict=True)}


def _distinguished(names: Sequence[Sequence[str]]) -> list[str]:
    """Of each name the words that not all have."""
    common = set[str]().union(*names).intersection(*names) if names else set()
    return ["_".join(_plain(word for word in words if word not in common)) or "arm" for words in names]


def _plain(words: Iterable[str]) -> list[str]:
    return [plain for word in words if (plain := re.sub(r"\W+", "_", word).strip("_"))]


def _words(name: str) -> list[str]:
    return re.findall(r"[^\W_]+", name)


def _beyond(name: Sequence[str], joint: Sequence[str]) -> tuple[str, ...] | None:
    """Words of a name beyond those of a joint, which all are in it, in order and the last one at its end."""
    rest, left = [], list(joint)
    for word in reversed(name):
        if left and word == left[-1]:
            left.pop()
        else:
            rest.append(word)
    return None if left else tuple(reversed(rest))
