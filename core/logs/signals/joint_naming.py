"""Joint names: the log's, the robot's, and which log names are meant by which, where they differ too."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from collaudit.core.errors import ConfigError, LogError
from collaudit.core.findings import Finding, fact
from collaudit.core.logs.signals.signal_names import families


@dataclass(frozen=True, slots=True)
class NameMap:
    """Which joints of a log are kept.

    Attributes:
        log: log names kept, in the order of ``model``.
        model: their names in the robot model.
        findings: joints ignored and joints missing.
    """

    log: tuple[str, ...]
    model: tuple[str, ...]
    findings: tuple[Finding, ...]


def matches(names: Sequence[str], mapping: Mapping[str, str], robot: Sequence[str]) -> int:
    """How many of the robot's joints a set of log names has."""
    return len({mapping.get(name, name) for name in names} & set(robot))


def map_names(
    names: Sequence[str],
    mapping: Mapping[str, str],
    robot: Sequence[str] | None,
    where: str,
    prismatic: Sequence[str] = (),
    *,
    numbered: bool = False,
    columns: bool = False,
    message_order: bool = False,
    judged: Sequence[str] = (),
) -> NameMap:
    """Decide which joints of a log are kept and what the robot calls them.

    Args:
        names: joint names of the log.
        mapping: log name to model name, ``[log] joint_names``.
        robot: the robot's joints; None keeps all of the log's.
        where: file and topic, for messages.
        prismatic: the robot's prismatic joints.
        columns: the names are those of numbered columns, and not of a message's joints.
        numbered, message_order, judged: as of :func:`collaudit.core.logs.signals.joint_naming.guess_joints`.

    Raises:
        ConfigError: two joints of the log are mapped to one of the robot. A stated name wins over the log's own.
        LogError: none of the log's joints is one of the robot's, or it is not sure which is which.
    """
    said: tuple[Finding, ...] = ()
    if robot is not None and not any(name in mapping for name in names):
        guess = guess_joints(names, robot, prismatic, numbered=numbered, message_order=message_order, judged=judged)
        said = _used(guess, names, robot, where, columns=columns)
        mapping = {**mapping, **guess.mapping}
    return _kept(names, mapping, robot, where, said)


def _used(
    guess: JointGuess, names: Sequence[str], robot: Sequence[str], where: str, *, columns: bool
) -> tuple[Finding, ...]:
    """What is said of a guess that is used.

    Raises:
        LogError: it is not sure enough to be used unasked.
    """
    if not guess.sure:
        proposed = [guess.mapping] if guess.mapping else list(guess.candidates.values()) or [dict.fromkeys(names, "…")]
        hint = "map them, " + ", or ".join(mapping_line(each) for each in proposed)
        if guess.chains:
            hint = (
                f"say which of the robot's joints they are, {', or '.join(map(joints_line, guess.chains))}; or {hint}"
            )
        problem = guess.problem or "none of the log's joints is a joint of the robot"
        raise LogError(problem, where=where, found=listed(names), expected=listed(robot), hint=hint)
    if all(log == model for log, model in guess.mapping.items()):
        return ()
    order = ", ".join(guess.mapping.values())
    said = "Numbered columns were taken as the robot's joints in its order"
    if not columns:
        said = "The log numbers its joints; they were taken as the robot's in its order"
    return (Finding("log-guessed", "info" if columns else "warning", f"{said}: {order}.", where=where),)


def _kept(
    names: Sequence[str],
    mapping: Mapping[str, str],
    robot: Sequence[str] | None,
    where: str,
    said: tuple[Finding, ...],
) -> NameMap:
    stated = {mapping[name] for name in names if name in mapping}
    namesakes = [name for name in names if name in stated and name not in mapping]  # of another arm in the same log
    mapped: dict[str, str] = {}
    for name in (name for name in names if name not in namesakes):
        target = mapping.get(name, name)
        if target in mapped and mapped[target] != name:
            raise ConfigError(
                f"the log's joints {mapped[target]!r} and {name!r} are both the robot's {target!r}",
                where=where,
                hint="correct [log] joint_names",
            )
        mapped[target] = name
    if robot is None:
        return NameMap(tuple(mapped.values()), tuple(mapped), ())
    kept = [name for name in robot if name in mapped]
    if not kept:
        raise LogError(
            "none of the log's joints is a joint of the robot",
            where=where,
            found=listed(names),
            expected=listed(robot),
            hint="map them, " + mapping_line(first_in_order(names, robot) or dict.fromkeys(names, "…")),
        )
    findings = list(said)
    ignored = [log for target, log in mapped.items() if target not in set(robot)]
    if namesakes:
        text = f"The log's own {listed(namesakes)}: left out, as [log] joint_names gives these names to other joints."
        findings.append(fact(text, where=where))
    missing = [name for name in robot if name not in mapped]
    if ignored:
        text = f"The log has joints that the robot does not have; they are left out: {listed(ignored)}."
        findings.append(fact(text, where=where))
    if missing:
        text = f"The robot has joints that the log does not have: {listed(missing)}."
        if absent := [name for name in mapping if name not in names]:
            text += f" Nor has the log these names of [log] joint_names: {listed(absent)}."
        findings.append(Finding("log-joints-missing", "warning", text, where=where))
    return NameMap(tuple(mapped[name] for name in kept), tuple(kept), tuple(findings))


def listed(names: Sequence[str], limit: int = 12) -> str:
    """Names for a message, not too many of them."""
    shown = ", ".join(repr(name) if name != name.strip() or " " in name else name for name in names[:limit])
    return shown + (f" and {len(names) - limit} more" if len(names) > limit else "") if names else "none"


_NUMBER = re.compile(r"\d+")
_MOST_CHAINS = 4


@dataclass(frozen=True, slots=True)
class JointGuess:
    """An answer, or the question that stands against one.

    Attributes:
        mapping: log name to robot name, of joints whose names differ; empty where nothing is guessed.
        why: the evidence for it.
        sure: whether it may be used unasked; otherwise it is only a proposal.
        problem: why there is no answer; "" where there is one.
        candidates: reason to mapping, of the answers that are possible.
        chains: as many of the robot's joints as the log has, of which it may be a log: values of ``[robot] joints``.
    """

    mapping: Mapping[str, str] = field(default_factory=dict)
    why: str = ""
    sure: bool = True
    problem: str = ""
    candidates: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    chains: tuple[tuple[str, ...], ...] = ()


def guess_joints(
    names: Sequence[str],
    robot: Sequence[str],
    prismatic: Sequence[str] = (),
    *,
    numbered: bool = False,
    message_order: bool = False,
    judged: Sequence[str] = (),
) -> JointGuess:
    """Map a log's joints to a robot's where their names differ.

    Numbered joints are taken in the order of their numbers when there are as many as the robot has: moving joints, or
    those before the prismatic ones of a gripper at its end. Digits inside names are compared with nothing.

    Args:
        names: the log's joints, in its order.
        robot: the robot's moving joints in model order.
        prismatic: those of them that are prismatic.
        numbered: the names are only numbers of columns, in order.
        message_order: the numbers count the joints of a message, which many publishers sort by the alphabet.
        judged: the joints that ``[robot] joints`` states: where the log has as many, and the robot more, it is theirs.
    """
    if len(judged) == len(names) < len(robot) and set(judged) <= set(robot):
        robot = judged
    if not numbered and not set(names).isdisjoint(robot):
        return _shifted(names, robot)
    by_words = _by_words(names, robot) if not numbered else {}
    ordered = list(names) if numbered else _by_number(names)
    if by_words and ordered is None:
        return JointGuess(by_words, "words of the log's name in the robot's", sure=False)
    arm = _arm_of(len(names), robot, prismatic)
    if arm is None:
        return _counts_differ(ordered or names, robot, by_words)
    if ordered is None:
        return _in_order(names, arm)
    by_order = dict(zip(ordered, arm, strict=True))
    by_number = dict(zip(ordered, _by_number(arm) or arm, strict=True))
    by_alphabet = dict(zip(ordered, sorted(arm, key=_natural), strict=True)) if message_order else by_order
    rivals = (
        (by_words or by_order, "their names", "the numbers of the log's joints and their names say different things"),
        (by_number, "their names", "the robot's joints are numbered otherwise than they follow each other"),
        (by_alphabet, "the order of the alphabet",
         "the columns count the joints of a message, and publishers sort them by the robot or by the alphabet"),
    )  # fmt: skip
    for other, why, problem in rivals:
        if other != by_order:
            return _open(problem, by_order, other, why)
    return JointGuess(by_order, "same place in the order of joints")


def mapping_line(mapping: Mapping[str, str]) -> str:
    """The line of the configuration that states a mapping."""
    return "[log] joint_names = { " + ", ".join(f'"{log}" = "{model}"' for log, model in mapping.items()) + " }"


def joints_line(chain: Sequence[str]) -> str:
    """The line of the configuration that says which of the robot's joints a log is of."""
    return "[robot] joints = [" + ", ".join(f'"{name}"' for name in chain) + "]"


def first_in_order(names: Sequence[str], robot: Sequence[str]) -> dict[str, str]:
    """Names in the robot's order as far as both go; empty where a word of one, such as a limb's, is of other joints."""
    pairs = dict(zip(names, robot, strict=False))
    own = {name: len(_letters(name) & _letters(joint)) for name, joint in pairs.items()}
    best = {name: max(len(_letters(name) & _letters(joint)) for joint in robot) for name in pairs}
    return pairs if own == best else {}


def _open(problem: str, by_order: Mapping[str, str], other: Mapping[str, str], why: str = "their names") -> JointGuess:
    return JointGuess(sure=False, problem=problem, candidates={"the order of the robot": by_order, why: other})


def _arm_of(count: int, robot: Sequence[str], prismatic: Sequence[str]) -> Sequence[str] | None:
    """The robot's joints that so many joints of a log can be: all, or all but a gripper's at the end.

    A gripper's joints are prismatic, or are not among those that the robot numbers from its base on.
    """
    if count == len(robot):
        return robot
    numbered = [family for family in families(robot) if family.counts and len(family.places) == count]
    if len(numbered) == 1 and sorted(numbered[0].places) == list(range(count)):
        return robot[:count]
    arm = list(robot)
    while arm and arm[-1] in prismatic:
        arm.pop()
    return arm if count == len(arm) and not set(arm) & set(prismatic) else None


def _by_number(names: Sequence[str]) -> list[str] | None:
    """Names in the order of the one number in which they differ, which counts from 0 or 1; None otherwise."""
    whole = (family for family in families(names) if family.counts and len(family.places) == len(names))
    found = next(whole, None)
    return None if found is None else [names[place] for place in found.places]


def _by_words(names: Sequence[str], robot: Sequence[str]) -> dict[str, str]:
    """Each name with the robot's joint that shares most words with it; empty unless all have one of their own.

    A number alone is no word: it counts only beside a word that both names have.
    """
    found = {}
    for name in names:
        shared = [_shared(name, joint) for joint in robot]
        if shared.count(max(shared)) == 1:
            found[name] = robot[shared.index(max(shared))]
    return found if len(found) == len(names) == len(set(found.values())) else {}


def _shifted(names: Sequence[str], robot: Sequence[str]) -> JointGuess:
    """Some names are the robot's: fine, unless the others show that two numberings overlap."""
    extra = [name for name in names if name not in robot]
    missing = [name for name in robot if name not in names]
    ours, extras, others = (
        {_NUMBER.sub("\0", name) for name in some if _NUMBER.search(name)}
        for some in (set(names) & set(robot), extra, missing)
    )
    if not ours & extras or not ours & others:
        return JointGuess()
    ordered = _by_number(names)
    by_name = {name: name for name in names if name in robot}
    problem = f"{', '.join(extra)} of the log and {', '.join(missing)} of the robot have no partner of the same name"
    if ordered is None or len(names) != len(robot):
        return JointGuess(sure=False, problem=problem, candidates={"equal names": by_name})
    return _open(problem, dict(zip(ordered, robot, strict=True)), by_name, "equal names")


def _counts_differ(names: Sequence[str], robot: Sequence[str], by_words: Mapping[str, str]) -> JointGuess:
    candidates = {"words of their names": by_words} if by_words else {}
    if by_order := first_in_order(names, robot):
        candidates["the first of the robot, in order"] = by_order
    problem = f"the log has {len(names)} joints and the robot {len(robot)}, under other names"
    if len(names) > len(robot):
        problem += ": it may be the log of another arm"
    return JointGuess(sure=False, problem=problem, candidates=candidates, chains=_chains(len(names), robot))


def _chains(count: int, robot: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    """Sets of so many of the robot's joints that have a word of their names in common, such as a side: at most four."""
    by_word: dict[str, list[str]] = {}
    for joint in robot:
        for word in sorted(_words(joint)):
            by_word.setdefault(word, []).append(joint)
    found = dict.fromkeys(tuple(joints) for joints in by_word.values() if len(joints) == count < len(robot))
    return tuple(found)[:_MOST_CHAINS]


def _in_order(names: Sequence[str], arm: Sequence[str]) -> JointGuess:
    """Names that neither numbers nor words decide: by order, unless a word speaks against it."""
    by_order = dict(zip(names, arm, strict=True))
    if all(_shared(name, own) == max(_shared(name, joint) for joint in arm) for name, own in by_order.items()):
        return JointGuess(by_order, "same place in the order of joints", sure=False)
    problem = "the order of the log's joints and their names say different things"
    return JointGuess(sure=False, problem=problem, candidates={"the order of the log": by_order})


def _shared(one: str, other: str) -> int:
    common = _words(one) & _words(other)
    return len(common) if any(not word.isdigit() for word in common) else 0


def _words(name: str) -> set[str]:
    return {word for word in re.split(r"[^a-z0-9]+", name.lower()) if word} - {"joint"}


def _letters(name: str) -> set[str]:
    return set(re.findall("[a-z]+", name.lower())) - {"joint"}


def _natural(name: str) -> list[tuple[int, str]]:
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", name.lower()) if part]
