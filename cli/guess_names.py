"""A guess which joint of a log is which joint of the robot, where their names differ."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from dataclasses import dataclass

_ALIKE = 0.5
_ORDER_HOLDS = 0.8


@dataclass(frozen=True, slots=True)
class NameGuess:
    """One guessed pair.

    Attributes:
        log: name in the log.
        model: name in the robot model.
        why: what the guess rests on.
    """

    log: str
    model: str
    why: str


def guess_names(log_names: Sequence[str], model_names: Sequence[str]) -> list[NameGuess]:
    """Pair the log's joints that the model does not know with the model's joints that the log lacks.

    Equal names are no guess and are left out. Where nothing matches by name and the numbers are equal, the
    order decides unless the names clearly speak against it; otherwise only names that look alike are paired.
    """
    strangers = [name for name in log_names if name not in model_names]
    free = [name for name in model_names if name not in log_names]
    if not strangers or not free:
        return []
    alike = _by_likeness(strangers, free)
    in_order = list(zip(strangers, free, strict=False))
    if len(strangers) == len(free) == len(model_names) and _sum(in_order) >= _ORDER_HOLDS * _sum(alike):
        return [NameGuess(log, model, "same place in the order of joints") for log, model in in_order]
    return [
        NameGuess(log, model, _why(log, model))
        for log, model in sorted(alike, key=lambda pair: strangers.index(pair[0]))
        if likeness(log, model) >= _ALIKE
    ]


def likeness(one: str, other: str) -> float:
    """How alike two joint names are, 0 to 1.

    Case, punctuation and the word joint do not count; where both names hold a number, it weighs half.
    """
    letters = difflib.SequenceMatcher(None, _core(one), _core(other)).ratio()
    if not _numbers(one) or not _numbers(other):
        return letters
    return 0.5 * letters + 0.5 * (_numbers(one) == _numbers(other))


def _why(log: str, model: str) -> str:
    same = bool(_numbers(log)) and _numbers(log) == _numbers(model)
    return "the same number in both names" if same else "names look alike"


def _numbers(name: str) -> list[str]:
    return re.findall(r"\d+", name)


def _by_likeness(strangers: Sequence[str], free: Sequence[str]) -> list[tuple[str, str]]:
    pairs = sorted(((log, model) for log in strangers for model in free), key=lambda pair: -likeness(*pair))
    chosen: list[tuple[str, str]] = []
    for log, model in pairs:
        if all(log != taken and model != gone for taken, gone in chosen):
            chosen.append((log, model))
    return chosen


def _sum(pairs: Sequence[tuple[str, str]]) -> float:
    return sum(likeness(*pair) for pair in pairs)


def _core(name: str) -> str:
    return re.sub(r"[^a-z0-9]|joint", "", name.lower()) or name.lower()
