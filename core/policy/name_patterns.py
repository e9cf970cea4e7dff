"""Patterns of paths, URLs and names, as rules of fleets, policies and waivers have them."""

from __future__ import annotations

from collections.abc import Iterable
from fnmatch import fnmatchcase

from collaudit.core.config.schema import PolicyOverride, Waiver


def matches(text: str, patterns: Iterable[str]) -> bool:
    """Whether a path, URL or name is meant by one of the patterns.

    Args:
        text: with ``/`` between folders.
        patterns: with ``*`` (over folders, too), ``?`` and ``[…]``. One that does not begin with ``/`` or a scheme is
            also tried from every folder on: ``cell1/*`` means ``logs/cell1/a.mcap``, and not ``logs/xcell1/a.mcap``.
    """
    plain = text.removeprefix("./")
    return any(fnmatchcase(plain, pattern) or fnmatchcase(plain, f"*/{pattern}") for pattern in patterns)


def concerns(rule: PolicyOverride | Waiver, place: str, robot: str | None) -> bool:
    """Whether an override or a waiver is for a log.

    Args:
        rule: with patterns of robots and logs; it is for every one where it has none.
        place: path or URL of the log.
        robot: whose it is, None without a fleet.
    """
    if rule.robots and (robot is None or not matches(robot, rule.robots)):
        return False
    return not rule.logs or matches(place, rule.logs)
