"""A commented configuration as text: sections of lines, each with why it says what it says."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from dataclasses import dataclass, field

from collaudit.core.config.describe import to_toml, toml_key

_WIDTH = 110


@dataclass(frozen=True, slots=True)
class Line:
    """One key.

    Attributes:
        key: its name inside the section.
        value: its value; shown as an example when ``active`` is False.
        why: what the value rests on.
        active: whether the line counts, or is commented out.
        guess: whether the value was not stated anywhere.
    """

    key: str
    value: object
    why: str = ""
    active: bool = True
    guess: bool = False

    def text(self) -> str:
        """The line as TOML."""
        mark = "" if self.active else "# "
        why = f"GUESS: {self.why}" if self.guess else self.why
        return f"{mark}{toml_key(self.key)} = {to_toml(self.value)}" + (f"  # {why}" if why else "")


@dataclass(slots=True)
class Section:
    """One table with its remarks and lines."""

    name: str
    remarks: list[str] = field(default_factory=list)
    lines: list[Line] = field(default_factory=list)

    def add(self, key: str, value: object, why: str = "", *, active: bool = True, guess: bool = False) -> None:
        """Append a line."""
        self.lines.append(Line(key, value, why, active, guess))

    def give(self, key: str, value: object) -> None:
        """Put what the user stated in place of a guess or an example."""
        self._put(Line(key, value, "as given"))

    def replace(self, key: str, value: object, why: str) -> None:
        """Put a better example in place of an example; what counts already is left alone."""
        if not any(line.key == key and line.active for line in self.lines):
            self._put(Line(key, value, why, active=False))

    def _put(self, line: Line) -> None:
        for index, old in enumerate(self.lines):
            if old.key == line.key:
                self.lines[index] = line
                return
        self.lines.append(line)

    def text(self) -> str:
        """The table as TOML."""
        remarks = [f"# {row}" for remark in self.remarks for row in textwrap.wrap(remark, _WIDTH)]
        live = any(line.active for line in self.lines)
        head = [f"[{self.name}]" if live or not self.lines else f"# [{self.name}]"]
        return "\n".join([*head, *remarks, *(line.text() for line in self.lines)])


def document(head: list[str], sections: Mapping[str, Section]) -> str:
    """The whole file."""
    remarks = [f"# {row}" for remark in head for row in textwrap.wrap(remark, _WIDTH)]
    return "\n\n".join(["\n".join(remarks), *(section.text() for section in sections.values())]) + "\n"
