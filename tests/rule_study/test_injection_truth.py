"""Pushes that are simulated and pushes that are added to another log are missed alike."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from injection_truth import difference_sd, injected_outcomes, simulated_outcomes
from push_campaign import KINDS, free_log, kind_of, random_pushes
from simulated_logs import Once

from collaudit.core.data.audit_result import FrictionFile

SECONDS = 70.0


def test_injected_and_simulated_pushes_are_missed_alike(once: Once, friction_of: Callable[[str], FrictionFile]) -> None:
    """Forty of each; three standard errors of the difference. ``tests/bench/injection_table.py`` has hundreds."""
    pushes = random_pushes("paper6", SECONDS, 301, apart_s=1.2)
    friction = friction_of("paper6")

    def simulate(folder: Path) -> tuple[object, object]:
        hit = free_log("paper6", 301, SECONDS, pushes, folder / "hit.csv")
        return hit, free_log("paper6", 801, SECONDS, (), folder / "clean.csv")

    hit, clean = once(("injection truth", SECONDS), simulate)
    simulated = simulated_outcomes(hit, pushes, friction, {})
    injected = injected_outcomes(clean, "paper6", pushes, friction, {})
    assert len(simulated) == len(injected) == len(pushes) >= 50
    for kind in (*KINDS, None):
        a, b = (
            np.array([not o.noticed for o in found if kind in (None, kind_of(o.push))])
            for found in (simulated, injected)
        )
        assert abs(difference_sd(a, b)) < 3.0, kind
    share = np.mean([not o.noticed for o in simulated])
    assert 0.3 < share < 0.9, "forces at which some are missed and some are not"
