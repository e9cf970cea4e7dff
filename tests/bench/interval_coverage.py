"""How often 95 % intervals hold the truth on simulated logs.

``python interval_coverage.py CACHE [SEEDS [DOCS [WITH]]]``: CACHE is a folder for the simulated motions and for what
was read off each seed's log, so that fitting again is cheap. SEEDS (200) is their number for each arm. DOCS ("-": none)
is the page whose tables between ``<!-- name -->`` marks are replaced: ``coverage-friction`` with the law each joint
obeys, ``coverage-auto`` with the law that ``auto`` chooses. With WITH, imperfections (``springs,elastic,…``, of those
that leave the truth of friction as it is), it is ``coverage-imperfect`` instead: one joint of each arm, a run of a
minute and a half. SEEDS 0 makes the table of the seeds that are there.
"""

from __future__ import annotations

import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import asdict, replace
from json import dumps, loads
from pathlib import Path

import numpy as np
from coverage_logs import SAME, logged, motion, streams, truth
from identified_coverage import described
from tables import put

from collaudit.core.config.schema import Config
from collaudit.core.data.friction_result import FrictionFit, FrictionPoint
from collaudit.core.friction.friction_fitting import fit_friction
from collaudit.core.friction.joint_fits import fit_joints
from collaudit.core.friction.law_candidates import FrictionUnits, parameter_symbol
from collaudit.core.prepare.preparation import prepare
from collaudit.core.prepare.prepared import Prepared
from collaudit.fixtures.arms import robot_named
from collaudit.fixtures.experiments import FRICTION_SPEEDS
from collaudit.fixtures.experiments import friction as friction_run
from collaudit.fixtures.imperfections import geared, loads_nm
from collaudit.fixtures.simulation import plan

ROBOTS = ("paper6", "seven")
UNITS = FrictionUnits.of("revolute", "Nm")


def points_of(cache: Path, robot: str, seeds: int) -> Iterator[dict[str, list[FrictionPoint]]]:
    """Friction points of each joint, seed after seed."""
    arm = robot_named(robot)
    model = arm.model()
    trace = None
    for seed in range(1, seeds + 1):
        kept = cache / f"{robot}-friction-{seed}.json"
        if not kept.exists():
            rngs = streams("friction", seed)
            if trace is None:
                trace = motion(plan("friction", arm, model, rngs[0]), arm, model, cache / f"{robot}-friction.npz")
            prepared = prepare(logged(trace, arm, model, rngs[2]), model, Config())
            keep_points(kept, prepared)
        yield kept_points(kept)


def keep_points(kept: Path, prepared: Prepared) -> None:
    """Fit all joints of a log, and keep their points."""
    fits = fit_joints([prepared], Config())
    found = {joint: [asdict(p) for p in fit.points] for joint, fit in fits.items()}
    kept.write_text(dumps(found), encoding="utf-8")


def kept_points(kept: Path) -> dict[str, list[FrictionPoint]]:
    """What :func:`keep_points` kept."""
    stored = loads(kept.read_text(encoding="utf-8"))
    return {joint: [FrictionPoint(**p) for p in its] for joint, its in stored.items()}


def spoilt_points(cache: Path, robot: str, name: str, seed: int) -> list[FrictionPoint]:
    """Points of the second joint, the one of the run that moves, with one imperfection; gears turn with the seed."""
    arm = robot_named(robot)
    model, names = arm.model(), (name,) if name != "none" else ()
    kept = cache / f"{robot}-second-{name}-{seed}.json"
    if not kept.exists():
        rngs = streams("friction", seed)
        planned = friction_run(arm, (1,), FRICTION_SPEEDS)
        spring = names if name == "springs" else ()
        bent = names if name == "elastic" else ()
        trace = motion(planned, arm, model, cache / f"{robot}-second-{'-'.join(bent)}.npz", bent)
        # Springs at the place where the arm is: that of the plan is ahead of it, by what the servo lags.
        there = replace(planned, position=trace.position, velocity=trace.velocity)
        trace = replace(trace, drive_nm=trace.drive_nm + loads_nm(spring, arm, there))
        rng = np.random.default_rng(seed)
        trace = geared(trace, names, arm, model, rng.uniform(0.0, 2.0 * np.pi, len(arm.joints)))
        file = described(arm, rng, 0.1, tool=True) if name == "wrong-cad" else model
        log = logged(trace, arm, model, rngs[2], imperfections=names)
        keep_points(kept, prepare(log, file, Config()))
    return kept_points(kept).get(arm.joints[1], [])


class Tally:
    """Intervals that held the truth, that were closed, and that were asked for."""

    def __init__(self) -> None:
        self.held = self.closed = self.asked = 0
        self.error: list[float] = []
        self.half: list[float] = []

    def add(self, fit: FrictionFit, symbol: str, value: float) -> None:
        """Count one parameter of one fit."""
        self.asked += 1
        keys = {parameter_symbol(key): key for key in fit.parameters}
        key = keys.get(symbol) or keys.get(SAME.get(symbol, ""), "")
        bounds = fit.ci95.get(key)
        if fit.identifiable and bounds is not None and bounds[0] is not None and bounds[1] is not None:
            self.closed += 1
            self.held += bounds[0] <= value <= bounds[1]
            self.error.append(fit.parameters[key] - value)
            self.half.append(0.5 * (bounds[1] - bounds[0]))

    @property
    def coverage(self) -> float:
        """Share of the closed intervals that held the truth."""
        return self.held / self.closed if self.closed else float("nan")

    def share(self) -> str:
        """How many of the closed intervals held the truth; binomial 95 % bounds of that share."""
        from scipy.stats import beta

        if not self.closed:
            return f"– (0 of {self.asked} closed)"
        low = 0.0 if self.held == 0 else float(beta.ppf(0.025, self.held, self.closed - self.held + 1))
        high = 1.0 if self.held == self.closed else float(beta.ppf(0.975, self.held + 1, self.closed - self.held))
        still = "" if self.closed == self.asked else f", {self.asked - self.closed} open"
        return f"{self.held} of {self.closed} ({100 * low:.0f} to {100 * high:.0f} %){still}"

    def row(self) -> str:
        """Coverage, how many intervals were closed, median half width, root mean square error."""
        if not self.closed:
            return "– | 0 % | – | –"
        rms = float(np.sqrt(np.mean(np.square(self.error))))
        share = 100 * self.closed / self.asked
        return f"{100 * self.coverage:.1f} % | {share:.0f} % | {np.median(self.half):.3g} | {rms:.3g}"


def friction(cache: Path, seeds: int, automatic: bool) -> Iterator[str]:
    """Each joint's own law fitted to the ``friction`` scenario, or the one that ``auto`` chooses."""
    yield "| arm, joint | law | parameter | truth | held the truth | interval closed | half width | RMS error |"
    yield "|---|---|---|---|---|---|---|---|"
    total: dict[str, Tally] = defaultdict(Tally)
    for robot in ROBOTS:
        arm = robot_named(robot)
        tallies: dict[tuple[str, str], Tally] = defaultdict(Tally)
        laws: dict[str, Counter[str]] = defaultdict(Counter)
        for points in points_of(cache, robot, seeds):
            for joint, dynamics in zip(arm.joints, arm.friction, strict=True):
                own, values = truth(dynamics)
                fit = fit_friction(points[joint], UNITS, "auto" if automatic else own)
                laws[joint][str(fit.model)] += 1
                for symbol, value in values.items():
                    tallies[joint, symbol].add(fit, symbol, value)
                    total[symbol].add(fit, symbol, value)
        for joint, dynamics in zip(arm.joints, arm.friction, strict=True):
            _, values = truth(dynamics)
            taken = ", ".join(f"{law} {n}" if automatic else law for law, n in laws[joint].most_common())
            for symbol, value in values.items():
                yield f"| {robot}, {joint} | {taken} | {symbol} | {value:.4g} | {tallies[joint, symbol].row()} |"
    for symbol, tally in total.items():
        yield f"| all | | {symbol} | | {100 * tally.coverage:.1f} % | {100 * tally.closed / tally.asked:.0f} % | | |"


def measure(cache: Path, seeds: int, names: list[str]) -> None:
    """Make the logs of all imperfections, seed by seed, so that what is there at any time is of equally many seeds."""
    for seed in range(1, seeds + 1):
        for name in ["none", *names]:
            for robot in ROBOTS:
                spoilt_points(cache, robot, name, seed)


def imperfect(cache: Path, names: list[str]) -> Iterator[str]:
    """The second joint of both arms by imperfection and parameter, its own law fitted, for all seeds that are made."""
    yield "| imperfection | seeds | A or Fc | B or Fs | C or vs | D or sigma2 |"
    yield "|---|---|---|---|---|---|"
    for name in ["none", *names]:
        total: dict[str, Tally] = defaultdict(Tally)
        made = [{p.stem.rsplit("-", 1)[1] for p in cache.glob(f"{robot}-second-{name}-*.json")} for robot in ROBOTS]
        seeds = sorted(int(seed) for seed in set.intersection(*made))
        for robot in ROBOTS:
            own, values = truth(robot_named(robot).friction[1])
            for seed in seeds:
                fit = fit_friction(spoilt_points(cache, robot, name, seed), UNITS, own)
                for (symbol, value), column in zip(values.items(), "ABCD", strict=True):
                    total[column].add(fit, symbol, value)
        yield f"| {name} | {len(seeds)} | " + " | ".join(total[column].share() for column in "ABCD") + " |"


def main(cache: Path, seeds: int, docs: Path | None, names: list[str]) -> None:
    """Print the tables; put them into the page when one is given."""
    cache.mkdir(parents=True, exist_ok=True)
    if names:
        measure(cache, seeds, names)
        lines = list(imperfect(cache, names))
        print("\n".join(lines), flush=True)
        if docs is not None:
            put(docs, "coverage-imperfect", lines)
        return
    for name, automatic in (("coverage-friction", False), ("coverage-auto", True)):
        lines = list(friction(cache, seeds, automatic))
        print("\n".join(lines), flush=True)
        if docs is not None:
            put(docs, name, lines)


if __name__ == "__main__":
    main(
        Path(sys.argv[1]),
        int(sys.argv[2]) if len(sys.argv) > 2 else 200,
        Path(sys.argv[3]) if len(sys.argv) > 3 and sys.argv[3] != "-" else None,
        sys.argv[4].split(",") if len(sys.argv) > 4 else [],
    )
