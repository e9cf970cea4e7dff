"""Two audits side by side: settings, friction, residual level, and the contacts that only one of them has."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from collaudit.core.data.audit_result import Audit, AuditResult, Verdict
from collaudit.core.data.detection_result import Contact
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.signals import Signals, State
from collaudit.core.verdict.noticed_words import place_text
from collaudit.reports.values.words import noticed_brief, torque_unit

COMPARISON_SCHEMA = "collaudit/comparison/1"
Bounds = tuple[float | None, float | None]
#: A contact of the other audit is the same where it overlaps, this much room left on both sides.
_ROOM_S = 0.1
#: Share of a contact's time that has to be judged for its absence to mean anything.
_JUDGED_SHARE = 0.5


@dataclass(frozen=True, slots=True)
class Change:
    """A setting, version or finding that differs. ``before`` and ``after`` are None where there is none."""

    what: str
    before: str | None
    after: str | None


@dataclass(frozen=True, slots=True)
class ParameterChange:
    """A friction parameter of a joint in both audits.

    Attributes:
        joint, parameter: whose it is; the unit is in the parameter's name.
        before, after: values, None where it was not fitted.
        before_ci95, after_ci95: 95 % intervals, None where there is none.
        differs: True where the intervals do not overlap, False where they do, None where one is missing.
    """

    joint: str
    parameter: str
    before: float | None
    after: float | None
    before_ci95: Bounds | None
    after_ci95: Bounds | None
    differs: bool | None


@dataclass(frozen=True, slots=True)
class LevelChange:
    """Level of a joint's residual away from alarms; a mean without an interval. None where nothing was clean."""

    joint: str
    before_nm: float | None
    after_nm: float | None
    before_s: float
    after_s: float
    unit: str = "N·m"


@dataclass(frozen=True, slots=True)
class ContactChange:
    """A contact that only one audit has.

    Attributes:
        change: lost (only before), gained (only after); or, of different logs, listed for each.
        onset_s, end_s: on its own log's clock.
        joints: that alarmed.
        judged: share of its time in which the other audit judged those joints; None for another log.
        why: what its absence means.
    """

    change: Literal["lost", "gained", "before", "after"]
    onset_s: float
    end_s: float
    joints: tuple[str, ...]
    judged: float | None
    why: str


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two audits side by side.

    Attributes:
        schema: ``collaudit/comparison/1``.
        logs: names of the logs, before and after.
        same_log: whether both audited the same bytes.
        verdicts: of both.
        exclusions: what each verdict does not cover.
        noticed: force that each would have noticed, in words; empty where none is told.
        settings: what differs in rule, inputs and versions.
        friction: every parameter of either.
        residual: level by joint.
        kept: contacts that both have; None for different logs, whose contacts cannot be matched.
        contacts: those that only one has.
        findings: codes that only one has, with their count.
    """

    schema: str
    logs: tuple[str, str]
    same_log: bool
    verdicts: tuple[Verdict, Verdict]
    exclusions: tuple[tuple[str, ...], tuple[str, ...]]
    noticed: tuple[str, str]
    settings: tuple[Change, ...]
    friction: tuple[ParameterChange, ...]
    residual: tuple[LevelChange, ...]
    kept: int | None
    contacts: tuple[ContactChange, ...]
    findings: tuple[Change, ...]


def compare(before: Audit, after: Audit) -> Comparison:
    """What differs between two audits, of one log or of two."""
    a, b = before.result, after.result
    same = a.log.sha256 == b.log.sha256
    kept, contacts = _matched(before, after) if same else (None, _listed(a, b))
    return Comparison(
        schema=COMPARISON_SCHEMA,
        logs=(a.log.name, b.log.name),
        same_log=same,
        verdicts=(a.verdict, b.verdict),
        exclusions=(a.exclusions, b.exclusions),
        noticed=(noticed_brief(a), noticed_brief(b)),
        settings=tuple(_settings(a, b)),
        friction=tuple(_friction(a, b)),
        residual=tuple(_levels(a, b)),
        kept=kept,
        contacts=tuple(contacts),
        findings=tuple(_findings(a, b)),
    )


def _settings(a: AuditResult, b: AuditResult) -> Iterator[Change]:
    before, after = _facts(a), _facts(b)
    for what in dict.fromkeys((*before, *after)):
        if before.get(what) != after.get(what):
            yield Change(what, before.get(what), after.get(what))


def _asked(result: AuditResult) -> dict[str, str | None]:
    """Forces and torques that must alarm."""
    if result.sensitivity is None:
        return {}
    forces = {f"force that must alarm at {place_text(f)}, N": f.asked for f in result.sensitivity.forces}
    torques = {
        f"torque that must alarm on {joint}, {torque_unit(result, joint)}": s.asked
        for joint, s in result.sensitivity.joints.items()
    }
    return {
        **{what: f"{asked.force_n:.3g}" for what, asked in forces.items() if asked is not None},
        **{what: f"{asked.torque_nm:.3g}" for what, asked in torques.items() if asked is not None},
    }


def _facts(result: AuditResult) -> dict[str, str | None]:
    """Everything that was set, and what the numbers rest on."""
    rule, made = result.rule, result.provenance
    units = {joint: torque_unit(result, joint) for joint in rule.gamma_nm}
    hashes = {
        "configuration": made.config_sha256,
        "friction file": made.friction_sha256,
        "robot model": made.model_sha256,
    }
    return {
        "detector": rule.detector,
        "n": str(rule.n),
        "persistence, s": f"{rule.persistence_s:g}",
        "watched joints": ", ".join(rule.watch),
        "near miss, share of γ": f"{rule.near_miss_amplitude:g}",
        "near miss, share of n": f"{rule.near_miss_persistence:g}",
        **{f"γ of {joint}, {units[joint]}": f"{gamma:.6g}" for joint, gamma in rule.gamma_nm.items()},
        **{f"lasting γ of {joint}, {units[joint]}": f"{gamma:.6g}" for joint, gamma in rule.lasting_nm.items()},
        **_asked(result),
        **{f"{name} (hash)": None if value is None else value[:12] for name, value in hashes.items()},
        "collaudit": made.collaudit,
        **made.packages,
    }


def _friction(a: AuditResult, b: AuditResult) -> Iterator[ParameterChange]:
    for joint in dict.fromkeys((*a.friction, *b.friction)):
        one, other = a.friction.get(joint), b.friction.get(joint)
        known = [fit.parameters for fit in (one, other) if fit is not None]
        for name in dict.fromkeys(name for parameters in known for name in parameters):
            (before, bounds), (after, other_bounds) = _parameter(one, name), _parameter(other, name)
            differs = None if bounds is None or other_bounds is None else _apart(bounds, other_bounds)
            yield ParameterChange(joint, name, before, after, bounds, other_bounds, differs)


def _parameter(fit: FrictionFit | None, name: str) -> tuple[float | None, Bounds | None]:
    if fit is None or name not in fit.parameters:
        return None, None
    return fit.parameters[name], fit.ci95.get(name)


def _apart(a: Bounds, b: Bounds) -> bool:
    """Whether two intervals do not overlap; an open side reaches everywhere."""
    ends = [(-np.inf if low is None else low, np.inf if high is None else high) for low, high in (a, b)]
    return bool(ends[0][1] < ends[1][0] or ends[1][1] < ends[0][0])


def _levels(a: AuditResult, b: AuditResult) -> Iterator[LevelChange]:
    for joint in dict.fromkeys((*a.residual, *b.residual)):
        one, other = a.residual.get(joint), b.residual.get(joint)
        yield LevelChange(
            joint,
            None if one is None else one.clean_mean_abs_nm,
            None if other is None else other.clean_mean_abs_nm,
            0.0 if one is None else one.clean_s,
            0.0 if other is None else other.clean_s,
            torque_unit(a if one is not None else b, joint),
        )


def _matched(before: Audit, after: Audit) -> tuple[int, list[ContactChange]]:
    """How many contacts of one log both audits have, and those that only one has."""
    first, second = before.result.contacts, after.result.contacts
    lost = [contact for contact in first if not _has(second, contact)]
    gained = [contact for contact in second if not _has(first, contact)]
    changes = [_change("lost", contact, after.signals) for contact in lost]
    changes += [_change("gained", contact, before.signals) for contact in gained]
    return len(first) - len(lost), sorted(changes, key=lambda change: change.onset_s)


def _has(contacts: Sequence[Contact], wanted: Contact) -> bool:
    return any(c.onset_s <= wanted.end_s + _ROOM_S and wanted.onset_s <= c.end_s + _ROOM_S for c in contacts)


def _change(change: Literal["lost", "gained"], contact: Contact, other: Signals) -> ContactChange:
    """A contact that the other audit does not have: because it saw none, or because it could not judge."""
    share = _judged_share(contact, other)
    where = "after" if change == "lost" else "before"
    enough = share >= _JUDGED_SHARE
    why = (
        f"judged {where}, and no alarm"
        if enough
        else f"hidden by friction or not judged {where}: its absence says nothing"
    )
    return ContactChange(change, contact.onset_s, contact.end_s, contact.joints, share, why)


def _judged_share(contact: Contact, signals: Signals) -> float:
    inside = (signals.time_s >= contact.onset_s - 1e-9) & (signals.time_s <= contact.end_s + 1e-9)
    columns = [k for k, joint in enumerate(signals.joint_names) if joint in contact.joints]
    if not columns or not inside.any():
        return 0.0
    return float((signals.state[inside][:, columns] == State.JUDGED).mean())  # at rest friction may hide it


def _listed(a: AuditResult, b: AuditResult) -> list[ContactChange]:
    why = "another log: contacts cannot be matched"
    sides: tuple[tuple[Literal["before", "after"], AuditResult], ...] = (("before", a), ("after", b))
    return [
        ContactChange(side, contact.onset_s, contact.end_s, contact.joints, None, why)
        for side, result in sides
        for contact in result.contacts
    ]


def _findings(a: AuditResult, b: AuditResult) -> Iterator[Change]:
    counts = [Counter(finding.code for finding in result.findings) for result in (a, b)]
    for code in sorted({*counts[0], *counts[1]}):
        if bool(counts[0][code]) != bool(counts[1][code]):
            yield Change(code, *(str(count[code]) if count[code] else None for count in counts))
