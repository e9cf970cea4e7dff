"""Findings in the units of the joint that they are about: those of prismatic joints speak of forces and ways."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace

from collaudit.core.findings.finding import Finding

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
