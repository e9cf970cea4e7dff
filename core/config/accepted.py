"""``accepted.toml``: reading it, one entry more, some less."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection, Sequence
from pathlib import Path

import msgspec

from collaudit.core.config.describe import Places, schema_problem, syntax_problem
from collaudit.core.config.load import read_text
from collaudit.core.config.schema_accepted import Acceptance, AcceptedFile
from collaudit.core.config.toml_text import key_lines, parse_toml, to_toml
from collaudit.core.errors import ConfigError

ACCEPTED_NAME = "accepted.toml"
#: Begins an entry; what is above the first one is the file's own heading.
_HEAD = re.compile(r"^(?=[ \t]*\[\[[ \t]*accepted[ \t]*\]\])", re.MULTILINE)
_HEADING = """# Contacts that a named person answers for: they do not break the policy until the day stated,
# unless they come back clearly harder. Keys: docs/fleet.md. Review this file like code.
"""


def load_accepted(path: Path) -> tuple[Acceptance, ...]:
    """The entries of a file, in its order; none where there is no such file.

    Raises:
        ConfigError: it cannot be read or understood, with its line.
    """
    if not path.is_file():
        return ()
    return parse_accepted(read_text(path, "collaudit accept OUT CONTACT writes one"), path)


def parse_accepted(text: str, path: Path) -> tuple[Acceptance, ...]:
    """As :func:`load_accepted`, of a text that is or will be the file's content."""
    try:
        data = parse_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise syntax_problem(error, str(path)) from error
    try:
        return tuple(AcceptedFile.of(data).accepted)
    except msgspec.ValidationError as error:
        raise schema_problem(error, data, Places(str(path), key_lines(text), []), AcceptedFile) from None


def with_entry(text: str, entry: Acceptance) -> str:
    """The file's text with one more entry at its end; what a person wrote there stays."""
    lines = [f"{name} = {to_toml(value)}" for name, value in _stated(entry).items()]
    return (text.rstrip("\n") + "\n" if text.strip() else _HEADING) + "\n".join(["", "[[accepted]]", *lines]) + "\n"


def without_entries(text: str, numbers: Collection[int], path: Path) -> str:
    """The file's text without some of its entries.

    Args:
        text: of the file.
        numbers: of the entries that go, from 0.
        path: the file.

    Raises:
        ConfigError: entries are written in a way that cannot be taken apart.
    """
    heading, *blocks = _HEAD.split(text)
    if [parse_accepted(block, path) for block in blocks] != [(entry,) for entry in parse_accepted(text, path)]:
        raise ConfigError(
            "entries cannot be told apart in this file",
            where=str(path),
            expected="each below a line [[accepted]] of its own",
            hint="take the entries out by hand",
        )
    return heading + "".join(block for number, block in enumerate(blocks) if number not in numbers)


def _stated(entry: Acceptance) -> dict[str, object]:
    named: Sequence[str] = entry.__struct_fields__
    return {name: value for name in named if (value := getattr(entry, name)) not in (None, {})}
