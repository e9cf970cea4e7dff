"""Which columns are which signal, by their names alone: numbered ones by the vocabulary, others by their joints."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from collaudit.core.logs.tables.column_groups import Choice, Group, choose, numbered_groups, with_unknown
from collaudit.core.logs.tables.column_patterns import Found, bare, match_pattern, without_unit
from collaudit.core.logs.tables.column_vocabulary import words_of
from collaudit.core.vendors.column_words import QUANTITY_WORDS, ROLE_WORDS, UNIT_WORDS

#: Words of columns that are named by their joints, the usual first.
_WORDS = {
    "position": ("position", "pos", "q", "angle", "theta", "jpos", "positions"),
    "velocity": ("velocity", "vel", "dq", "qd", "speed", "qdot", "q_dot", "theta_dot", "jvel", "omega", "velocities"),
    "effort": ("effort", "eff", "tau", "torque", "current", "moment", "efforts"),
    "temperature": ("temperature", "temp", "temperatures"),
}
_NAMED_FORMS = ("{joint}_{word}", "{word}_{joint}", "{joint}.{word}", "{word}.{joint}", "{joint}/{word}",
                "{joint} {word}", "{word} {joint}", "{word}/{joint}")  # fmt: skip
#: What stands between a joint's name and the word.
_BETWEEN = "_./ "
_QUALIFIED = ("actual_{word}", "measured_{word}", "{word}_actual", "{word}_measured", "actual/{word}", "{word}")
#: Words that no joint's name begins or ends with: the column is no measurement of it, or of no joint.
_NO_JOINT = frozenset({*(word for role in ("desired", "commanded", "model", "external", "error", "derivative")
                         for word in ROLE_WORDS[role] if len(word) > 1),
                       "d", "act", "actual", "measured", "meas", "step", "index", "idx", "x", "y", "z", "w", "roll",
                       "pitch", "yaw", "rx", "ry", "rz", "norm", "rms", "mean", "std", "count", "orientation",
                       *UNIT_WORDS} - {"a", "id"})  # fmt: skip
#: Words that no joint's name holds anywhere: the column is of another quantity than the word beside it.
_QUANTITIES = frozenset({*(word for words in QUANTITY_WORDS.values() for word in words if len(word) > 1),
                         *ROLE_WORDS["derivative"]})  # fmt: skip


def recognise(names: Sequence[str], time: int | None) -> tuple[dict[str, Found], dict[str, Choice]]:
    """Quantities by the names of their columns, and what the vocabulary says of the numbered ones."""
    free = [without_unit(name) if index != time else "" for index, name in enumerate(names)]
    groups = numbered_groups(free)
    known = {column for group in groups for column in group.columns}
    unnumbered = [name if index not in known and index != time else "" for index, name in enumerate(names)]
    first = choose(groups, "position")
    known_positions = first.taken or next(iter(first.open), None)
    joints = len(known_positions.columns) if known_positions is not None else None
    choices = {quantity: choose(groups, quantity, joints) for quantity in QUANTITY_WORDS}
    fast = choices["velocity"]
    if first.taken is not None and fast.taken is not None and fast.taken.meaning.motor:
        choices["velocity"] = Choice(None, (fast.taken, *fast.passed))  # of the other side of the gear
    found: dict[str, Found] = {}
    every = [name if index != time else "" for index, name in enumerate(names)]
    for quantity, choice in choices.items():
        named = _guess_named(unnumbered, quantity)
        numbered = _of_group(choice.taken) if choice.taken is not None else None
        if numbered is not None and named is not None and len(named.columns) >= len(numbered.columns):
            # as many joints have names without a number: those with one (wrist_1_joint) are named as well
            named = _guess_named(every, quantity) or named
        if numbered is not None and (named is None or len(named.columns) <= len(numbered.columns)):
            found[quantity] = numbered
        elif named is not None and not choice.open:
            found[quantity] = named
            unnumbered = [name if index not in named.columns else "" for index, name in enumerate(unnumbered)]
    used = {column for each in found.values() for column in each.columns}
    choices = with_unknown(choices, ["" if index in used else name for index, name in enumerate(free)])
    return {quantity: each for quantity, each in found.items() if not choices[quantity].open}, choices


def _of_group(group: Group) -> Found:
    joints = tuple(f"joint{number + 1}" for number in range(len(group.columns)))
    return Found(joints, group.columns, group.pattern, group.meaning.unit)


def _guess_named(names: Sequence[str], quantity: str) -> Found | None:
    """Columns that are named by their joints; "" for columns that are taken."""
    best: Found | None = None
    written = {form for name in names for form in (name.strip().lower(), bare(name).lower())}
    edges = {text[k:] for text in written for k in range(len(text)) if text[k] in _BETWEEN}
    edges |= {text[: k + 1] for text in written for k in range(len(text)) if text[k] in _BETWEEN}
    phrases = (form.format(word=word) for word in _WORDS[quantity] for form in _QUALIFIED)
    for pattern in (form.format(word=phrase, joint="{joint}") for phrase in phrases for form in _NAMED_FORMS):
        if pattern.replace("{joint}", "") not in edges:
            continue
        matched = match_pattern(names, pattern)
        found = None if matched is None else _of_joints(names, matched)
        if found is not None and (best is None or len(found.columns) > len(best.columns)):
            best = found
    return best


def _of_joints(names: Sequence[str], found: Found) -> Found | None:
    """Without columns of no joint, and with what stands before all joints' names as part of the pattern."""
    kept = [
        (joint, column)
        for joint, column in zip(found.joints, found.columns, strict=True)
        if (words := [re.sub(r"\d", "", word) for word in words_of(joint)])
        and _NO_JOINT.isdisjoint((words[0], words[-1]))
        and _QUANTITIES.isdisjoint(words)
    ]
    if not kept:
        return None
    paths = {joint.rpartition("/")[0] for joint, _ in kept}
    if len(paths) == 1 and (path := paths.pop()):
        found = replace(found, pattern=found.pattern.replace("{joint}", path + "/{joint}"))
        kept = [(joint.rpartition("/")[2], column) for joint, column in kept]
    return Found(tuple(joint for joint, _ in kept), tuple(column for _, column in kept), found.pattern)
