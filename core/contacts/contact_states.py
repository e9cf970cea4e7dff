"""What each contact of a log is: new, known from earlier nights, back after a night without it, or accepted.

A contact is known again by robot, program or place, joints and size. Being known excuses nothing; only an acceptance,
by name and until a day, takes a contact out of the verdict. After a night each entry says whether it counted, or is to
be looked at again.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date, timedelta
from fnmatch import fnmatchcase
from typing import Literal

from collaudit.core.config.accepted import Acceptance
from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.detection_result import Contact

#: A date or a time in a name: four digits or more, and digits joined to them.
_STAMP = re.compile(r"\d{4,}(?:[-_:.T]?\d+)*|\d{2}(?:[-_:]\d{2}){2,}")


def matches(text: str, patterns: Iterable[str]) -> bool:
    """Whether a path, URL or name is meant by one of the patterns.

    Args:
        text: with ``/`` between folders.
        patterns: with ``*`` (over folders, too), ``?`` and ``[…]``. One that does not begin with ``/`` or a scheme is
            also tried from every folder on: ``cell1/*`` means ``logs/cell1/a.mcap``, and not ``logs/xcell1/a.mcap``.
    """
    plain = text.removeprefix("./")
    return any(fnmatchcase(plain, pattern) or fnmatchcase(plain, f"*/{pattern}") for pattern in patterns)


def program_of(name: str) -> str:
    """The name of a log with ``#`` in place of dates and times: tomorrow's run of the program has the same.

    ``cell1/pick_2026-11-28_031502.mcap`` becomes ``cell1/pick_#.mcap``; ``run2.csv`` stays.
    """
    return _STAMP.sub("#", name)


def runs_program(program: str, name: str, path: str) -> bool:
    """Whether a log is a run of a program, by its name in the audit or by the end of its path, whole folders.

    Args:
        program: as :func:`program_of` gives it.
        name, path: of the log.
    """
    return program == program_of(name) or f"/{program_of(path)}".endswith(f"/{program}")


#: A contact is clearly harder where a joint's residual is so many times the other's: peaks of one event that a program
#: repeats differ by less, with the noise and the phase of the samples.
HARDER = 1.25
#: Likewise longer, and by so many seconds more.
LONGER, _LONGER_S = 2.0, 0.2
#: Contacts are at one place where the tool was within this distance, m: about its travel during a short contact.
NEAR_M = 0.2
#: An acceptance counts for so many days ahead at most: what stands longer is a rule of the cell, and no exception.
MOST_DAYS = 90
#: Room around the times that an entry states, s.
_ROOM_S = 0.1

Place = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class EarlierContact:
    """A contact of an earlier night, or of an earlier audit of the same log.

    Attributes:
        night: ISO date; empty where it is not known.
        program: of its log, as :func:`program_of` gives it.
        peak_nm: highest residual by joint that alarmed, N·m.
        place_m: (x, y, z) of the tool at the peak, in the base; None where it is not known.
        stored: of a store of nights: only later nights know it. A baseline is known, whatever its date.
    """

    night: str
    program: str
    peak_nm: Mapping[str, float]
    place_m: Place | None
    stored: bool = False


@dataclass(frozen=True, slots=True)
class EarlierLog:
    """A judged log of before: whose it was (None: not known), its night, its program, its contacts."""

    robot: str | None
    night: str
    program: str
    contacts: tuple[EarlierContact, ...]


@dataclass(frozen=True, slots=True)
class Precedents:
    """What is known of a robot's contacts before one log of it is judged.

    Attributes:
        robot: whose log it is; None where nobody says.
        log: name of the log in its audit.
        path: its path or URL.
        today: day on which acceptances are looked at.
        night: ISO date that the log counts to; None: that of its first stamp.
        contacts: of earlier nights, of this robot.
        nights: earlier nights in which its program was judged.
        accepted: entries of accepted.toml.
    """

    robot: str | None
    log: str
    path: str
    today: date
    night: str | None = None
    contacts: tuple[EarlierContact, ...] = ()
    nights: tuple[str, ...] = ()
    accepted: tuple[Acceptance, ...] = ()


def tool_place(contact: Contact) -> Place | None:
    """Where the tool was when a contact was strongest, in the base, m; None without a kinematic model."""
    return None if contact.scene is None else contact.scene.points_m[-1]


def with_states(
    contacts: Sequence[Contact], known: Precedents | None, sha256: str, start: str | None
) -> tuple[Contact, ...]:
    """The contacts with their names and states.

    Args:
        contacts: of one log.
        known: beforehand; None for nothing.
        sha256: hash of the log.
        start: when it was recorded, ISO 8601, or None.
    """
    # a short name: the same wherever the log is judged and finds the contact at the same time
    texts = (f"{sha256} {one.onset_s:.3f} {' '.join(one.joints)}" for one in contacts)
    names = [hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()[:8] for text in texts]
    named = [replace(one, id=name) for one, name in zip(contacts, names, strict=True)]
    if known is None:
        return tuple(named)
    tonight = known.night or (start or known.today.isoformat())[:10]
    return tuple(_accepted(_seen(one, known, tonight), known, sha256) for one in named)


def _seen(contact: Contact, known: Precedents, tonight: str) -> Contact:
    """New, known or back: since when it is there goes by its fingerprint, and one that became harder is new."""
    mine = EarlierContact(tonight, program_of(known.log), contact.peak_nm, tool_place(contact))
    before = (one for one in known.contacts if not one.stored or one.night < tonight)
    alike = [one for one in before if is_alike(mine, one)]
    if not alike:
        return contact
    nights = sorted({one.night for one in alike})
    since = nights[0] or "an earlier audit"
    count = f"{len(nights)} night{'s' if len(nights) > 1 else ''}"
    aged = replace(contact, known_since=since, known_nights=len(nights))
    if all(_harder(mine.peak_nm, one.peak_nm) for one in alike):
        return replace(aged, state_text=f"harder than since {since} ({count})")
    without = [night for night in known.nights if nights[-1] < night < tonight]
    if without:
        text = f"back: seen in {count}, last {nights[-1]}, and not in {len(without)} since"
        return replace(aged, state="back", state_text=text)
    return replace(aged, state="known", state_text=f"known since {since}" + (f" ({count})" if nights[0] else ""))


def is_alike(mine: EarlierContact, other: EarlierContact) -> bool:
    """Whether a contact is another one again, by its fingerprint.

    They are at one place, or where a place is not known in runs of one program, and the strongest joint of each is
    among those of the other.
    """
    if mine.place_m is not None and other.place_m is not None:
        if math.dist(mine.place_m, other.place_m) > NEAR_M:
            return False
    elif mine.program != other.program:
        return False
    if not mine.peak_nm or not other.peak_nm:
        return False
    strongest = {max(peaks, key=peaks.__getitem__) for peaks in (mine.peak_nm, other.peak_nm)}
    return strongest <= mine.peak_nm.keys() & other.peak_nm.keys()


def _harder(mine: Mapping[str, float], other: Mapping[str, float]) -> list[str]:
    """Joints whose residual is clearly higher than the other contact's; joints that only one has do not compare."""
    return [joint for joint, peak in mine.items() if joint in other and peak > HARDER * other[joint]]


def _accepted(contact: Contact, known: Precedents, sha256: str) -> Contact:
    """The contact as an entry leaves it: accepted, or with the words why the entry that means it does not count."""
    notes = []
    for entry in known.accepted:
        if not means(entry, contact, known, sha256):
            continue
        why = refusal(entry, contact, known.today)
        if why is None:
            text = f"accepted by {entry.owner} until {entry.until}: {entry.reason}"
            return replace(contact, state="accepted", state_text=text)
        notes.append(f"the acceptance by {entry.owner} until {entry.until} does not cover it: {why}")
    return replace(contact, state_text="; ".join([part for part in (contact.state_text, *notes) if part]))


def concerns(entry: Acceptance, known: Precedents, sha256: str) -> bool:
    """Whether an entry is about contacts of this log."""
    if entry.robot is not None and entry.robot != known.robot:
        return False
    if entry.sha256 is not None and entry.sha256 != sha256:
        return False
    if entry.program is not None and not runs_program(entry.program, known.log, known.path):
        return False
    return entry.log is None or matches(known.log, [entry.log]) or matches(known.path, [entry.log])


def means(entry: Acceptance, contact: Contact, known: Precedents, sha256: str) -> bool:
    """Whether an entry is about this contact, however hard: robot, program, log, place, time, joints."""
    if not concerns(entry, known, sha256):
        return False
    place = tool_place(contact)
    if entry.place_m is not None and (place is None or math.dist(place, entry.place_m) > NEAR_M):
        return False
    if entry.time_s is not None:
        low, high = entry.time_s
        if not low - _ROOM_S <= contact.onset_s <= contact.end_s <= high + _ROOM_S:
            return False
    return not entry.peak_nm or not set(contact.joints).isdisjoint(entry.peak_nm)


def refusal(entry: Acceptance, contact: Contact, today: date) -> str | None:
    """Why an entry that means a contact does not cover it; None where it does."""
    day = day_refusal(entry, today)
    if day is not None or not entry.peak_nm:
        return day
    more = sorted(set(contact.joints) - set(entry.peak_nm))
    if more:
        return f"{', '.join(more)} alarmed, too"
    harder = [
        f"{j} {contact.peak_nm[j]:.3g} N·m, accepted {entry.peak_nm[j]:.3g}"
        for j in _harder(contact.peak_nm, entry.peak_nm)
    ]
    if harder:
        return f"it is harder ({', '.join(harder)})"
    lasted = contact.end_s - contact.onset_s
    if entry.lasted_s is not None and lasted > max(LONGER * entry.lasted_s, entry.lasted_s + _LONGER_S):
        return f"it is longer ({lasted:.3g} s, accepted {entry.lasted_s:.3g} s)"
    return None


def day_refusal(entry: Acceptance, today: date) -> str | None:
    """Why an entry does not count on a day; None where it does."""
    if entry.until < today:
        return f"it ended after {entry.until}"
    if entry.until > today + timedelta(days=MOST_DAYS):
        return f"{entry.until} is further ahead than the {MOST_DAYS} days for which an acceptance counts"
    return None


UseState = Literal["counted", "expired", "too long", "no longer matches", "unused", "not asked"]


@dataclass(frozen=True, slots=True)
class AcceptanceUse:
    """One entry of accepted.toml in one night.

    Attributes:
        number: of the entry, from 1.
        state: ``counted``; ``expired``; ``too long``: its day is further ahead than the policy allows; ``no longer
            matches``: what it means came, and is not what was accepted; ``unused``: its logs were judged and nothing
            like it came; ``not asked``: no log of tonight is one that it means.
        text: the entry in words, and why.
    """

    number: int
    state: UseState
    text: str


def acceptance_uses(
    entries: Sequence[Acceptance], logs: Sequence[tuple[Precedents, AuditResult]], today: date
) -> list[AcceptanceUse]:
    """What became of each entry.

    Args:
        entries: of accepted.toml.
        logs: audited ones, each with what was known of it.
        today: day on which they are looked at.
    """
    uses = []
    for number, entry in enumerate(entries, 1):
        asked = [(known, result) for known, result in logs if concerns(entry, known, result.log.sha256)]
        meant = [c for known, result in asked for c in result.contacts if means(entry, c, known, result.log.sha256)]
        why = [refusal(entry, contact, today) for contact in meant]
        day = day_refusal(entry, today)
        state: UseState = "unused" if asked else "not asked"
        if day is not None:
            state = "expired" if entry.until < today else "too long"
        elif None in why:
            state = "counted"
        elif meant:
            state = "no longer matches"
        because = day or (why[0] if state == "no longer matches" else None)
        uses.append(AcceptanceUse(number, state, entry.words + (f" ({because})" if because else "")))
    return uses
