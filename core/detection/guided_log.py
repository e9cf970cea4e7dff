"""The log to be judged, with what friction shows of its efforts: hand guiding, how far they are smoothed."""

from __future__ import annotations

from collaudit.core.config.schema import Config
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.friction.applied_friction import AppliedFriction
from collaudit.core.prepare.guided_stretches import with_effort_smoothing, without_guiding
from collaudit.core.prepare.prepared import Prepared


def judged_log(prepared: Prepared, applied: AppliedFriction, config: Config) -> tuple[Prepared, UniformSeries]:
    """The log with guided stretches marked, and its series to judge.

    Args:
        prepared: the log.
        applied: friction, which tells what the drives supply.
        config: ``[detect] hand_guiding``, ``[policy] observable_ms``.
    """
    friction = {joint: law.torque for joint, law in applied.laws.items()}
    marked = with_effort_smoothing(without_guiding(prepared, friction, config), friction, config)
    return marked, marked.judged_series
