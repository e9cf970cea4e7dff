"""What ``[policy] same_log = "folds"`` finds in a log that nothing but itself was fitted on, beside another day's fit.

    python tests/bench/same_log_table.py --data DIR [--arms paper6,seven] [--seeds 6] [--work DIR]

Every log has one to four pushes of the force that a verdict asks for by itself, or none. In logs of one motion that
comes back, a touch comes back with it, or lasts throughout.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from changed_logs import fitted, judged
from simulated_days import Arm, Push, arm_of, day

from collaudit.core.config import LoadedConfig
from collaudit.core.data.audit_result import Audit
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.signals import State

SECONDS, CYCLE_S, PUSH_N, LEAN_N = 150.0, 15.0, 100.0, 30.0


def pushes_of(seed: int, count: int) -> list[Push]:
    """So many pushes from any direction, apart from each other."""
    rng = np.random.default_rng([seed, count, 62])
    slots = rng.permutation(np.arange(6.0, SECONDS - 6.0, 8.0))[:count]
    return [Push(float(slot + rng.uniform(0.0, 4.0)), force(rng, PUSH_N)) for slot in sorted(slots)]


def force(rng: np.random.Generator, size_n: float) -> tuple[float, float, float]:
    """A force from any direction."""
    x, y, z = rng.normal(size=3)
    scale = size_n / float(np.hypot(np.hypot(x, y), z))
    return float(scale * x), float(scale * y), float(scale * z)


def by_folds(arm: Arm) -> LoadedConfig:
    """The arm's settings, with a log judged by its own folds."""
    config = arm.described.config
    policy = config.policy.changed({"same_log": "folds"})
    return replace(arm.described, config=config.changed({"policy": policy}))


def in_cycles(arm: Arm, seed: int, pushes: Sequence[Push]) -> JointLog:
    """A log of one motion that comes back every ``CYCLE_S``, with a way back to its beginning."""
    return day(arm, seed, SECONDS, pushes, first=True, cycle_s=CYCLE_S)


def found(audit: Audit, pushes: Sequence[Push]) -> int:
    """How many pushes have a contact that began while they lasted, or was there."""
    spans = [(one.onset_s, one.end_s) for one in audit.result.contacts]
    return sum(any(a < push.start_s + push.lasts_s + 0.2 and b > push.start_s for a, b in spans) for push in pushes)


def gamma_nm(audit: Audit) -> np.ndarray:
    """(j,) the threshold in force in motion, its median."""
    signals = audit.signals
    moving = signals.state == State.JUDGED
    return np.array([np.median(signals.gamma_nm[moving[:, j], j]) for j in range(moving.shape[1])])


def cases(arm: Arm, seed: int) -> Iterator[tuple[str, JointLog, list[Push]]]:
    """Logs by what is done in them."""
    for count in range(5):
        pushes = pushes_of(seed, count)
        yield f"{count} pushes", day(arm, seed, SECONDS, pushes, first=True), pushes
    rng = np.random.default_rng([seed, 63])
    side, at = force(rng, PUSH_N), float(rng.uniform(2.0, CYCLE_S - 2.0))
    every = [Push(at + CYCLE_S * k, side) for k in range(round(SECONDS / CYCLE_S))]
    yield "a push in every cycle", in_cycles(arm, seed, every), every
    lean = [Push(0.0, force(rng, LEAN_N), SECONDS)]
    yield "a lean throughout", day(arm, seed, SECONDS, lean, first=True), lean


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--data", type=Path, required=True)
    asked.add_argument("--work", type=Path, default=Path("build/same_log"))
    asked.add_argument("--arms", default="paper6,seven")
    asked.add_argument("--seeds", type=int, default=6)
    asked.add_argument("--seed", type=int, default=621)
    given = asked.parse_args()
    for name in given.arms.split(","):
        arm = arm_of(name, given.work, given.data / "urdf")
        settings, count, ratios = by_folds(arm), Counter[str](), []
        for seed in range(given.seed, given.seed + given.seeds):
            other = fitted([day(arm, seed + 5000, SECONDS, first=True)], arm.described)
            for what, log, pushes in cases(arm, seed):
                own, beside = judged(log, settings, None), judged(log, arm.described, other)
                plain = own.result.verdict == "pass" and not own.result.exclusions
                kind = "pushes" if what.endswith(" pushes") and pushes else what
                count.update({
                    f"{kind}: logs": 1, f"{kind}: {own.result.verdict}": 1, f"{kind}: plain passes": int(plain),
                    f"{kind}: pushes": len(pushes), f"{kind}: found": found(own, pushes),
                    f"{kind}: found with another fit": found(beside, pushes),
                    f"{kind}: contacts": len(own.result.contacts),
                    f"{kind}: contacts with another fit": len(beside.result.contacts),
                })  # fmt: skip
                ratio = gamma_nm(own) / gamma_nm(beside)
                if not what.startswith("a "):
                    ratios.append(ratio)
                print(f"{name} {seed} {what:22s} {own.result.verdict:10s} found {found(own, pushes)} "
                      f"of {len(pushes)}, {found(beside, pushes)} with another fit; gamma x {np.median(ratio):.2f} "
                      f"{own.result.reasons[0] if own.result.verdict == 'not_judged' else ''}", flush=True)  # fmt: skip
        print(name, dict(count))
        print(f"{name} gamma over another fit's: median {np.median(ratios):.3f}, "
              f"of a log's median joint at most {max(np.median(one) for one in ratios):.3f}")  # fmt: skip


if __name__ == "__main__":
    main()
