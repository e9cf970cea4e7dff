"""Findings: stated facts about data quality, each with a stable code and an effect on what may be judged.

What a finding does to coverage and verdict is its :attr:`Finding.effect`, from the table in
:mod:`~collaudit.core.findings.finding_kinds`; no other module looks at codes. A fact that code needs is a field of a
type, not a finding to search for.

In: what any stage noticed. Out: a Finding with its effect, and the joints it forbids judging.
Elsewhere: noticing (every stage), the verdict (verdict), showing (reports, cli).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace

from collaudit.core.findings.finding_kinds import FACT, KINDS, RENAMED, Effect, Kind, Severity

#: Finding code to its meaning.
CODES: dict[str, str] = {code: kind.meaning for code, kind in KINDS.items()}


@dataclass(frozen=True, slots=True)
class Finding:
    """One stated fact about the data or about a choice that was made for the user.

    Attributes:
        code: stable, kebab-case, listed in docs/findings.md.
        severity: ``info`` is worth knowing, ``warning`` limits trust, ``error`` forbids judging.
        text: one sentence with quantities and units.
        where: file, topic, column or channel, when there is one.
        joint: the joint concerned, when there is one.
        start_s: start of the stretch concerned, seconds from the log's first sample.
        end_s: its end.

    Raises:
        ValueError: the code is not in the table, or does not come with this severity.
    """

    code: str
    severity: Severity
    text: str
    where: str | None = None
    joint: str | None = None
    start_s: float | None = None
    end_s: float | None = None

    def __post_init__(self) -> None:
        if self.code in RENAMED:  # of a file that an earlier version wrote
            object.__setattr__(self, "code", RENAMED[self.code])
            if self.severity not in self.kind.effects:
                object.__setattr__(self, "severity", list(self.kind.effects)[-1])  # the gravest
        if self.code not in KINDS:
            raise ValueError(f"unknown finding code {self.code!r}: add it to core.findings.finding_kinds.KINDS")
        if self.severity not in self.kind.effects:
            raise ValueError(
                f"finding {self.code!r} has no severity {self.severity!r}: see core.findings.finding_kinds.KINDS"
            )

    @property
    def kind(self) -> Kind:
        """What its code stands for."""
        return KINDS[self.code]

    @property
    def effect(self) -> Effect:
        """What it does to coverage and verdict."""
        return self.kind.effects[self.severity]

    @property
    def excludes(self) -> bool:
        """Whether a pass does not cover what it speaks of."""
        return self.effect in ("excludes", "excludes-and-doubts")

    @property
    def doubts_alarms(self) -> bool:
        """Whether alarms of its joint may be errors of the model."""
        return self.effect in ("doubts-alarms", "excludes-and-doubts")

    @property
    def is_fact(self) -> bool:
        """Whether it changes nothing and leaves nothing to do."""
        return self.code == FACT

    @property
    def forbids_pass(self) -> bool:
        """Whether no log with it passes."""
        return self.effect.startswith("not-judged")


def fact(
    text: str,
    where: str | None = None,
    joint: str | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> Finding:
    """A fact about the log, or a choice that was made, which changes no verdict; arguments as of :class:`Finding`."""
    return Finding(FACT, "info", text, where, joint, start_s, end_s)


def joints_not_judged(findings: Iterable[Finding], joints: Collection[str]) -> frozenset[str]:
    """Joints of which nothing may be judged, by the effects of findings.

    Args:
        findings: of one log.
        joints: names of the joints to judge.

    Returns:
        Those a finding names with ``not-judged-joint``; all where it names none, or with ``not-judged-log``.
    """
    out: set[str] = set()
    for finding in findings:
        if finding.effect == "not-judged-log":
            return frozenset(joints)
        if finding.effect == "not-judged-joint":
            if finding.joint is None:
                return frozenset(joints)
            out.add(finding.joint)
    return frozenset(out & set(joints))


def without_errors_of(findings: Iterable[Finding], joints: Collection[str]) -> tuple[Finding, ...]:
    """The findings, where errors that concern only these joints, which are not to be judged, are warnings."""
    return tuple(
        replace(finding, severity="warning")
        if finding.effect == "not-judged-joint" and finding.joint in joints and "warning" in finding.kind.effects
        else finding
        for finding in findings
    )


#: What is written of turning joints, and in its place of sliding ones; longer ones first.
_SLIDING = (
    ("N·m·s/rad", "N·s/m"),
    ("N·m/rad", "N/m"),
    ("N·m", "N"),
    ("rad/s", "m/s"),
    (" rad", " m"),
)


def torque_unit_of(joint: str, sliding: Collection[str]) -> str:
    """Unit of what a joint's drive exerts: N of a sliding joint, N·m of any other."""
    return "N" if joint in sliding else "N·m"


def text_in_joint_units(text: str, joint: str, sliding: Collection[str]) -> str:
    """A text about one joint in that joint's units.

    Args:
        text: written as of a turning joint.
        joint: its name.
        sliding: names of the prismatic joints.
    """
    if joint in sliding:
        for turning, ours in _SLIDING:
            text = text.replace(turning, ours)
    return text


def in_joint_units(findings: Iterable[Finding], sliding: Collection[str]) -> tuple[Finding, ...]:
    """Findings with the units of sliding joints; said of several joints, the sliding ones are named with theirs.

    Args:
        findings: written as of turning joints.
        sliding: names of the prismatic joints.
    """
    return tuple(_in_units(finding, sliding) for finding in findings) if sliding else tuple(findings)


def _in_units(finding: Finding, sliding: Collection[str]) -> Finding:
    text = finding.text if finding.joint is None else text_in_joint_units(finding.text, finding.joint, sliding)
    if finding.joint is None and any(unit in text for unit, _ in _SLIDING):
        named = [joint for joint in sliding if joint in text]
        note = f" ({', '.join(named)} slides: N, m and m/s.)"
        if named and not text.endswith(note):
            text += note
    return finding if text == finding.text else replace(finding, text=text)
