"""``collaudit accept``: a contact that a named person answers for, until a day."""

from __future__ import annotations

from datetime import UTC, date, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from collaudit.cli.console import note, say, say_object
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, load_settings
from collaudit.core.errors import EXIT_PASS, ConfigError

if TYPE_CHECKING:
    from collaudit.core.config.accepted import Acceptance
    from collaudit.core.data.audit_result import AuditResult
    from collaudit.core.data.detection_result import Contact

#: Entries in these states are taken out by ``--prune``.
_PRUNED = ("expired", "no longer matches", "unused")


@example_command(
    "accept",
    'collaudit accept out/ 3f9ac2d1 --reason "gripper taps the tray by design" --owner "A. Lee" --until 2027-01-31',
    "collaudit accept out/ --prune -c collaudit.toml",
)
@click.argument("folder", type=click.Path(path_type=Path), metavar="OUT")
@click.argument("contact", required=False)
@click.option("--reason", metavar="TEXT", help="Why the contact is accepted.")
@click.option("--owner", metavar="NAME", help="Who answers for it.")
@click.option("--until", type=click.DateTime(["%Y-%m-%d"]), metavar="DATE", help="Last day on which it counts.")
@click.option("--prune", is_flag=True, help="Take out the entries that OUT found expired, unused or not matching.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON: the file, what was added, what was taken out.")
@config_option
def accept_command(
    folder: Path,
    contact: str | None,
    reason: str | None,
    owner: str | None,
    until: datetime | None,
    prune: bool,
    as_json: bool,
) -> int:
    """Write a contact of an audit, by its id, into accepted.toml: it breaks the policy no more, until the day.

    The entry means contacts of the same robot and program, of these joints, no harder than this one, with the tool at
    the same place. A harder one breaks the policy again. The file lies beside the configuration;
    review it like code. An entry counts for 90 days at most.

    Exit codes: 0 written; 2 no such contact, or something is missing.
    """
    from collaudit.cli.batch.precedents import accepted_path
    from collaudit.core.config.accepted import parse_accepted, with_entry, without_entries
    from collaudit.core.config.load import read_text
    from collaudit.reports.files.written_files import atomic_write

    loaded = load_settings()
    path = accepted_path(loaded)
    text = read_text(path, "") if path.is_file() else ""
    entries = parse_accepted(text, path)
    if prune:
        if contact is not None:
            raise ConfigError("--prune takes no contact", where="CONTACT", found=contact)
        gone = _stale(folder, entries)
        if gone:
            atomic_write(path, without_entries(text, gone, path))
        taken = [entries[number].words for number in gone]
        _say(path, [], taken, f"{len(gone)} of {len(entries)} entries taken out of {path}", as_json)
        return EXIT_PASS
    today = datetime.now(UTC).date()
    entry = _entry(folder, contact, reason, owner, until, today)
    made = with_entry(text, entry)
    parse_accepted(made, path)
    atomic_write(path, made)
    _say(path, [entry.words], [], f"{path}: {entry.words}", as_json)
    note("commit the file; the next audit reads it, and says so in its verdict")
    return EXIT_PASS


def _say(path: Path, added: list[str], removed: list[str], text: str, as_json: bool) -> None:
    if as_json:
        say_object("collaudit/accept/1", {"file": str(path), "added": added, "removed": removed})
    else:
        say(text)


def _entry(
    folder: Path,
    contact: str | None,
    reason: str | None,
    owner: str | None,
    until: datetime | None,
    today: date,
) -> Acceptance:
    """The entry for a contact of an audit."""
    from collaudit.core.config.accepted import Acceptance
    from collaudit.core.contacts.contact_states import day_refusal, program_of, tool_place

    stated = {"CONTACT": contact, "--reason": reason, "--owner": owner, "--until": until}
    missing = [name for name, value in stated.items() if not value]
    if missing or contact is None or until is None or reason is None or owner is None:
        raise ConfigError("an acceptance names a contact, a reason, an owner and a day", expected=", ".join(missing))
    if len(reason.strip()) < 3 or not owner.strip():
        raise ConfigError("a reason and an owner are words", where="--reason, --owner", found=f"{reason!r}, {owner!r}")
    result, robot, found = _contact(folder, contact)
    place = tool_place(found)
    entry = Acceptance(
        robot=robot,
        program=program_of(result.log.name),
        place_m=None if place is None else (round(place[0], 3), round(place[1], 3), round(place[2], 3)),
        peak_nm={joint: float(f"{peak:.3g}") for joint, peak in found.peak_nm.items()},
        lasted_s=round(max(found.end_s - found.onset_s, 1e-3), 3),
        reason=reason.strip(),
        owner=owner.strip(),
        until=until.date(),
    )
    why = day_refusal(entry, today)
    if why is not None:
        hint = "name a nearer day" if entry.until > today else None
        raise ConfigError(f"this would not count: {why}", where="--until", found=f"{entry.until}", hint=hint)
    return entry


def _contact(folder: Path, name: str) -> tuple[AuditResult, str | None, Contact]:
    """The contact of that id in an audit's folder or a run, with its log and robot.

    Raises:
        ConfigError: there is none, or it was not counted with all it needs.
    """
    from collaudit.cli.batch.precedents import audited_results

    every = [(result, robot, one) for result, robot in audited_results(folder) for one in result.contacts]
    found = [item for item in every if item[2].id == name]
    if not found:
        ids = ", ".join(dict.fromkeys(one.id for _, _, one in every if one.id))
        raise ConfigError(
            "no contact of this audit has that id",
            where=str(folder),
            found=name,
            expected=ids or "an id as report and audit.json show them; this audit has no contacts",
        )
    return found[0]


def _stale(folder: Path, entries: tuple[Acceptance, ...]) -> list[int]:
    """Numbers, from 0, of the entries that an audit found to be over or not to be needed."""
    from collaudit.cli.batch.precedents import SUMMARY_NAME
    from collaudit.reports.files.written_files import read_result
    from collaudit.reports.page.index import SUMMARY_SCHEMA, Summary

    used = read_result(folder / SUMMARY_NAME, Summary, SUMMARY_SCHEMA).accepted
    if [use.number for use in used] != list(range(1, len(entries) + 1)) or any(
        not use.text.startswith(entry.words) for use, entry in zip(used, entries, strict=True)
    ):
        raise ConfigError(
            "this audit read another accepted.toml",
            where=str(folder),
            hint="audit again, then prune",
        )
    return [use.number - 1 for use in used if use.state in _PRUNED]
