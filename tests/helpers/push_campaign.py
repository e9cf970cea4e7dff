"""Logs of free motion with many pushes, or without."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import patch

from collaudit.fixtures import experiments
from collaudit.fixtures.pushes import Push
from collaudit.fixtures.simulation import SimulatedFiles, simulate_to


def free_log(
    robot: str, seed: int, seconds: float, pushes: tuple[Push, ...], out: Path, scenario: str = "free-clean"
) -> SimulatedFiles:
    """Free motion (or ``stop-go``) with these pushes, written as CSV.

    The motion is that of the scenario at this seed, whatever the pushes.
    """
    plain = experiments.free if scenario == "free-clean" else experiments.stop_go

    def pushed(*arguments: object) -> experiments.Experiment:
        from dataclasses import replace

        return replace(plain(*arguments), pushes=pushes)  # type: ignore[arg-type]

    with patch.object(experiments, plain.__name__, pushed):
        return simulate_to(scenario, robot, seed, "csv", out, duration_s=seconds)
