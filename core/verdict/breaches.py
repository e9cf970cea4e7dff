"""Limits on what happened in a log, in words where they are exceeded."""

from __future__ import annotations

from collections.abc import Sequence

from scipy.special import gammaincinv as gamma_quantile

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
            f"Findings doubt the effort or the model of {', '.join(doubtful)}: alarms there may be errors of the model."
        )
    reasons += [f.text for f in doubting if f.kind.setting == "detect.gamma_nm"]
    return reasons


def near_miss_breach(count: int, recorded_s: float, most_per_hour: float | None, where: str = "") -> list[str]:
    """Why near misses break the policy: the lower bound of their rate exceeds it. Nothing where they do not.

    Args:
        count: of near misses.
        recorded_s: seconds recorded.
        most_per_hour: so many an hour are allowed; None for any number.
        where: words for the logs they are counted in, if not one alone.
    """
    if most_per_hour is None or not count or least_per_hour(count, recorded_s) <= most_per_hour:
        return []
    return [near_miss_rate(count, recorded_s, most_per_hour, where)]


def near_miss_rate(count: int, recorded_s: float, most_per_hour: float, where: str = "") -> str:
    """The rate of near misses with its lower bound, beside the limit, in words; arguments as above."""
    hourly = f"{count / (recorded_s / 3600.0):.3g} an hour"
    return (
        f"{counted(count, 'near miss', 'near misses')} in {seconds_text(recorded_s)}{where}: {hourly}, "
        f"at least {least_per_hour(count, recorded_s):.3g} (95 %; policy: at most {most_per_hour:g})."
    )


def least_per_hour(count: int, recorded_s: float) -> float:
    """The lower 95 % bound of a rate an hour, of a count of Poisson events (exact; Garwood 1936)."""
    if not count or recorded_s <= 0:
        return 0.0
    return float(gamma_quantile(count, 0.05)) / (recorded_s / 3600.0)


def counted(number: int, one: str, many: str | None = None) -> str:
    """A number and its noun."""
    return f"{number} {one if number == 1 else many or one + 's'}"
