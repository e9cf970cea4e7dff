"""Whether a payload's mass lies within its interval: each of another day, with a fit of its own.

    python tests/bench/payload_mass.py --data DIR [--arms paper6,seven,ur10_robot.urdf] [--payloads 40] [--pushed 4]

Fitted with one payload stated, judged with another that is not (``payload_table.py`` has the other statements). The
first ones are also pushed with 100 N at the tool, and judged with ``mass_kg = "estimate"``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from cause_table import loaded
from changed_logs import fitted, judged
from payload_table import FITTED_S, JUDGED_S, PUSH_N, payload, stated
from same_log_table import force, found
from simulated_days import Push, arm_of, day


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--data", type=Path, required=True)
    asked.add_argument("--work", type=Path, default=Path("build/payloads"))
    asked.add_argument("--arms", default="paper6,seven,ur10_robot.urdf")
    asked.add_argument("--payloads", type=int, default=40)
    asked.add_argument("--pushed", type=int, default=4)
    asked.add_argument("--seed", type=int, default=200)
    given = asked.parse_args()
    for name in given.arms.split(","):
        arm, off = arm_of(name, given.work, given.data / "urdf"), list[tuple[float, float]]()
        for seed in range(given.seed, given.seed + given.payloads):
            rng = np.random.default_rng([seed, 623])
            a, b, other = payload(rng), payload(rng), 1000 * seed + 7
            friction = fitted([day(loaded(arm, *a), seed, FITTED_S, first=True)], stated(arm, *a))
            causes = judged(day(loaded(arm, *b), other, JUDGED_S), arm.described, friction).result.causes
            told = [one for one in causes if one.code == "tool"]
            if told:
                off.append((told[0].value[0] - b[0], 0.5 * float(np.diff(told[0].ci95[0])[0])))
                print(f"{name} {seed} {b[0]:.3f} kg: off by {off[-1][0]:+.4f} (± {off[-1][1]:.4f})", flush=True)
            if seed < given.seed + given.pushed:
                pushes = [Push(float(t), force(rng, PUSH_N)) for t in np.arange(8.0, JUDGED_S - 5.0, 9.0)]
                pushed = day(loaded(arm, *b), other, JUDGED_S, pushes)
                audit = judged(pushed, stated(arm, "estimate", (0.0, 0.0, 0.0)), friction)
                print(f"  estimated: {found(audit, pushes)} of {len(pushes)} pushes found, "
                      f"{len(audit.result.contacts)} contacts", flush=True)  # fmt: skip
        error, half = np.array(off).T
        within = float((np.abs(error) < half).mean())
        print(f"{name}: {error.size} told, within {within:.3f}, RMS {1e3 * error.std():.1f} g")


if __name__ == "__main__":
    main()
