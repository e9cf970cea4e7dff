"""Logs of free motion with many pushes, or without: the truth that injected contacts are compared with."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import patch

import numpy as np

from collaudit.fixtures import experiments
from collaudit.fixtures.pushes import Direction, Push
from collaudit.fixtures.robots.robot_registry import robot_named
from collaudit.fixtures.simulation import SimulatedFiles, simulate_to

#: Length and edge of each kind, s, and the range of forces, N, in which it is sometimes missed.
KINDS = {"knock": (0.012, 0.006, 30.0, 300.0), "push": (0.1, 0.03, 8.0, 80.0), "clamp": (0.6, 0.3, 8.0, 80.0)}
_APART_S = 1.6
_DIRECTIONS: tuple[Direction, ...] = ("around", "down", "inward")


def random_pushes(robot: str, seconds: float, seed: int, apart_s: float = _APART_S) -> tuple[Push, ...]:
    """Pushes of all kinds in turn on random links, with forces even in their logarithm."""
    rng, names = np.random.default_rng([seed, 77]), list(KINDS)
    links = len(robot_named(robot).links)
    out = []
    for k, onset in enumerate(np.arange(2.5, seconds - 3.0, apart_s)):
        duration, edge, low, high = KINDS[names[k % len(names)]]
        link = int(rng.integers(2, links + 1))
        force = float(np.exp(rng.uniform(np.log(low), np.log(high))))
        direction = _DIRECTIONS[int(rng.integers(3))]
        out.append(Push(link, force, direction, float(onset + rng.uniform(0.0, 0.4)), duration, edge))
    return tuple(out)


def kind_of(push: Push) -> str:
    """The name of a push's kind."""
    return next(name for name, (duration, *_) in KINDS.items() if duration == push.duration_s)


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
