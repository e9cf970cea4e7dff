"""Intervals of a contact's force hold the true force, and its possible links hold the true link."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from collaudit.core.data.audit_result import Audit
from collaudit.fixtures.compare import read_truth
from collaudit.fixtures.simulation import SimulatedFiles


def test_intervals_hold_the_true_force(audit_of: Callable[..., tuple[SimulatedFiles, Audit]], robot: str) -> None:
    held, linked, told = 0, 0, 0
    for seed in (5, 6):
        files, audit = audit_of("free-hits", robot, seed=seed)
        truth = read_truth(files.truth)
        for push in [*truth["collisions"], *truth["near_misses"], *truth["below_threshold"]]:
            end_s = push["onset_s"] + push["duration_s"]
            its = [c for c in audit.result.contacts if c.onset_s < end_s and c.end_s > push["onset_s"]]
            if len(its) != 1 or its[0].force is None:
                continue
            size, (low, high) = float(np.linalg.norm(push["force_n"])), its[0].force.size_ci95_n
            held, told = held + (low <= size <= (np.inf if high is None else high)), told + 1
            linked += push["frame"] in {link.frame for link in its[0].force.links}
            assert its[0].least_force is None or its[0].least_force.force_n <= min(low, size)
    assert told > 20 and held >= 0.95 * told and linked >= 0.97 * told
