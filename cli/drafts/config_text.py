"""A commented configuration: sections of lines, each with why it says what it says; written by tomlkit."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from collaudit.core.config.toml_text import key_item, to_toml, toml_item, toml_key
from collaudit.reports.values.visible_text import visible

if TYPE_CHECKING:
    from tomlkit import TOMLDocument
    from tomlkit.items import Table

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

    def put_into(self, table: Table) -> None:
        """Append the line, or a comment that shows it."""
        import tomlkit

        if not self.active:
            shown = f"{toml_key(self.key)} = {to_toml(self.value)}"
            table.add(tomlkit.comment(f"{shown}  # {self.remark}" if self.remark else shown))
            return
        item = toml_item(self.value)
        if self.remark:
            item.comment(self.remark)
            item.trivia.comment_ws = "  "
        table.append(key_item(self.key), item)


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

    def guess(self, key: str, value: object, why: str) -> None:
        """Put a guess in place of an example or another guess."""
        self.put(Line(key, value, why, guess=True))

    def give(self, key: str, value: object, *, guess: bool) -> None:
        """Put what a file or flag says in place of a guess or an example; a guess of the file stays one."""
        self.put(Line(key, value, "as in the configuration, stated by nobody" if guess else "as given", guess=guess))

    def replace(self, key: str, value: object, why: str) -> None:
        """Put a better example in place of an example; what counts already is left alone."""
        if not any(line.key == key and line.active for line in self.lines):
            self.put(Line(key, value, why, active=False))

    def better(self, key: str, value: object, why: str) -> bool:
        """Put a better guess in place of a guess; whether there was one."""
        found = any(line.key == key and line.guess for line in self.lines)
        if found:
            self.put(Line(key, value, why, guess=True))
        return found

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

    def table(self) -> Table:
        """The table's remarks and lines."""
        import tomlkit

        table = tomlkit.table()
        _comment(table, self.remarks)
        for line in self.lines:
            line.put_into(table)
        return table


def document(head: Iterable[str], sections: Mapping[str, Section]) -> str:
    """The whole file.

    Args:
        head: remarks at its beginning.
        sections: dotted name to table, those of one top-level table next to each other.
    """
    import tomlkit

    made = tomlkit.document()
    _comment(made, head)
    last: TOMLDocument | Table = made
    for section in sections.values():
        table = section.table()
        if section.live:
            _append(made, section.name.split("."), table)
            table.trivia.indent = "\n"  # the blank line above the header
            last = table
            continue
        last.add(tomlkit.nl())
        last.add(tomlkit.comment(f"[{section.name}]"))
        for _, remark in table.value.body:
            last.append(None, remark)
    return tomlkit.dumps(made)


def _append(made: TOMLDocument, path: Sequence[str], table: Table) -> None:
    """Put a table in its place; tables above it that have nothing of their own get no header."""
    import tomlkit

    parent: TOMLDocument | Table = made
    for name in path[:-1]:
        if name not in parent:
            above = tomlkit.table(is_super_table=True)
            parent.append(key_item(name), above)
            above.trivia.indent = ""
        inner = parent[name]
        assert isinstance(inner, tomlkit.items.Table)
        parent = inner
    parent.append(key_item(path[-1]), table)


def _comment(into: TOMLDocument | Table, remarks: Iterable[str]) -> None:
    import tomlkit

    for remark in remarks:
        for row in textwrap.wrap(remark, _WIDTH):
            into.add(tomlkit.comment(row))
