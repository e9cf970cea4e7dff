"""Every problem of a configuration's values: msgspec names the first, which is taken out before it is asked again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import msgspec

from collaudit.core.config.config_table import KeyedError, out_of_range
from collaudit.core.config.describe import find_key
from collaudit.core.config.misfit_place import at_place, misfit_place
from collaudit.core.config.schema import Config
from collaudit.core.config.toml_lines import KeyPath


@dataclass(frozen=True, slots=True)
class ValueProblem:
    """One thing that does not fit.

    Attributes:
        path: where it lies in the data; of a missing key, where it would.
        kind: an ``unknown`` key; a ``missing`` one; a ``value`` that the key does not accept; or what the table
            ``states`` about its keys.
        text: the table's own words.
    """

    path: KeyPath
    kind: Literal["unknown", "missing", "value", "states"]
    text: str = ""


#: Problems that are looked for: finding one takes the longer the more there are, and nobody mends more at a time.
MOST_PROBLEMS = 100


def value_problems(data: Mapping[str, Any]) -> list[ValueProblem]:
    """The problems of a configuration's decoded TOML, up to :data:`MOST_PROBLEMS`; none when it fits."""
    rest = _Rest(data)
    problems: list[ValueProblem] = []
    begin: dict[KeyPath, int] = {}
    while len(problems) < MOST_PROBLEMS:
        try:
            Config.of(rest.data)
        except msgspec.ValidationError as error:
            found, out = _problems_of(error, rest.data, begin)
        else:
            break
        # What a table states is not asked of one that lost keys to earlier problems, nor are those keys missing, nor is
        # an array short by items that were taken out.
        told = [
            replace(problem, path=rest.place(problem.path))
            for problem in found
            if not rest.is_touched(problem.path if problem.kind == "missing" else out, problem.kind)
        ]
        problems += told
        rest.take_out(out, bool(told) and all(problem.kind in ("unknown", "value") for problem in told))
    problems += [ValueProblem(path, "value") for path in rest.out_of_range]
    return problems[:MOST_PROBLEMS]


class _Rest:
    """What is left of a configuration when problems are taken out of it."""

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.data: dict[str, Any] = _copied(data)
        #: Places of numbers out of range, where nothing else is wrong; plain ones stand in for them.
        self.out_of_range = set(out_of_range(data))
        for path in self.out_of_range:
            at_place(path[:-1], self.data)[path[-1]] = 1.0
        self._taken: list[KeyPath] = []
        self._moved: dict[KeyPath, int] = {}

    def take_out(self, path: KeyPath, whole_is_wrong: bool) -> None:
        """Remove a value; an item of an array with those before it, which are right.

        Where the whole value is wrong, nothing is said of numbers in it.
        """
        *front, last = path
        whole = self.place(path)
        self._taken.append(whole)
        if whole_is_wrong:
            self.out_of_range = {other for other in self.out_of_range if other[: len(whole)] != whole}
        holder = at_place(tuple(front), self.data)
        if isinstance(last, int):
            del holder[: last + 1]
            self._moved[tuple(front)] = self._moved.get(tuple(front), 0) + last + 1
        else:
            del holder[last]

    def is_touched(self, path: KeyPath, kind: str) -> bool:
        """Whether something was taken out of the value at a place, or is to be before its table states anything."""
        whole = self.place(path)
        changed = [*self._taken, *self.out_of_range] if kind == "states" else self._taken
        return any(taken[: len(whole)] == whole for taken in changed)

    def place(self, path: KeyPath) -> KeyPath:
        """Where the value at a place of what is left stands in the whole."""
        return tuple(
            part + self._moved.get(path[:end], 0) if isinstance(part, int) else part for end, part in enumerate(path)
        )


def _copied(value: Any) -> Any:
    """Dictionaries and lists that can be changed, in the place of mappings, lists and tuples."""
    if isinstance(value, Mapping):
        return {name: _copied(inner) for name, inner in value.items()}
    return [_copied(inner) for inner in value] if isinstance(value, list | tuple) else value


def _problems_of(
    error: msgspec.ValidationError, data: dict[str, Any], begin: dict[KeyPath, int]
) -> tuple[list[ValueProblem], KeyPath]:
    """The problems that an error names, and what has to be taken out for the next to be found."""
    path = misfit_place(error, data, Config.of, begin)
    text = str(error)
    if text.startswith(("Object contains unknown field", "Object missing required field")):
        key = find_key(path)
        table = key.table if key is not None and key.table is not None else Config
        fields = msgspec.structs.fields(table)
        there = at_place(path, data)
        if text.startswith("Object contains"):
            name = next(name for name in there if name not in table.__struct_fields__)
            return [ValueProblem((*path, name), "unknown")], (*path, name)
        absent = [field.name for field in fields if field.required and field.name not in there]
        return [ValueProblem((*path, name), "missing") for name in absent], path
    stated = error.__cause__
    if isinstance(stated, KeyedError):
        path = (*path, stated.key)
        return [ValueProblem(path, "states" if stated.text else "value", stated.text or "")], path
    if isinstance(stated, ValueError):
        return [ValueProblem(path, "states", str(stated))], path
    return [ValueProblem(path, "value")], path
