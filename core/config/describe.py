"""The schema in words: what a key accepts, which keys a table has, and what is wrong with a value.

msgspec checks the values and stops at the first that does not fit; what it says is put at its place in the file, with
what was found, what was expected, and a near match.
"""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import msgspec
from msgspec import inspect

from collaudit.core.config.config_table import ConfigTable, KeyedError
from collaudit.core.config.schema import Config
from collaudit.core.errors import ConfigError
from collaudit.core.friction_laws.law_registry import NameOfLaw
from collaudit.core.small_files import KeyPath, to_toml

#: Dotted key, names that a user chose left out, and what to do instead.
REMOVED: Mapping[str, str] = {
    "cycles.least": "take the line out: a reference needs four other cycles, or nights",
    "detect.friction_level": "take the line out: the level of friction is always followed",
    "fit.max_samples": "take the line out: sums of all motion are fitted, as fast as the filter lets it change",
    "fleet.robots.serials": "tell the robot's logs by `paths`, `topics` or `joints`",
    "log.csv.also": "name the further files beside the log on the command line",
    "log.csv.labels": "state the columns in [log] `labels`",
    "log.csv.phase": "state the column in [log] `phase`",
    "log.csv.skip_rows": "state the number of the line that holds the names, one more, as [log.csv] `header`",
    "log.fields.wrench_stamp": "take the line out: [log.fields] `stamp` is read on both topics",
    "log.label_topics": "state the topics in [log] `labels`",
    "log.phase_topic": "state the topic in [log] `phase`",
    "plan.link_radius_m": "give the link a shape in the description (URDF collision), which is then used",
    "policy.accepted": "put accepted.toml beside the configuration, and take the line out",
    "policy.findings": "take the line out: what a finding does to the verdict, docs/findings.md says",
    "policy.max_fit_age_days": "take the line out; friction.json says when its logs were recorded",
    "policy.observable_ms": "take the line out: the push that must alarm lasts 0.2 s",
    "robot.gravity_m_s2": "say how the arm is mounted by [robot] `base_rpy_deg`",
}


@dataclass(frozen=True, slots=True)
class Need:
    """What a key needs for an effect.

    Attributes:
        key: dotted.
        needs: the line that goes with it, in words.
        holds: whether a configuration has it.
    """

    key: str
    needs: str
    holds: Callable[[Config], bool]


#: All keys of which that is known.
NEEDS = (
    Need(
        "log.units.torque_constant_nm_per_a",
        '[log.units] effort = "A" or "mA"',
        lambda config: config.log.units.effort in ("A", "mA"),
    ),
    Need(
        "log.units.rated_torque_nm",
        '[log.units] effort = "percent" or "permille"',
        lambda config: config.log.units.effort in ("percent", "permille"),
    ),
    Need("robot.dh_convention", "[[robot.dh]] rows", lambda config: bool(config.robot.dh)),
    Need("robot.motor_side", "[robot] reduction", lambda config: config.robot.reduction is not None),
    Need(
        "robot.tool.com_m",
        "[robot.tool] mass_kg",
        lambda config: "mass_kg" in config.robot.tool.given and config.robot.tool.mass_kg != "estimate",
    ),
    Need(
        "detect.observer_gain_per_s",
        "[detect] detector with an observer, not direct",
        lambda config: config.detect.detector != "direct",
    ),
)


def without_effect(config: Config) -> tuple[Need, ...]:
    """Keys that the configuration states and that do nothing in it."""
    return tuple(need for need in NEEDS if _states(config, need.key) and not need.holds(config))


def _states(config: Config, dotted: str) -> bool:
    *tables, key = dotted.split(".")
    table: ConfigTable = config
    for name in tables:
        table = getattr(table, name)
    return key in table.given


_PLAIN: dict[type[inspect.Type], str] = {
    inspect.StrType: "text",
    inspect.BoolType: "true or false",
    inspect.CustomType: "a file name",
    inspect.DateType: "a date",
    inspect.FloatType: "a number",
    inspect.IntType: "a whole number",
    inspect.StructType: "a table",
}
_BOUNDS = (
    ("gt", "above {:g}"),
    ("ge", "{:g} or more"),
    ("lt", "below {:g}"),
    ("le", "at most {:g}"),
)
_LONGEST = 60
#: How msgspec speaks of a table's keys, and of places: ``$.robot.dh[1].a``; names that a user chose are ``[...]``.
_UNKNOWN = re.compile(r"Object contains unknown field `(.*)`", re.DOTALL)
_MISSING = re.compile(r"Object missing required field `(.*)`")
_PART = re.compile(r"\.([^.\[\]`]+)|\[(\d+)\]")


@dataclass(frozen=True, slots=True)
class Key:
    """One key of the configuration.

    Attributes:
        path: its name with the tables it is in; an array of tables stands as its name.
        field: the field of its table.
        holder: the class of that table.
        table: the class, when the key is a table or holds tables.
        shape: a ``value``, a ``table``, an ``array`` of tables, or tables ``by-name``.
    """

    path: tuple[str, ...]
    field: msgspec.structs.FieldInfo
    holder: type[msgspec.Struct]
    table: type[msgspec.Struct] | None
    shape: Literal["value", "table", "array", "by-name"]

    @property
    def dotted(self) -> str:
        """The path as in TOML."""
        return ".".join(self.path)


def keys_of(model: type[msgspec.Struct], front: tuple[str, ...] = ()) -> tuple[Key, ...]:
    """The keys of one table, in the order of the schema."""
    return tuple(_key((*front, field.name), field, model) for field in msgspec.structs.fields(model))


def all_keys(model: type[msgspec.Struct] = Config, front: tuple[str, ...] = ()) -> Iterator[Key]:
    """Every key of the configuration, tables before what is in them."""
    for key in keys_of(model, front):
        yield key
        if key.table is not None:
            yield from all_keys(key.table, key.path)


def value_text(key: Key) -> str:
    """What a key accepts, in words: ``a number above 0, or a table of them by name``."""
    laws = choices_of_laws(key.field.type)
    return " or ".join(map(to_toml, laws)) if laws else _text(inspect.type_info(key.field.type))


def choices_of_laws(annotation: Any) -> tuple[str, ...]:
    """The names that a key or field of a friction law accepts; none when it is not one."""
    if isinstance(annotation, NameOfLaw):
        return annotation.choices
    return next((found for part in get_args(annotation) if (found := choices_of_laws(part))), ())


def _key(path: tuple[str, ...], field: msgspec.structs.FieldInfo, holder: type[msgspec.Struct]) -> Key:
    kind = _bare(inspect.type_info(field.type))
    if isinstance(kind, inspect.StructType):
        return Key(path, field, holder, kind.cls, "table")
    if isinstance(kind, inspect.ListType) and isinstance(kind.item_type, inspect.StructType):
        return Key(path, field, holder, kind.item_type.cls, "array")
    if isinstance(kind, inspect.DictType) and isinstance(kind.value_type, inspect.StructType):
        return Key(path, field, holder, kind.value_type.cls, "by-name")
    return Key(path, field, holder, None, "value")


def _bare(kind: inspect.Type) -> inspect.Type:
    """Without notes, and of a table that may be absent the table."""
    while isinstance(kind, inspect.Metadata):
        kind = kind.type
    kinds = kind.types if isinstance(kind, inspect.UnionType) else ()
    return next((one for one in kinds if isinstance(one, inspect.StructType)), kind)


def _text(kind: inspect.Type) -> str:
    if isinstance(kind, inspect.Metadata):
        return _text(kind.type)
    if isinstance(kind, inspect.LiteralType):
        return " or ".join(map(to_toml, kind.values))
    if isinstance(kind, inspect.UnionType):
        return ", or ".join(_text(one) for one in kind.types if not isinstance(one, inspect.NoneType))
    if isinstance(kind, inspect.TupleType):
        return f"[{', '.join(_text(one).removeprefix('a ') for one in kind.item_types)}]"
    if isinstance(kind, inspect.ListType):
        item = kind.item_type
        kinds = item.types if isinstance(item, inspect.UnionType) else (item,)  # one kind in a list
        return ", or ".join(f"a list of {_plural(_text(one))}" for one in kinds)
    if isinstance(kind, inspect.DictType):
        return f"a table of name = {_text(kind.value_type)}"
    limits = [form.format(limit) for name, form in _BOUNDS if (limit := getattr(kind, name, None)) is not None]
    if shortest := getattr(kind, "min_length", None):
        limits.append("that is not empty" if shortest == 1 else f"of at least {shortest} characters")
    return f"{_PLAIN[type(kind)]} {' and '.join(limits)}".rstrip()


def _plural(text: str) -> str:
    noun = re.match(r"an? (whole number|number|file name|table)", text)
    return f"{noun.group(1)}s{text[noun.end() :]}" if noun else text


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


def schema_problem(
    error: msgspec.ValidationError,
    data: Mapping[str, object],
    places: Places,
    model: type[msgspec.Struct],
) -> ConfigError:
    """The first value that does not fit the schema, with its line.

    Args:
        error: what msgspec says.
        data: the decoded TOML.
        places: of its keys.
        model: the schema.
    """
    said, _, place = str(error).partition(" - at ")
    path: KeyPath = tuple(int(number) if number else name for name, number in _PART.findall(place))
    stated = error.__cause__
    if unknown := _UNKNOWN.match(said):
        return _unknown_key((*path, unknown[1]), places, model)
    if missing := _MISSING.match(said):
        text = f"[{_dotted(path)}] has no {missing[1]}"
        return ConfigError(text, where=places.text(path), hint=f"{_page_of(model)} lists what is required")
    if isinstance(stated, KeyedError):
        path = (*path, stated.key)
        if stated.text:
            return ConfigError(f"{_dotted(path)}: {stated.text}", where=places.text(path))
    elif isinstance(stated, ValueError):
        return ConfigError(f"[{_dotted(path)}] {said}", where=places.text(path))
    return _wrong_value(said, path, data, places, model)


def _page_of(model: type[msgspec.Struct]) -> str:
    return "docs/config.md" if model is Config else "docs/fleet.md"


def _wrong_value(
    said: str, path: KeyPath, data: Mapping[str, object], places: Places, model: type[msgspec.Struct]
) -> ConfigError:
    names = tuple(part for part in path if isinstance(part, str))
    key = next((key for key in all_keys(model) if key.path == names), None)
    value = _value_at(path, data)
    expected = said if key is None else value_text(key)
    hint = _similar_choice(value, expected) if isinstance(value, str) else None
    text = f"{_dotted(path)} has a value that cannot be used"
    found = None if value is None else _short(value)
    return ConfigError(text, where=places.text(path), found=found, expected=expected, hint=hint)


def _unknown_key(path: KeyPath, places: Places, model: type[msgspec.Struct]) -> ConfigError:
    *front, last = path
    names = tuple(part for part in front if isinstance(part, str))
    holder = next((key.table for key in all_keys(model) if key.path == names and key.table is not None), model)
    siblings = [key.path[-1] for key in keys_of(holder)]
    instead = REMOVED.get(".".join((*names, str(last)))) if model is Config else None
    if instead is not None:
        text = f"[{_dotted(tuple(front))}] has no key {str(last)!r} any more"
        return ConfigError(text, where=places.text(path), hint=instead)
    close = difflib.get_close_matches(str(last), siblings, n=1, cutoff=0.6)
    likely = close or [key.dotted for key in all_keys(model) if key.path[-1] == last and key.path[:1] != ("fleet",)]
    return ConfigError(
        f"{f'[{_dotted(tuple(front))}]' if front else 'the file'} has no key {str(last)!r}",
        where=places.text(path),
        expected=", ".join(siblings),
        hint=f"did you mean {' or '.join(likely)}?" if likely else None,
    )


def _similar_choice(value: str, expected: str) -> str | None:
    choices = {choice.lower(): choice for choice in re.findall(r'"([^"]+)"', expected)}
    close = difflib.get_close_matches(value.lower(), choices, n=1, cutoff=0.5)
    return f'did you mean "{choices[close[0]]}"?' if close else None


def _value_at(path: KeyPath, data: object) -> object:
    """What stands at a place; None below a name that a user chose, which msgspec does not name."""
    for part in path:
        if isinstance(data, Mapping):
            data = data.get(part)
        elif isinstance(data, list) and isinstance(part, int):
            data = data[part]
    return data


def _dotted(path: KeyPath) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).removeprefix(".")


def _short(value: object) -> str:
    try:
        text = to_toml(value)
    except ValueError:  # from code, and no TOML
        text = repr(value)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"
