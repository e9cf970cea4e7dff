"""Limits on what happened in a log, in words where they are exceeded."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.detection_result import Contact
from collaudit.core.findings import Finding
from collaudit.core.verdict.exclusions import seconds_text


def contact_breach(contacts: Sequence[Contact], most: int, findings: Sequence[Finding]) -> list[str]:
    """Why contacts break the policy; nothing where they do not.

    Args:
        contacts: of the log.
        most: as many are allowed.
        findings: of the log; those that doubt alarms of these joints are said.
    """
    if len(contacts) <= most:
        return []
    joints = sorted({joint for contact in contacts for joint in contact.joints})
    reasons = [f"{counted(len(contacts), 'contact')} (policy: at most {most}), on {', '.join(joints)}."]
    intended = sum(contact.kind == "meant" for contact in contacts)
    if intended:
        reasons.append(
            f"{intended} of them {'looks' if intended == 1 else 'look'} intended. The policy counts every contact, "
            "since what was intended is an estimate."
        )
    doubting = [f for f in findings if f.doubts_alarms and f.joint in joints]
    doubtful = sorted({f.joint for f in doubting if f.joint is not None})
    if doubtful:
        reasons.append(
            f"The model or friction of {', '.join(doubtful)} fits too poorly for the threshold: alarms there may "
            "be errors of the model (see the findings)."
        )
    reasons += [f.text for f in doubting if f.kind.setting == "detect.gamma_nm"]
    return reasons


def near_miss_breach(count: int, recorded_s: float, most_per_hour: float | None) -> list[str]:
    """Why near misses break the policy; nothing where they do not.

    Args:
        count: of near misses.
        recorded_s: seconds recorded.
        most_per_hour: so many an hour are allowed; None for any number.
    """
    if most_per_hour is None or not count or recorded_s <= 0:
        return []
    rate = count / (recorded_s / 3600.0)
    if rate <= most_per_hour:
        return []
    return [
        f"{counted(count, 'near miss', 'near misses')} in {seconds_text(recorded_s)} is "
        f"{rate:.4g} an hour (policy: at most {most_per_hour:g})."
    ]


def counted(number: int, one: str, many: str | None = None) -> str:
    """A number and its noun."""
    return f"{number} {one if number == 1 else many or one + 's'}"
