"""A commented configuration: sections of lines, each with why it says what it says."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from collaudit.core.config.toml_text import to_toml, toml_key
from collaudit.reports.values.visible_text import visible

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

    def guess(self, key: str, value: object, why: str) -> None:
        """Put a guess in place of an example or another guess."""
        self.put(Line(key, value, why, guess=True))

    def give(self, key: str, value: object, *, guess: bool) -> None:
        """Put what a file or flag says in place of a guess or an example; a guess of the file stays one."""
        self.put(Line(key, value, "as in the configuration, stated by nobody" if guess else "as given", guess=guess))

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
    return [f"# {row}" for remark in remarks for row in textwrap.wrap(remark, _WIDTH)]
