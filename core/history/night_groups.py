"""What fails in a night, grouped by robot, joint, cause and place: new, known, back, flaky, gone, or not tested.

A cause that explains a log's residual speaks for the contacts on its joints. What is left is told by the fingerprint of
contacts, over nights and over the logs of one night.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil
from typing import Literal

from collaudit.core.contacts.contact_states import EarlierContact, EarlierLog, is_alike, program_of, tool_place
from collaudit.core.data.audit_result import AuditResult, Cause
from collaudit.core.data.detection_result import Contact
from collaudit.core.history.night_row import JointNights

GroupState = Literal["new", "known", "back", "flaky", "accepted", "gone", "not tested"]
#: Of contacts in one group the first of these is said; an acceptance speaks only where it covers all of them.
_SAID: tuple[GroupState, ...] = ("new", "back", "flaky", "known", "accepted")
#: A contact that came and went so often is flaky: neither gone nor there.
_TURNS = 2


@dataclass(frozen=True, slots=True)
class Moment:
    """A contact of a group in a log: s from its first sample, the log's first stamp (ISO 8601) or None."""

    log: str
    onset_s: float
    start: str | None


@dataclass(frozen=True, slots=True)
class NightGroup:
    """Contacts of one source, or logs that one cause explains.

    Attributes:
        robot: whose; None where nobody says.
        joints: those that alarmed, the strongest first; of a cause, its own.
        cause: code of the cause that explains the logs; empty for contacts that none does.
        text: what it is, in words; empty for contacts.
        place_m: of the tool, in the base; None where it is not known.
        state: over the nights.
        since: first night that had it, ISO date; None where tonight is the first, or nobody knows.
        nights: how many had it, tonight included.
        logs: of tonight; of what is gone or not tested, those of its last night.
        moments: its contacts tonight, in order of time.
    """

    robot: str | None
    joints: tuple[str, ...]
    cause: str
    text: str
    place_m: tuple[float, float, float] | None
    state: GroupState
    since: str | None
    nights: int
    logs: tuple[str, ...]
    moments: tuple[Moment, ...] = ()


@dataclass(frozen=True, slots=True)
class _Seen:
    """A contact of tonight."""

    result: AuditResult
    contact: Contact
    print: EarlierContact


def night_groups(
    results: Sequence[AuditResult],
    robots: Mapping[str, str],
    history: Sequence[EarlierLog],
    tonight: str,
    joints: Sequence[JointNights] = (),
) -> tuple[NightGroup, ...]:
    """The groups of a night, robot by robot: causes, contacts, what is gone, what was not tested.

    Args:
        results: of the logs that were audited.
        robots: whose each log is, by its name.
        history: judged logs of before.
        tonight: ISO date; nights before it count as history.
        joints: nights of every joint, tonight included: since when a joint's friction is another.
    """
    changed = {(one.robot, one.joint): one for one in joints if one.friction.state == "changed"}
    owners = sorted({robots.get(result.log.name) for result in results}, key=lambda name: name or "")
    found: list[NightGroup] = []
    for robot in owners:
        own = [result for result in results if robots.get(result.log.name) == robot]
        past = [log for log in history if log.robot in (None, robot) and log.night < tonight]
        causes, left = _caused(robot, own)
        found += [_dated(one, changed) for one in causes]
        found += [*_touched(robot, left, past), *_absent(robot, own, past)]
    # what is there tonight first, causes before contacts; then what is not tested, gone, accepted
    order: tuple[GroupState, ...] = ("new", "back", "flaky", "known", "not tested", "gone", "accepted")
    found.sort(key=lambda one: (one.state in order[4:], not one.cause, order.index(one.state), -len(one.logs)))
    return tuple(found)


def _dated(group: NightGroup, changed: Mapping[tuple[str, str], JointNights]) -> NightGroup:
    """A cause that is the friction of a joint, since the night from which it is another."""
    one = changed.get((group.robot or "", group.joints[0])) if group.cause == "friction" and group.joints else None
    if one is None or one.friction.since is None:
        return group
    nights = sum(night.night >= one.friction.since for night in one.nights)
    return replace(group, since=one.friction.since, nights=nights, state="known" if nights > 1 else "new")


def _caused(robot: str | None, results: Sequence[AuditResult]) -> tuple[list[NightGroup], list[_Seen]]:
    """Logs that do not pass, by the cause that speaks; and the contacts that none explains."""
    by_cause: dict[tuple[str, tuple[str, ...]], list[tuple[AuditResult, Cause, list[Contact]]]] = {}
    left = []
    for result in results:
        cause = next((one for one in result.causes if one.speaks and result.verdict != "pass"), None)
        explained: list[Contact] = []
        if cause is not None:  # a cause of the whole arm has all contacts, others those on their joints only
            its = set(cause.joints)
            explained = [one for one in result.contacts if not its or set(one.joints) <= its]
            by_cause.setdefault((cause.code, cause.joints), []).append((result, cause, explained))
        left += [_seen(result, contact) for contact in result.contacts if contact not in explained]
    return [_cause_group(robot, logs) for logs in by_cause.values()], left


def _cause_group(robot: str | None, logs: Sequence[tuple[AuditResult, Cause, Sequence[Contact]]]) -> NightGroup:
    """One cause of several logs, in the words of the log in which it is of middle size."""
    ranked = sorted(logs, key=lambda log: log[1].value[0])
    cause = ranked[len(ranked) // 2][1]
    contacts = [contact for _, _, explained in logs for contact in explained]
    since = min((contact.known_since for contact in contacts if contact.known_since), default=None)
    return NightGroup(
        robot=robot,
        joints=cause.joints,
        cause=cause.code,
        text=cause_words(cause),
        place_m=None,
        state="known" if since else "new",
        since=since,
        nights=1 + max((contact.known_nights for contact in contacts), default=0),
        logs=tuple(result.log.name for result, *_ in logs),
        moments=tuple(_moment(result, contact) for result, _, own in logs for contact in own),
    )


def cause_words(cause: Cause) -> str:
    """A cause in few words; friction as a share of that of the fitted logs."""
    kind = cause.code
    if kind != "friction" or len(cause.value) != 1:
        return cause.text
    share, (low, high) = cause.value[0], cause.ci95[0]
    where = f"'{cause.joints[0]}'" if cause.joints else "every joint"
    more = "above" if share > 0 else "below"
    error = ceil(50.0 * (high - low))
    return f"friction of {where} is {abs(100.0 * share):.0f} % {more} that of the fitted logs (± {error} %)"


def _touched(robot: str | None, left: Sequence[_Seen], past: Sequence[EarlierLog]) -> Iterator[NightGroup]:
    """Contacts of tonight that no cause explains, alike ones together."""
    groups: list[list[_Seen]] = []
    for one in left:
        own = next((group for group in groups if any(is_alike(one.print, other.print) for other in group)), None)
        groups.append([one]) if own is None else own.append(one)
    for group in groups:
        first = max(group, key=lambda one: max(one.contact.peak_nm.values(), default=0.0))
        states = {one.contact.state for one in group}
        state = next(state for state in _SAID if state in states)
        aged = max(group, key=lambda one: one.contact.known_nights)
        flaky = state in ("back", "known") and _turns([one.print for one in group], past) >= _TURNS
        yield NightGroup(
            robot=robot,
            joints=_strongest_first(first.print),
            cause="",
            text="",
            place_m=first.print.place_m,
            state="flaky" if flaky else state,
            since=aged.contact.known_since,
            nights=aged.contact.known_nights + 1,
            logs=tuple(dict.fromkeys(one.result.log.name for one in group)),
            moments=tuple(_moment(one.result, one.contact) for one in group),
        )


def _turns(prints: Sequence[EarlierContact], past: Sequence[EarlierLog]) -> int:
    """How often a contact was gone from one judged night of its programs to the next that had it no more."""
    programs = {one.program for one in prints}
    nights: dict[str, bool] = {}
    for log in past:
        if log.program in programs:
            there = any(is_alike(mine, other) for mine in prints for other in log.contacts)
            nights[log.night] = nights.get(log.night, False) or there
    return sum(before and not after for before, after in pairwise(there for _, there in sorted(nights.items())))


def _absent(robot: str | None, results: Sequence[AuditResult], past: Sequence[EarlierLog]) -> Iterator[NightGroup]:
    """Contacts of each program's last night that tonight does not have: gone, or not tested."""
    every = [_seen(result, contact).print for result in results for contact in result.contacts]
    judged = {program_of(result.log.name): result for result in results if result.verdict != "not_judged"}
    last: dict[str, str] = {}
    for log in past:
        last[log.program] = max(log.night, last.get(log.program, ""))
    absent: list[EarlierContact] = []
    for log in past:
        for one in log.contacts if log.night == last[log.program] else ():
            if not any(is_alike(one, other) for other in (*every, *absent)):
                absent.append(one)
    for one in absent:
        nights = sorted({log.night for log in past if any(is_alike(one, other) for other in log.contacts)})
        result = judged.get(one.program)
        tested = result is not None and any(
            cover.watched and cover.judged_s > 0.0
            for joint, cover in result.coverage.joints.items()
            if joint in one.peak_nm
        )
        yield NightGroup(
            robot=robot,
            joints=_strongest_first(one),
            cause="",
            text="",
            place_m=one.place_m,
            state="gone" if tested else "not tested",
            since=nights[0] or None,
            nights=len(nights),
            logs=(one.program,),
        )


def _seen(result: AuditResult, contact: Contact) -> _Seen:
    return _Seen(result, contact, EarlierContact("", program_of(result.log.name), contact.peak_nm, tool_place(contact)))


def _strongest_first(one: EarlierContact) -> tuple[str, ...]:
    return tuple(sorted(one.peak_nm, key=lambda joint: -one.peak_nm[joint]))


def _moment(result: AuditResult, contact: Contact) -> Moment:
    return Moment(result.log.name, contact.onset_s, result.log.start)
