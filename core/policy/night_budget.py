"""The budget of near misses over all logs of a robot in one night: single logs are too short to tell a rate."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.verdict.verdict import near_miss_breach


def budget_breaches(logs: Sequence[tuple[str | None, AuditResult]]) -> list[str]:
    """Why the near misses of a night break the policy, a sentence a robot.

    Args:
        logs: audited ones, each with its robot; None without a fleet.
    """
    breaches = []
    for robot in dict.fromkeys(robot for robot, _ in logs):
        own = [result for name, result in logs if name == robot]
        limits = [one.limits.max_near_misses_per_hour for one in own if one.limits is not None]
        limit = next((limit for limit in limits if limit is not None), None)
        if len(own) > 1:
            count, recorded_s = sum(len(one.near_misses) for one in own), sum(one.coverage.recorded_s for one in own)
            where = f", {len(own)} logs" + (f" of robot {robot}" if robot else "")
            breaches += near_miss_breach(count, recorded_s, limit, where)
    return breaches
