"""What is wrong with a configuration, said so that it can be mended: line, found, expected, did-you-mean."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Mapping, Sequence
from functools import reduce
from typing import Any

from collaudit.core.config.describe import all_keys, find_key, keys_of, value_text
from collaudit.core.config.schema import Config
from collaudit.core.config.toml_lines import KeyPath
from collaudit.core.config.toml_text import to_toml
from collaudit.core.config.value_problems import MOST_PROBLEMS, ValueProblem, value_problems
from collaudit.core.errors import ConfigError

_LONGEST = 60


class CombinedConfigError(ConfigError):
    """Several problems of one configuration, all listed.

    Attributes:
        problems: one error each, in the order of their lines.
    """

    def __init__(self, problems: Sequence[ConfigError], at_least: str = "") -> None:
        super().__init__(f"{at_least}{len(problems)} problems in the configuration")
        self.problems = tuple(problems)

    def render(self) -> str:
        """All problems, one under the other."""
        return "\n".join([f"{self.message}:", *(problem.render() for problem in self.problems)])


class Places:
    """Where keys of the effective configuration come from: a line of the file, or the command line."""

    def __init__(self, file: str | None, lines: Mapping[KeyPath, int], overridden: Sequence[KeyPath]) -> None:
        self._file = file
        self._lines = lines
        self._overridden = tuple(overridden)

    def line(self, path: KeyPath) -> int:
        """Line of the innermost known part of the path; 0 when the file does not have it."""
        for end in range(len(path), 0, -1):
            if path[:end] in self._lines:
                return self._lines[path[:end]]
        return 0

    def text(self, path: KeyPath) -> str:
        """``file:line``, or the command line."""
        if any(path[: len(top)] == top or top[: len(path)] == path for top in self._overridden):
            return "command line"
        line = self.line(path)
        return (f"{self._file}:{line}" if line else self._file) if self._file else "command line"


def syntax_problem(error: tomllib.TOMLDecodeError, file: str) -> ConfigError:
    """A TOML syntax error with its line."""
    match = re.match(r"(.*) \(at line (\d+), column (\d+)\)$", str(error))
    if match is None:
        return ConfigError(f"not valid TOML: {error}", where=file, hint="see https://toml.io for the syntax")
    text, line, column = match.groups()
    return ConfigError(
        f"not valid TOML: {_lower(text)} (column {column})",
        where=f"{file}:{line}",
        hint="text needs quotes, and every key stands as key = value; see https://toml.io",
    )


def schema_problems(data: Mapping[str, Any], places: Places) -> ConfigError:
    """What does not fit the schema, as one error that lists every problem once, in the order of the file."""
    found = sorted(value_problems(data), key=lambda problem: (places.line(problem.path), _indices(problem.path)))
    problems = [_problem(problem, data, places) for problem in found]
    if len(problems) == MOST_PROBLEMS:
        return CombinedConfigError(problems, "at least ")
    return problems[0] if len(problems) == 1 else CombinedConfigError(problems)


def _indices(path: KeyPath) -> tuple[int, ...]:
    return tuple(part for part in path if isinstance(part, int))


def _problem(problem: ValueProblem, data: Mapping[str, object], places: Places) -> ConfigError:
    path = problem.path
    name, where = _dotted(path), places.text(path)
    if problem.kind == "unknown":
        return _unknown_key(path, data, where)
    if problem.kind == "missing":
        return ConfigError(
            f"[{_dotted(path[:-1])}] has no {path[-1]}",
            where=places.text(path[:-1]),
            hint="docs/config.md lists what is required",
        )
    value = _lookup(path, data)
    if problem.kind == "states":
        text = problem.text
        return ConfigError(f"[{name}] {text}" if isinstance(value, Mapping) else f"{name}: {text}", where=where)
    key = find_key(path)
    expected = value_text(key) if key else None
    hint = _similar_choice(value, expected) if expected and isinstance(value, str) else None
    return ConfigError(
        f"{name} has a value that cannot be used", where=where, found=_short(value), expected=expected, hint=hint
    )


def _unknown_key(path: KeyPath, data: Mapping[str, object], where: str) -> ConfigError:
    *front, last = path
    table = find_key(tuple(front)) if front else None
    model = table.table if table else Config
    siblings = [key.path[-1] for key in keys_of(model)] if model else []
    close = difflib.get_close_matches(str(last), siblings, n=1, cutoff=0.6)
    elsewhere = [key.dotted for key in all_keys() if key.path[-1] == last and not _repeats(key.path)]
    if close:
        hint = f"did you mean {close[0]}?"
    elif elsewhere:
        hint = f"did you mean {' or '.join(elsewhere)}?"
    else:
        hint = None
    place = f"[{_dotted(tuple(front))}]" if front else "the file"
    value = _lookup(path, data)
    found = f"[{_dotted(path)}]" if isinstance(value, Mapping) else f"{last} = {_short(value)}"
    return ConfigError(
        f"{place} has no key {str(last)!r}", where=where, found=found, expected=", ".join(siblings), hint=hint
    )


def _repeats(path: tuple[str, ...]) -> bool:
    """Whether a key says for some logs what another one says for all."""
    return path[:1] == ("fleet",) or path[:2] in (("policy", "overrides"), ("policy", "waivers"))


def _similar_choice(value: str, expected: str) -> str | None:
    choices = re.findall(r'"([^"]+)"', expected)
    close = difflib.get_close_matches(value.lower(), [c.lower() for c in choices], n=1, cutoff=0.5)
    match = [c for c in choices if close and c.lower() == close[0]]
    return f'did you mean "{match[0]}"?' if match else None


def _step(data: object, part: str | int) -> object:
    if isinstance(data, Mapping):
        return data[part]
    return data[part] if isinstance(data, list) and isinstance(part, int) else None


def _lookup(path: KeyPath, data: object) -> object:
    return reduce(_step, path, data)


def _dotted(path: KeyPath) -> str:
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}"
    return text.removeprefix(".")


def _short(value: object) -> str:
    try:
        text = "nothing" if value is None else to_toml(value)
    except ValueError:  # from code, and no TOML
        text = repr(value)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:]
