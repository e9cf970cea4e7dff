"""Whether a value of a joint changed over nights, whose logs are replicates of each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Literal

import numpy as np
from scipy.special import stdtrit as student_quantile

ChangeState = Literal["changed", "no change shown", "too few", "not tested"]
#: From so many nights on their scatter is known; of fewer only that of the logs within a night is.
_NIGHTS = 4


@dataclass(frozen=True, slots=True)
class Change:
    """A value over nights, as it divides best into before and after.

    Attributes:
        state: ``changed``: the intervals of before and after do not meet; ``no change shown``: they do; ``too few``
            nights or logs for an interval; ``not tested``: not in the last night of the robot.
        since: first night of after, ISO date; None unless changed.
        before, now: mean and the two ends of its interval (95 % over all divisions together); None where not known.
    """

    state: ChangeState
    since: str | None = None
    before: tuple[float, float, float] | None = None
    now: tuple[float, float, float] | None = None


def change_of(nights: Sequence[tuple[str, Sequence[float]]], last: str) -> Change:
    """Whether, and since when, a value is another.

    Of every division of the nights into before and after the one counts whose means differ most in their standard
    errors. A night's mean scatters with what nights differ by and, of n logs, a share 1/n of what its logs differ by.

    Args:
        nights: ISO date and the value in each log, in order; nights without any are left out.
        last: the last night of the robot.
    """
    if not nights or nights[-1][0] != last:
        return Change("not tested")
    means = np.array([np.mean(values) for _, values in nights])
    free = sum(len(values) - 1 for _, values in nights)
    within = sum(float(np.var(values)) * len(values) for _, values in nights) / free if free else 0.0
    of_logs = within * float(np.mean([1.0 / len(values) for _, values in nights]))
    freedom = means.size - 2 if means.size >= _NIGHTS else free
    if means.size < 2 or freedom < 1:
        return Change("too few")
    best: tuple[float, Change] | None = None
    reach = float(student_quantile(freedom, 1.0 - 0.025 / (means.size - 1)))
    for first in range(1, means.size):
        sides = (means[:first], means[first:])
        of_nights = sum(float(np.var(side)) * side.size for side in sides) / max(means.size - 2, 1)
        spread = max(of_logs, of_nights) if means.size >= _NIGHTS else of_logs
        before, now = (_bounds(side, reach * sqrt(spread / side.size)) for side in sides)
        apart = abs(now[0] - before[0]) / max(sqrt(spread * (1.0 / first + 1.0 / (means.size - first))), 1e-12)
        changed = now[1] > before[2] or now[2] < before[1]
        found = Change("changed" if changed else "no change shown", nights[first][0] if changed else None, before, now)
        if best is None or apart > best[0]:
            best = apart, found
    return Change("too few") if best is None else best[1]


def _bounds(values: np.ndarray, half_width: float) -> tuple[float, float, float]:
    mean = float(np.mean(values))
    return mean, mean - half_width, mean + half_width
