"""What ``detect`` gains from friction against temperature: ``python friction_temperature.py CACHE [DOCS]``.

CACHE is a folder for the simulated motions. Friction is fitted on logs of an arm that warms up, with a temperature of
each joint, and judges logs of a cold, a warm and a much colder arm, with their temperatures and without. DOCS is the
page whose table between ``<!-- friction-temperature-use -->`` marks is replaced.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from coverage_logs import logged, motion, streams
from tables import put

from collaudit.core.audit import audit_log
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import FrictionFile, Provenance
from collaudit.core.data.joint_log import JointLog
from collaudit.core.fitting import fit_logs
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.prepare.preparation import prepare
from collaudit.core.robot.robot_model import RobotModel
from collaudit.fixtures.arms import robot_named
from collaudit.fixtures.plant import Trace
from collaudit.fixtures.simulated_robot import FixtureRobot
from collaudit.fixtures.simulation import plan

PER_KELVIN, TRUE_AT_C = -0.01, 30.0
SECONDS, SEEDS = 60.0, (101, 102, 103, 104, 105)
#: First temperature, what it rises by, and how fast, s.
STARTS = {"as cold as the fit began, 20 to 24 °C": (20.0, 4.0, 30.0), "warm, 33 to 34 °C": (33.0, 1.0, 30.0)}
STARTS["colder than the fit, 10 to 14 °C"] = (10.0, 4.0, 30.0)
MODES: dict[str, dict[str, object]] = {
    "followed": {},
    "followed, causal": {"causal": True},
}
NOBODY = Provenance("0", {})


def heated(log: JointLog, trace: Trace, arm: FixtureRobot, start: tuple[float, float, float]) -> JointLog:
    """The log of an arm that warms up: its friction is 1 % less a kelvin, and it has a temperature of each joint."""
    first, rise, constant_s = start
    warm = first + rise * (1.0 - np.exp(-log.time_s / constant_s))
    v = trace.velocity
    friction = np.column_stack([np.sign(v[:, i]) * f.steady(np.abs(v[:, i])) for i, f in enumerate(arm.friction)])
    assert log.effort is not None
    effort = log.effort + PER_KELVIN * (warm - TRUE_AT_C)[:, None] * friction
    return replace(log, effort=effort, temperature_c=np.repeat(np.round(warm, 1)[:, None], len(arm.joints), axis=1))


def one_log(arm: FixtureRobot, model: RobotModel, scenario: str, seed: int, cache: Path) -> tuple[JointLog, Trace]:
    """A log in memory, and its true motion."""
    rngs = streams(scenario, seed)
    name = "friction" if scenario == "friction" else f"free60-{seed}"
    experiment = plan(scenario, arm, model, rngs[0], *(() if scenario == "friction" else (SECONDS,)))
    trace = motion(experiment, arm, model, cache / f"{arm.name}-{name}.npz")
    return logged(trace, arm, model, rngs[2]), trace


def judged(
    arm: FixtureRobot, model: RobotModel, logs: list[JointLog], friction: FrictionFile, detect: dict[str, object]
) -> tuple[float, float, int, int]:
    """RMS residual and largest rise of the threshold as shares of friction at 0.5 rad/s; collisions; near misses."""
    laws = {joint: FrictionModel.of(fit) for joint, fit in friction.joints.items()}
    size = {joint: float(law.torque(np.array([0.5]))[0]) for joint, law in laws.items() if law is not None}
    gamma = {joint: max(0.5, 0.25 * f) for joint, f in size.items()}
    config = Config.of({"detect": {"gamma_nm": gamma, "watch": list(arm.joints), **detect}})
    rms, doubt, hits, near = [], [], 0, 0
    for log in logs:
        result = audit_log(prepare(log, model, config), config, friction, NOBODY).result
        rms += [(level.rms_nm or 0.0) / size[joint] for joint, level in result.residual.items()]
        assert result.detection is not None
        doubt += [2.0 * level.sd for level in result.detection.friction_level.values()]
        hits, near = hits + len(result.collisions), near + len(result.near_misses)
    return float(np.mean(rms)), float(np.mean(doubt)), hits, near


def table(cache: Path) -> Iterator[str]:
    """One row for each arm, temperature and way of taking friction's level."""
    yield "| arm | judged log | level | residual's RMS | threshold raised by | false alarms | near misses |"
    yield "|---|---|---|---|---|---|---|"
    for robot in ("paper6", "seven"):
        arm = robot_named(robot)
        model = arm.model()
        config = Config.of({})
        logs = [one_log(arm, model, *which, cache) for which in (("friction", 1), ("free-clean", 106))]
        rising = [heated(log, trace, arm, (20.0, 15.0, c)) for (log, trace), c in zip(logs, (200.0, 25.0), strict=True)]
        friction = fit_logs([prepare(log, model, config) for log in rising], config, NOBODY)
        found_logs = [one_log(arm, model, "free-clean", seed, cache) for seed in SEEDS]
        for title, start in STARTS.items():
            warm = [heated(log, trace, arm, start) for log, trace in found_logs]
            blind = [replace(log, temperature_c=None) for log in warm]
            for mode, detect in MODES.items():
                before, after = (judged(arm, model, its, friction, detect) for its in (blind, warm))
                percent = [f"{100 * a:.1f} → {100 * b:.1f} %" for a, b in zip(before[:2], after[:2], strict=True)]
                counts = [f"{a} → {b}" for a, b in zip(before[2:], after[2:], strict=True)]
                yield f"| {robot} | {title} | {mode} | {' | '.join(percent + counts)} |"


def main(cache: Path, docs: Path | None) -> None:
    """Print the table; put it into the page when one is given."""
    cache.mkdir(parents=True, exist_ok=True)
    lines = list(table(cache))
    print("\n".join(lines))
    if docs is not None:
        put(docs, "friction-temperature-use", lines)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
