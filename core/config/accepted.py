"""``accepted.toml``: contacts that a person answers for, each by name and until a day; reading and changing it."""

import re
from collections.abc import Collection
from datetime import date
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from collaudit.core.config.config_table import ConfigTable, Interval, Positive, Vec3, about
from collaudit.core.config.load import parsed, problem_of, read_text
from collaudit.core.errors import ConfigError
from collaudit.core.small_files import to_toml

ACCEPTED_NAME = "accepted.toml"
#: Begins an entry; what is above the first one is the file's own heading.
_HEAD = re.compile(r"^(?=[ \t]*\[\[[ \t]*accepted[ \t]*\]\])", re.MULTILINE)
_HEADING = """# Contacts that a named person answers for: they do not break the policy until the day stated,
# unless they come back clearly harder. Keys: docs/fleet.md. Review this file like code.
"""


class Acceptance(ConfigTable, frozen=True, kw_only=True):
    """One contact that does not break the policy: what it is, who answers for it, why, and until when."""

    robot: Annotated[str | None, about("Robot of `[fleet]`, or of `--robot`; every one when absent.")] = None
    program: Annotated[
        str | None, about("Name of the log, `#` for its dates and times: other runs of the program are meant, too.")
    ] = None
    log: Annotated[
        str | None,
        about(
            "Pattern of the log's name or path, with `*`, `?` and `[…]`. One that does not begin with `/` or a scheme "
            "matches the end of a path from a folder on."
        ),
    ] = None
    sha256: Annotated[str | None, about("Hash of the one recording that is meant; needed with `time_s`.")] = None
    place_m: Annotated[
        Vec3 | None, about("Where the tool was at the peak, in the base, m; contacts within 0.2 m of it are meant.")
    ] = None
    time_s: Annotated[
        Interval | None, about("Between which times of that recording the contact lies, s from its first sample.")
    ] = None
    peak_nm: Annotated[
        dict[str, Positive],
        about("Joints that alarmed, each with its highest residual, N·m (N if prismatic); a quarter more is covered."),
    ] = {}
    lasted_s: Annotated[Positive | None, about("How long it lasted, s; one twice as long is not covered.")] = None
    reason: Annotated[str, Meta(min_length=3), about("Why it is accepted.")]
    owner: Annotated[str, Meta(min_length=1), about("Who answers for it.")]
    until: Annotated[date, about("Last day on which it counts; at most 90 days ahead.")]

    def __post_init__(self) -> None:
        if all(place is None for place in (self.program, self.log, self.place_m, self.sha256)):
            raise ValueError("nothing tells where: give program, log, place_m, or sha256")
        if not self.peak_nm and self.time_s is None:
            raise ValueError("nothing tells which contact: give peak_nm by joint, or sha256 and time_s")
        if self.time_s is not None and self.sha256 is None:
            raise ValueError("time_s needs sha256: another recording has something else at that time")

    @property
    def words(self) -> str:
        """Who accepts what, in words."""
        what = ", ".join(self.peak_nm) if self.time_s is None else "{:g} to {:g} s".format(*self.time_s)
        where = " ".join(part for part in (self.robot, self.program, self.log) if part)
        meant = f"{what} in {where}" if where else what
        return f"{meant}, accepted by {self.owner} until {self.until}: {self.reason}"


class AcceptedFile(ConfigTable, frozen=True, kw_only=True):
    """The whole file."""

    accepted: Annotated[list[Acceptance], about("Contacts that are accepted.")] = []


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
    data = parsed(text, path)
    try:
        return tuple(AcceptedFile.of(data).accepted)
    except msgspec.ValidationError as error:
        raise problem_of(error, text, data, path, (), AcceptedFile) from None


def with_entry(text: str, entry: Acceptance) -> str:
    """The file's text with one more entry at its end; what a person wrote there stays."""
    stated = ((name, getattr(entry, name)) for name in entry.__struct_fields__)
    lines = [f"{name} = {to_toml(value)}" for name, value in stated if value not in (None, {})]
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
