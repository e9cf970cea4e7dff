"""How often 95 % intervals of gains and friction hold the truth, as `fit` gives them (part ``intervals``).

Gains: a minute of fast motion whose effort is in a unit of its own. Friction: the second joint moves alone at the
paper's speeds, a minute and a half. Every seed has other noise, drift and ripple, and other motion where gains are
asked for.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from coverage_logs import SAME, logged, motion, streams, truth
from scipy.stats import beta

from collaudit.core import api
from collaudit.core.config import LoadedConfig, parse_config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.friction.law_candidates import parameter_symbol
from collaudit.core.prepare.preparation import prepare
from collaudit.fixtures.arms import robot_named
from collaudit.fixtures.experiments import FRICTION_SPEEDS
from collaudit.fixtures.experiments import friction as friction_run
from collaudit.fixtures.simulated_robot import FixtureRobot
from collaudit.fixtures.simulation import plan

ROBOTS, GAIN_S = ("paper6", "seven"), 60.0
#: Truth, value, low and high of an interval; the last two None where it is open or not given.
Row = list[float | None]


def measure(asked: Any, known: frozenset[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Seed after seed of both arms."""
    folder = asked.work / "motions"
    folder.mkdir(parents=True, exist_ok=True)
    for seed in range(asked.seed, asked.seed + asked.seeds):
        for robot in ROBOTS:
            for kind, of in (("gain", gains), ("friction", friction)):
                name = f"{kind} {robot} {seed}"
                if name not in known:
                    yield name, of(robot_named(robot), seed, folder)


def gains(arm: FixtureRobot, seed: int, folder: Path) -> dict[str, Row]:
    """Effort per N·m of every joint."""
    model = arm.model()
    rngs = streams("free-clean", seed)
    trace = motion(plan("free-clean", arm, model, rngs[0], GAIN_S), arm, model, None)
    settings = _asking_gains()
    found = api.fit([prepare(logged(trace, arm, model, rngs[2], raw=True), model, settings.config)], settings)
    constant = np.array(arm.log.torque_constant_nm_per_a or [1.0] * len(arm.joints))
    true = np.array(arm.log.effort_sign, dtype=float) / constant
    facts = None if found.identified is None else found.identified.joints
    out: dict[str, Row] = {}
    for joint, value in zip(arm.joints, true.tolist(), strict=True):
        one = None if facts is None else facts.get(joint)
        low, high = one.gain_ci95 if one is not None and one.gain_ci95 is not None else (None, None)
        out[joint] = [value, None if one is None else one.gain, low, high]
    return out


def _asking_gains() -> LoadedConfig:
    """Effort in an unknown unit; gains asked for where the default does not look for them."""
    raw = '[log.units]\neffort = "raw"\n'
    default = parse_config(raw, None)
    if default.config.fit.estimate == "auto":
        return default
    return parse_config(raw + '[fit]\nestimate = ["friction", "gain"]\n', None)


def friction(arm: FixtureRobot, seed: int, folder: Path) -> dict[str, Row]:
    """Parameters of the second joint's law, by their symbols."""
    model, settings = arm.model(), parse_config("", None)
    trace = motion(friction_run(arm, (1,), FRICTION_SPEEDS), arm, model, folder / f"{arm.name}-second.npz")
    log = logged(trace, arm, model, streams("friction", seed)[2])
    found = api.fit([prepare(log, model, settings.config)], settings)
    _, true = truth(arm.friction[1])
    return {symbol: _parameter(found, arm.joints[1], symbol, value) for symbol, value in true.items()}


def _parameter(found: FrictionFile, joint: str, symbol: str, true: float) -> Row:
    fit = found.joints[joint]
    keys = {parameter_symbol(key): key for key in fit.parameters}
    key = keys.get(symbol) or keys.get(SAME.get(symbol, ""), "")
    bounds = fit.ci95.get(key) if fit.identifiable else None
    low, high = bounds or (None, None)
    return [true, fit.parameters.get(key), low, high]


def tables(found: Mapping[str, Any], before: Mapping[str, Any]) -> Iterator[tuple[str, list[str]]]:
    """One row an arm and quantity: gains over all joints, friction by parameter."""
    lines = ["| arm | interval of | seeds | closed | held the truth (95 %) | RMS error | half width "
             "| held before |", "|---|---|---|---|---|---|---|---|"]  # fmt: skip
    now, old = _grouped(found), _grouped(before)
    everyone: list[Row] = []
    for (robot, what), rows in sorted(now.items()):
        everyone += rows
        seeds = len({name for name in found if name.split()[1] == robot and name.startswith(what.split()[0])})
        lines.append(_line(robot, what, seeds, rows, old.get((robot, what), [])))
    if everyone:
        lines.append(_line("both", "all", 0, everyone, [row for rows in old.values() for row in rows]))
    yield "intervals", lines


def _grouped(found: Mapping[str, Any]) -> dict[tuple[str, str], list[Row]]:
    out: dict[tuple[str, str], list[Row]] = defaultdict(list)
    for name, its in found.items():
        kind, robot, _ = name.split()
        for key, row in its.items():
            out[robot, "gain" if kind == "gain" else f"friction {key}"].append(row)
    return out


def _line(robot: str, what: str, seeds: int, rows: list[Row], before: list[Row]) -> str:
    closed = np.array([row for row in rows if None not in row], dtype=float)
    if not len(closed):
        return f"| {robot} | {what} | {seeds or ''} | 0 of {len(rows)} | – | – | – | {_held(before)[0]} |"
    size = np.abs(closed[:, 0])
    error = np.sqrt(np.mean(((closed[:, 1] - closed[:, 0]) / size) ** 2))
    half = np.median(0.5 * (closed[:, 3] - closed[:, 2]) / size)
    return (
        f"| {robot} | {what} | {seeds or ''} | {len(closed)} of {len(rows)} | {' '.join(_held(rows))} "
        f"| {100 * error:.2g} % | {100 * half:.2g} % | {_held(before)[0]} |"
    )


def _held(rows: list[Row]) -> tuple[str, str]:
    """Share of closed intervals that held the truth, and its exact binomial bounds."""
    closed = [row for row in rows if None not in row]
    if not closed:
        return "–", ""
    count, held = len(closed), sum(low <= true <= high for true, _, low, high in closed)  # type: ignore[operator]
    low = 0.0 if held == 0 else float(beta.ppf(0.025, held, count - held + 1))
    high = 1.0 if held == count else float(beta.ppf(0.975, held + 1, count - held))
    return f"{100 * held / count:.1f} %", f"({100 * low:.0f} to {100 * high:.0f} %)"
