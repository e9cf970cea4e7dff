"""What is wrong with a configuration, said so that it can be mended: line, found, expected, did-you-mean.

Values are checked by msgspec, key by key, so that every problem is found and not the first alone.
"""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from collaudit.core.config.config_table import ConfigTable, KeyedError, fits
from collaudit.core.config.describe import Key, all_keys, keys_of, value_text
from collaudit.core.config.schema import Config
from collaudit.core.config.toml_lines import KeyPath
from collaudit.core.config.toml_text import to_toml
from collaudit.core.errors import ConfigError

_LONGEST = 60
#: Problems that are listed: nobody mends more at a time.
_MOST = 100


class CombinedConfigError(ConfigError):
    """Several problems of one configuration.

    Attributes:
        problems: one error each, in the order of their lines; the first hundred.
    """

    def __init__(self, problems: Sequence[ConfigError]) -> None:
        part = f", the first {_MOST} of them" if len(problems) > _MOST else ""
        super().__init__(f"{len(problems)} problems in the configuration{part}")
        self.problems = tuple(problems[:_MOST])

    def render(self) -> str:
        """All problems, one under the other."""
        return "\n".join([f"{self.message}:", *(problem.render() for problem in self.problems)])


@dataclass(frozen=True, slots=True)
class Places:
    """Where keys of the effective configuration come from.

    Attributes:
        file: the file, None without one.
        lines: of its keys.
        overridden: keys that the command line states.
    """

    file: str | None
    lines: Mapping[KeyPath, int]
    overridden: Sequence[KeyPath]

    def line(self, path: KeyPath) -> int:
        """Line of the innermost known part of the path; 0 when the file does not have it."""
        return next((self.lines[path[:end]] for end in range(len(path), 0, -1) if path[:end] in self.lines), 0)

    def text(self, path: KeyPath) -> str:
        """``file:line``, or the command line."""
        stated = any(path[: len(top)] == top or top[: len(path)] == path for top in self.overridden)
        if stated or not self.file:
            return "command line"
        line = self.line(path)
        return f"{self.file}:{line}" if line else self.file


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that does not fit.

    Attributes:
        path: where it lies in the data; of a missing key, where it would.
        text: what is wrong.
        found, expected, hint: as of the error that is made of it.
    """

    path: KeyPath
    text: str
    found: str | None = None
    expected: str | None = None
    hint: str | None = None


def syntax_problem(error: tomllib.TOMLDecodeError, file: str) -> ConfigError:
    """A TOML syntax error with its line."""
    match = re.match(r"(.*) \(at line (\d+), column (\d+)\)$", str(error))
    if match is None:
        return ConfigError(f"not valid TOML: {error}", where=file, hint="see https://toml.io for the syntax")
    text, line, column = match.groups()
    return ConfigError(
        f"not valid TOML: {text[:1].lower()}{text[1:]} (column {column})",
        where=f"{file}:{line}",
        hint="text needs quotes, and every key stands as key = value; see https://toml.io",
    )


def schema_problems(data: Mapping[str, Any], places: Places) -> ConfigError:
    """What does not fit the schema, as one error that lists every problem once, in the order of the file."""
    found = sorted(problems_of(data), key=lambda problem: places.line(problem.path))
    errors = [
        ConfigError(each.text, where=places.text(each.path), found=each.found, expected=each.expected, hint=each.hint)
        for each in found
    ]
    return errors[0] if len(errors) == 1 else CombinedConfigError(errors)


def problems_of(data: Mapping[str, Any], table: type[ConfigTable] = Config, path: KeyPath = ()) -> list[Problem]:
    """The problems of a table's decoded TOML; what it states of its keys is asked where each of them is right."""
    keys = {key.path[-1]: key for key in keys_of(table)}
    found: list[Problem] = []
    for name, value in data.items():
        if name in keys:
            found += _problems_of_value(keys[name], value, (*path, name))
        else:
            found.append(_unknown_key((*path, name), value, tuple(keys)))
    for name, key in keys.items():
        if key.field.required and name not in data:
            text = f"[{_dotted(path)}] has no {name}"
            found.append(Problem((*path, name), text, hint="docs/config.md lists what is required"))
    return found or list(_stated(data, table, path))


def _problems_of_value(key: Key, value: Any, path: KeyPath) -> list[Problem]:
    """What is wrong with the value of a key: of tables in them, of single items and entries where they are wrong."""
    if key.table is not None and key.shape == "table" and isinstance(value, Mapping):
        return problems_of(value, key.table, path)
    if isinstance(value, list) and fits([], key.field.type):
        parts: dict[str | int, tuple[Any, Any]] = {index: (item, [item]) for index, item in enumerate(value)}
    elif isinstance(value, Mapping) and fits({}, key.field.type):
        parts = {name: (inner, {name: inner}) for name, inner in value.items()}
    else:
        return [] if fits(value, key.field.type) else [_wrong_value(key, value, path)]
    found = []
    for name, (inner, alone) in parts.items():
        if key.table is not None and isinstance(inner, Mapping):
            found += problems_of(inner, key.table, (*path, name))
        elif not fits(alone, key.field.type):
            found.append(_wrong_value(key, inner, (*path, name)))
    return found


def _stated(data: Mapping[str, Any], table: type[ConfigTable], path: KeyPath) -> Iterator[Problem]:
    """What a table whose keys are each right says of them together."""
    try:
        table.of(data)
    except msgspec.ValidationError as error:
        stated = error.__cause__
        if not isinstance(stated, KeyedError):
            yield Problem(path, f"[{_dotted(path)}] {stated or error}")
        elif stated.text:
            yield Problem((*path, stated.key), f"{_dotted((*path, stated.key))}: {stated.text}")
        else:
            key = next(key for key in keys_of(table) if key.path[-1] == stated.key)
            yield _wrong_value(key, data[stated.key], (*path, stated.key))


def _wrong_value(key: Key, value: object, path: KeyPath) -> Problem:
    expected = value_text(key)
    hint = _similar_choice(value, expected) if isinstance(value, str) else None
    return Problem(path, f"{_dotted(path)} has a value that cannot be used", _short(value), expected, hint)


def _unknown_key(path: KeyPath, value: object, siblings: Sequence[str]) -> Problem:
    *front, last = path
    close = difflib.get_close_matches(str(last), siblings, n=1, cutoff=0.6)
    likely = close or [key.dotted for key in all_keys() if key.path[-1] == last and not _repeats(key.path)]
    return Problem(
        path,
        f"{f'[{_dotted(tuple(front))}]' if front else 'the file'} has no key {str(last)!r}",
        found=f"[{_dotted(path)}]" if isinstance(value, Mapping) else f"{last} = {_short(value)}",
        expected=", ".join(siblings),
        hint=f"did you mean {' or '.join(likely)}?" if likely else None,
    )


def _repeats(path: tuple[str, ...]) -> bool:
    """Whether a key says for some logs what another one says for all."""
    return path[:1] == ("fleet",) or path[:2] in (("policy", "overrides"), ("policy", "waivers"))


def _similar_choice(value: str, expected: str) -> str | None:
    choices = {choice.lower(): choice for choice in re.findall(r'"([^"]+)"', expected)}
    close = difflib.get_close_matches(value.lower(), choices, n=1, cutoff=0.5)
    return f'did you mean "{choices[close[0]]}"?' if close else None


def _dotted(path: KeyPath) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).removeprefix(".")


def _short(value: object) -> str:
    try:
        text = "nothing" if value is None else to_toml(value)
    except ValueError:  # from code, and no TOML
        text = repr(value)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"
