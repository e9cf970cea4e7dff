"""A commented configuration: what file and flags state, and sections of lines, each with why it says that."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from collaudit.core.config import LoadedConfig
from collaudit.core.config.config_table import ConfigTable
from collaudit.core.logs.log_summary import TopicInfo
from collaudit.core.logs.tables.column_roles import standard_unit
from collaudit.core.small_files import KeyPath, key_lines, read_small, to_toml, toml_key
from collaudit.reports.values.visible_text import visible

_MARK = "# GUESS:"


def given_keys(loaded: LoadedConfig, folder: Path, paths: Mapping[str, str]) -> Iterator[tuple[str, object]]:
    """Dotted keys that a file or a flag set, with their values; files as they were given where that finds them."""
    for key, value in _given(loaded.config):
        if key in paths:
            yield key, _placed(Path(paths[key]), folder)
        else:
            yield key, _plain(loaded.urdf_path if key == "robot.urdf" else value, folder)


def _given(table: ConfigTable, front: str = "") -> Iterator[tuple[str, object]]:
    """Keys of a table and of the tables in it, those that were given."""
    for name in table.__struct_fields__:
        value = getattr(table, name)
        if isinstance(value, ConfigTable):
            yield from _given(value, f"{front}{name}.")
        elif name in table.given:
            yield f"{front}{name}", value


def _placed(path: Path, folder: Path) -> str:
    """A path as a file in ``folder`` writes it: unchanged wherever that finds the same file."""
    if path.is_absolute() or path.resolve() == (folder / path).resolve():
        return str(path)
    return os.path.relpath(path, folder)


def _plain(value: object, folder: Path) -> object:
    if isinstance(value, ConfigTable):
        return {name: _plain(inner, folder) for name, inner in _given(value)}
    if isinstance(value, Path):
        return _placed(value, folder)
    if isinstance(value, list | tuple):
        return [_plain(inner, folder) for inner in value]
    if isinstance(value, dict):
        return {key: _plain(inner, folder) for key, inner in value.items()}
    return value


def guesses_of(path: Path | None, flags: Collection[str]) -> frozenset[KeyPath]:
    """Paths of the keys whose lines in a configuration file are marked as guesses.

    Args:
        path: the file, which has been read as a configuration; None for none.
        flags: dotted keys that flags state, which are no guesses.
    """
    if path is None:
        return frozenset()
    text = read_small(path).decode("utf-8-sig")
    lines = text.splitlines()
    stated = {tuple(flag.split(".")) for flag in flags}
    return frozenset(key for key, line in key_lines(text).items() if _MARK in lines[line - 1] and key not in stated)


_WIDTH = 110


@dataclass(frozen=True, slots=True)
class Line:
    """One key.

    Attributes:
        key: its name inside the section.
        value: its value; shown as an example when ``active`` is False.
        why: the evidence for the value.
        active: whether the line counts, or is commented out.
        guess: whether the value was not stated anywhere.
        choice: whether it is one answer to a question; then it is commented out, too.
    """

    key: str
    value: object
    why: str = ""
    active: bool = True
    guess: bool = False
    choice: bool = False

    @property
    def remark(self) -> str:
        """The evidence for the value, guesses marked."""
        return visible(f"GUESS: {self.why}" if self.guess else self.why)

    @property
    def text(self) -> str:
        """The line, or a comment that shows it."""
        shown = f"{toml_key(self.key)} = {to_toml(self.value)}" + (f"  # {self.remark}" if self.remark else "")
        return shown if self.active else f"# {shown}"


@dataclass(slots=True)
class Section:
    """One table with its remarks and lines."""

    name: str
    remarks: list[str] = field(default_factory=list)
    lines: list[Line] = field(default_factory=list)

    def add(
        self,
        key: str,
        value: object,
        why: str = "",
        *,
        active: bool = True,
        guess: bool = False,
        choice: bool = False,
    ) -> None:
        """Append a line."""
        self.lines.append(Line(key, value, why, active and not choice, guess, choice))

    def put(self, line: Line) -> None:
        """Put a line in place of the one of its key, or at the end."""
        for index, old in enumerate(self.lines):
            if old.key == line.key:
                self.lines[index] = line
                return
        self.lines.append(line)

    @property
    def live(self) -> bool:
        """Whether the table counts; one that has nothing but examples is a comment as a whole."""
        return any(line.active for line in self.lines) or not self.lines

    @property
    def rows(self) -> list[str]:
        """Its header, remarks and lines."""
        header = f"[{self.name}]"
        return [header if self.live else f"# {header}", *_comments(self.remarks), *(line.text for line in self.lines)]


def document(head: Iterable[str], sections: Mapping[str, Section]) -> str:
    """The whole file.

    Args:
        head: remarks at its beginning.
        sections: dotted name to table, those of one top-level table next to each other.
    """
    rows = _comments(head)
    for section in sections.values():
        rows += ["", *section.rows]
    return "\n".join(rows) + "\n"


def _comments(remarks: Iterable[str]) -> list[str]:
    """Lines of comment; names in them may hold anything, and TOML allows next to no control characters."""
    return [f"# {row}" for remark in remarks for row in textwrap.wrap(visible(remark), _WIDTH)]


#: By section the lines that every draft begins with.
USUAL_LINES: Mapping[str, tuple[Line, ...]] = {
    "robot": (
        Line("urdf", "arm.urdf", "or dh_convention and [[robot.dh]] rows", active=False),
        Line("base_rpy_deg", [0.0, 0.0, 0.0], "upright on the floor", guess=True),
        Line("armature_kg_m2", {"joint1": 0.1}, "reflected rotor inertia, by joint", active=False),
    ),
    "robot.tool": (
        Line("mass_kg", 0.0, "nothing carried; a payload left out shows as residual torque", guess=True),
        Line("com_m", [0.0, 0.0, 0.05], "centre of mass in frame", active=False),
        Line("frame", "tool0", "the last link when absent", active=False),
    ),
    "friction": (Line("file", "friction.json", 'from collaudit fit; gamma_nm = "auto" needs it', active=False),),
    "detect": (
        Line(
            "gamma_nm",
            "auto",
            "of each joint, by the fit's own residual in friction.json; or a number, or numbers by joint",
            guess=True,
        ),
        Line("persistence_ms", 25, "rounded up to whole samples; 12.5 where causal, unless stated", active=False),
        Line("watch", "auto", "joints under force control are not judged; or a list of names"),
    ),
    "phases": (
        Line("approach", [[0.0, 25.0]], "s from the log's first sample", active=False),
        Line("contact", [[25.0, 53.0]], active=False),
        Line("retreat", [[53.0, 57.5]], active=False),
    ),
    "report": (
        Line("robot", "type and serial number", "at the head of each report; else: not stated", active=False),
        Line("tool", "what the arm carries", active=False),
        Line("lab", "laboratory or cell", active=False),
        Line("operator", "who answers for the recording", active=False),
    ),
    "policy": (Line("max_collisions", 0), Line("max_near_misses_per_hour", 10, active=False)),
}


def add_units(units: Section, topic: TopicInfo | None, stated: Mapping[str, str], *, table: bool) -> None:
    """Lines of ``[log.units]``.

    Args:
    units: the section.
    topic: of the joint states.
    stated: quantity to the unit that the names of a table's columns, or their source, state.
    table: whether the log is one.
    """
    if table:
        named = stated.get("time")
        units.add("time", named or "auto", "by the name of its column" if named else "by the size of its numbers")
        _add_column_units(units, stated)
    elif topic is not None:
        units.add("position", "rad", f"{topic.type} defines radians; what is stated wins", active=False)
        if topic.currents:
            units.add("effort", "A", f"{topic.type} holds currents; needs torque_constant_nm_per_a, or write raw")
        else:
            units.add("effort", "Nm", f"{topic.type} defines N·m; drives often publish currents", guess=True)
    names = list(topic.joints[:2]) if topic else ["joint1"]
    units.add("torque_constant_nm_per_a", dict.fromkeys(names, 0.1), 'with effort = "A"', active=False)
    units.add("rated_torque_nm", dict.fromkeys(names, 10.0), 'with effort = "percent" or "permille"', active=False)
    units.add("length", "m", "or mm, of prismatic joints: what is stated is taken without a check", active=False)
    units.add("effort_sign", {names[0]: -1} if names else {}, "for joints whose effort is inverted", active=False)


def _add_column_units(units: Section, stated: Mapping[str, str]) -> None:
    said = "by the names of the columns, or what their source documents"
    free = "or deg: what is stated is taken without a check"
    for quantity, usual in (("position", "rad"), ("velocity", "rad/s")):
        named = stated.get(quantity)
        unit = standard_unit(quantity, named) if named else None
        if named or quantity == "position":
            why = said if unit else f"the columns are in {named}, which is not converted" if named else free
            units.add(quantity, unit or usual, why, active=unit is not None)
    effort = stated.get("effort")
    unit = standard_unit("effort", effort) if effort else "Nm"
    if unit in ("A", "mA"):
        units.add("effort", unit, f"{said}; needs torque_constant_nm_per_a, or write raw")
    elif unit in ("percent", "permille"):
        units.add("effort", unit, f"{said}; needs rated_torque_nm, or write raw")
    elif unit is None:
        units.add("effort", "raw", f"the columns are in {effort}, which is not converted", active=False)
    else:
        why = said if effort else "CSV files state no unit; A needs torque constants"
        units.add("effort", "Nm", why, guess=not effort)
