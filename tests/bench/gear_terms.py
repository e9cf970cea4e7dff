"""What each term beyond friction over speed earns on recordings that were left out whole.

    python tests/bench/gear_terms.py --data DIR [--work DIR] [--arms paper6,seven] [--real 0]

Every robot of DIR with two recordings or more, and simulated arms with one imperfection each: fitted on all but one
recording, which is judged with the fit, and with the fit less one term. A number is by how much the residual's RMS
grows without the term, on the joints that have it and on all. Springs are also forced on all joints where the fit
takes none. What temperature earns is in ``friction_temperature.py``.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np
from changed_logs import fitted, judged
from real_log_list import REAL_LOGS

from collaudit.core import api
from collaudit.core.config import LoadedConfig, load_config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.identification import estimate_choice
from collaudit.core.prepare.prepared import Prepared
from collaudit.fixtures.simulation import simulate_to

Recordings = tuple[str, LoadedConfig, list[tuple[Path, ...]]]
#: Robots by the names of their recordings in ``real_log_list.py``.
_ROBOTS = {"UR3": ("UR3 id1", "UR3 id2", "UR3 2019"), "FR3": ("FR3 a", "FR3 b"), "KR300": ("KR300 A", "KR300 A to C")}
_IMPERFECTIONS = ("", "gear-ripple", "load-friction", "warm-up", "springs", "cogging", "wrong-cad")
SECONDS = 120.0


def real(data: Path, work: Path) -> Iterator[Recordings]:
    """Robots with several recordings."""
    for robot, names in _ROBOTS.items():
        its = [log for log in REAL_LOGS if log.name in names]
        yield robot, its[0].settings(data, work), [log.files(data, work) for log in its]


def simulated(arms: Sequence[str], work: Path) -> Iterator[Recordings]:
    """Two recordings of each arm with each imperfection."""
    for arm in arms:
        for name in _IMPERFECTIONS:
            made = [
                simulate_to("free-clean", arm, seed, "csv", work / f"{arm}-{name}-{seed}.csv", duration_s=SECONDS,
                            mismatch_percent=10.0 if name == "wrong-cad" else 0.0,
                            imperfections=(name,) if name not in ("", "wrong-cad") else ())
                for seed in (1, 2)
            ]  # fmt: skip
            settings = load_config(made[0].config, {"detect.gamma_nm": "auto"})
            yield (
                f"{arm} {name or 'as it is'}",
                settings,
                [one.log if isinstance(one.log, tuple) else (one.log,) for one in made],
            )


def without(part: str) -> Callable[[FrictionFile], FrictionFile]:
    """The file less a part of its corrections."""
    empty = {"load": None, "ripple": ()}

    def less(file: FrictionFile) -> FrictionFile:
        return replace(file, corrections={k: replace(x, **{part: empty[part]}) for k, x in file.corrections.items()})

    return less


def without_temperature(file: FrictionFile) -> FrictionFile:
    """The file less its trends with temperature."""
    return replace(file, trends={})


def rms(log: Prepared, settings: LoadedConfig, friction: FrictionFile) -> dict[str, float]:
    """Residual of a log's joints, N·m."""
    made = judged(log, settings, friction)
    return {name: its.rms_nm for name, its in made.result.residual.items() if its.rms_nm}


def gains(whole: dict[str, float], less: dict[str, float], having: Sequence[str]) -> str:
    """In words."""
    grown = {name: less[name] / whole[name] - 1.0 for name in whole if name in less}
    its = [grown[name] for name in having if name in grown]
    listed = ", ".join(f"{name} {100 * grown[name]:+.1f}" for name in having if name in grown)
    return f"{len(its)} joints {100 * np.mean(its):+.1f} % (all {100 * np.mean(list(grown.values())):+.1f} %): {listed}"


def measure(name: str, settings: LoadedConfig, logs: list[tuple[Path, ...]]) -> None:
    """One robot: each recording left out in turn."""
    for out in range(len(logs)):
        ready = [api.prepare(files, settings) for files in logs]
        rest = [log for k, log in enumerate(ready) if k != out]
        friction = fitted(rest, settings)
        whole = rms(ready[out], settings, friction)
        taken = None if friction.choice is None else friction.choice.taken
        head = f"{name}, without recording {out + 1} ({taken}):"
        print(head, ", ".join(f"{joint} {x:.3g}" for joint, x in whole.items()), flush=True)
        for part in ("load", "ripple"):
            having = [joint for joint, its in friction.corrections.items() if getattr(its, part)]
            if having:
                less = rms(ready[out], settings, without(part)(friction))
                print(f"  {part}: {gains(whole, less, having)}", flush=True)
        warm = [
            j for j, its in friction.trends.items() if any(t.against == "temperature" and t.shown for t in its.trends)
        ]
        if warm:
            print(
                f"  temperature: {gains(whole, rms(ready[out], settings, without_temperature(friction)), warm)}",
                flush=True,
            )
        joints = {} if friction.identified is None else friction.identified.joints
        sprung = [joint for joint, its in joints.items() if its.angle_torque is not None]
        if sprung:
            with mock.patch.object(estimate_choice, "with_springs", lambda tried, _: tuple(tried)):
                plain = fitted(rest, settings)
            print(f"  spring: {gains(whole, rms(ready[out], settings, plain), sprung)}", flush=True)
        elif friction.identified is not None:
            fit = settings.config.fit.changed({"estimate": [*friction.identified.estimate, "spring"]})
            forced = replace(settings, config=settings.config.changed({"fit": fit}))
            sprung = rms(ready[out], settings, fitted(rest, forced))
            print(f"  spring, forced: {gains(sprung, whole, list(sprung))}", flush=True)


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--data", type=Path, required=True)
    asked.add_argument("--work", type=Path, default=Path("build/gear_terms"))
    asked.add_argument("--arms", default="paper6,seven")
    asked.add_argument("--real", type=int, default=1)
    given = asked.parse_args()
    given.work.mkdir(parents=True, exist_ok=True)
    if given.real:
        for robot in real(given.data, given.work):
            measure(*robot)
    for arm in simulated([a for a in given.arms.split(",") if a], given.work):
        measure(*arm)


if __name__ == "__main__":
    main()
