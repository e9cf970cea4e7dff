"""How often 95 % intervals of drive gains hold the truth, on fast motion: ``python gain_coverage.py CACHE [SEEDS]``.

CACHE is a folder for the simulated motions (arm ``paper6``); SEEDS (30) is their number.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
from coverage_logs import logged, motion, streams

from collaudit.core.config.schema import Config
from collaudit.core.identification.identify import identify
from collaudit.core.prepare import prepare
from collaudit.fixtures.robots import robot_named
from collaudit.fixtures.simulate import plan

SCENARIO, SECONDS = "free-clean", 60.0


def main(cache: Path, seeds: int) -> None:
    """Print coverage, bias, error and half width of each joint's gain, relative to the true gain of 1."""
    cache.mkdir(parents=True, exist_ok=True)
    arm = robot_named("paper6")
    model = arm.model()
    config = Config.model_validate({"fit": {"estimate": ["gain"], "blocks": 2}, "log": {"units": {"effort": "raw"}}})
    found: dict[str, list[tuple[bool, float, float]]] = defaultdict(list)
    for seed in range(1, seeds + 1):
        rngs = streams(SCENARIO, seed)
        kept = cache / f"paper6-free60-{seed}.npz"
        trace = motion(plan(SCENARIO, arm, model, rngs[0], SECONDS), arm, model, kept)
        identified = identify([prepare(logged(trace, arm, model, rngs[2], raw=True), model, config)], config)
        assert identified is not None
        for joint, facts in identified.joints.items():
            if facts.gain is not None and facts.gain_ci95 is not None:
                low, high = (x or 0.0 for x in facts.gain_ci95)
                found[joint].append((low <= 1.0 <= high, facts.gain - 1.0, 0.5 * (high - low)))
    print("| joint | gain shown | held the truth | bias | RMS error | half width |\n|---|---|---|---|---|---|")
    for joint, its in found.items():
        held, error, half = (np.array(x, dtype=float) for x in zip(*its, strict=True))
        print(
            f"| {joint} | {len(its)} of {seeds} | {100 * held.mean():.0f} % | {100 * error.mean():+.2f} % "
            f"| {100 * np.sqrt(np.mean(error**2)):.2f} % | {100 * half.mean():.2f} % |"
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 30)
