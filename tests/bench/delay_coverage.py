"""How often 95 % intervals of delays hold the truth: ``python delay_coverage.py [SEEDS] [DOCS]``.

SEEDS (200) is their number for each kind of motion and noise, from 1001 on; DOCS is the page whose table between
``<!-- coverage-delay -->`` marks is replaced.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.with_name("helpers")))
from delayed_channels import found_and_true
from tables import put

from collaudit.core.prepare.channel_delay import Delay

FIRST = 1001
#: What is said of it; motion, noise as a share of the signal, its memory from sample to sample, hold s, carries.
CASES = (
    ("white noise only", "rich", 1.0, 0.0, 0.0, False),
    ("noise with a memory of 0.4 s only", "rich", 1.0, 0.99, 0.0, False),
    ("noise only, periodic motion", "periodic", 1.0, 0.9, 0.0, False),
    ("rich motion, 30 % white noise", "rich", 0.3, 0.0, 0.0, True),
    ("rich motion, 30 % noise with a memory of 80 ms", "rich", 0.3, 0.95, 0.0, True),
    ("rich motion, held at 50 Hz", "rich", 0.1, 0.9, 0.02, True),
    ("point to point, 10 % noise", "moves", 0.1, 0.9, 0.0, True),
    ("point to point, held at 50 Hz", "moves", 0.1, 0.9, 0.02, True),
    ("periodic motion, 30 % noise", "periodic", 0.3, 0.95, 0.0, True),
    ("slow motion, 30 % noise", "slow", 0.3, 0.95, 0.0, True),
    ("slow motion, 10 % noise", "slow", 0.1, 0.9, 0.0, True),
)


def rows(seeds: int) -> Iterator[str]:
    """The table's lines."""
    yield "| channel | determined | interval holds | median width |"
    yield "|---|---|---|---|"
    for text, kind, noise, rho, held_s, carries in CASES:
        pairs = [found_and_true(kind, noise, rho, held_s, FIRST + k, carries) for k in range(seeds)]
        told = [(found, true) for found, true in pairs if isinstance(found, Delay)]
        held = sum(found.ci95[0] <= true <= found.ci95[1] for found, true in told)
        width = 1e3 * float(np.median([f.ci95[1] - f.ci95[0] for f, _ in told])) if told else 0.0
        share = f"{held} of {len(told)} ({100 * held / len(told):.0f} %)" if told else "–"
        yield f"| {text} | {len(told)} of {seeds} | {share} | {f'{width:.1f} ms' if told else '–'} |"


if __name__ == "__main__":
    lines = list(rows(int(sys.argv[1]) if len(sys.argv) > 1 else 200))
    print("\n".join(lines))
    if len(sys.argv) > 2:
        put(Path(sys.argv[2]), "coverage-delay", lines)
