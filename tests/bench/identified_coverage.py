"""How often 95 % intervals of inertials, offsets, tool and wrist sensor hold the truth.

``python identified_coverage.py CACHE [SEEDS] [DOCS]``: CACHE is a folder for the simulated motions; SEEDS (100) is the
number of logs of each arm, seeds from 101 on. DOCS is the page whose table between ``<!-- coverage-identified -->``
marks is replaced.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from multiprocessing import Pool
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from coverage_logs import logged, motion, streams
from tables import put

sys.path.insert(0, str(Path(__file__).parent.with_name("helpers")))
from identified import identify

from collaudit.core.config.schema import Config, RobotConfig
from collaudit.core.data.identification_result import Bounds, Identified
from collaudit.core.data.joint_log import WrenchSeries
from collaudit.core.identification.force_sensor import calibrate_sensor
from collaudit.core.identification.torque_terms import base_map
from collaudit.core.prepare.preparation import prepare
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.robot.robot_model import RobotModel
from collaudit.fixtures.arms import robot_named
from collaudit.fixtures.plant import Trace
from collaudit.fixtures.simulated_robot import FixtureRobot, record
from collaudit.fixtures.simulation import plan

SECONDS, FIRST, WORKERS, OFF = 60.0, 101, 2, 0.1
_CALIBRATIONS = 10  # motions; the sensor's noise differs in every log
_SHOWN = 0.5  # base parameters that the data know better than the file
Row = tuple[str, bool, float, float]


def row(what: str, truth: float, value: float, bounds: Bounds | None) -> list[Row]:
    """Whether a closed interval held the truth, error, half width; nothing for one that is open."""
    low, high = bounds or (None, None)
    return [] if low is None or high is None else [(what, low <= truth <= high, value - truth, 0.5 * (high - low))]


def described(arm: FixtureRobot, rng: np.random.Generator, off: float, tool: bool) -> RobotModel:
    """The arm as a robot file has it: each inertial property off by up to a share, with its tool or without."""
    description = arm.describe(lambda: off * float(rng.uniform(-1.0, 1.0)))
    keys = dict(description.keys)
    if not tool:
        keys["tool"] = {**keys["tool"], "mass_kg": 0.0}
    with TemporaryDirectory() as folder:
        if description.urdf is not None:
            keys["urdf"] = "arm.urdf"
            (Path(folder) / "arm.urdf").write_text(description.urdf, encoding="utf-8")
        return build_robot(RobotConfig.of(keys), Path(folder), arm.joints)


def true_offset(trace: Trace, arm: FixtureRobot, model: RobotModel, rng: np.random.Generator) -> np.ndarray:
    """(j,) N·m: mean of the simulated drift of the torque's zero, and what is constant in friction unlike both ways."""
    quiet = tuple(0.0 for _ in arm.joints)
    still = replace(arm, sensors=replace(arm.sensors, torque_noise_nm=quiet, ripple_nm=quiet))
    effort = logged(trace, still, model, rng).effort
    assert effort is not None
    unlike = np.array([0.5 * (f.forward.coulomb_nm - f.backward.coulomb_nm) for f in arm.friction])
    return np.asarray((effort - trace.drive_nm).mean(axis=0) + unlike)


def by_motion(robot: str, seed: int, cache: Path) -> Iterator[Row]:
    """Base parameters and offsets with a file that is off; the tool with a file that lacks it."""
    arm = robot_named(robot)
    model = arm.model()
    rngs = streams("free-clean", seed)
    trace = motion(plan("free-clean", arm, model, rngs[0], SECONDS), arm, model, cache / f"{robot}-free60-{seed}.npz")
    log = logged(trace, arm, model, rngs[2])
    offset = true_offset(trace, arm, model, streams("free-clean", seed)[2])
    config = Config.of({"fit": {"estimate": ["inertials"], "blocks": 2}})
    file = described(arm, rngs[3], OFF, tool=True)
    found = identify([prepare(log, file, config)], config)
    assert found is not None
    assert model.bodies is not None
    base = base_map(model, tuple(model.bodies.joint_names))
    exact = dict(zip(base.names, base.matrix @ model.inertial_parameters, strict=True))
    for parameter in found.base_parameters:
        if parameter.from_data > _SHOWN:
            yield from row("base parameters, file off", exact[parameter.name], parameter.value, parameter.ci95)
    yield from offsets(found, offset, "offset, file off")
    tool = described(arm, rngs[3], 0.0, tool=False)
    keys = {**arm.describe(lambda: 0.0).keys["tool"], "mass_kg": "estimate"}
    config = Config.of({"robot": {"tool": keys}, "fit": {"estimate": ["tool"], "blocks": 2}})
    found = identify([prepare(log, tool, config)], config)
    assert found is not None
    assert found.tool is not None
    mass, com = model.tool.mass_kg, model.tool.com_m  # type: ignore[union-attr]
    yield from row("tool's mass, kg", mass, found.tool.mass_kg, found.tool.mass_ci95)
    if found.tool.com_m is not None:
        for axis, true, at, bounds in zip("xyz", com, found.tool.com_m, found.tool.moment_ci95_kg_m, strict=True):
            yield from row(f"tool's mass times centre {axis}, kg·m", mass * true, at * found.tool.mass_kg, bounds)
    yield from offsets(found, offset, "offset, tool not on file")


def offsets(found: Identified, truth: np.ndarray, what: str) -> Iterator[Row]:
    """Every joint's."""
    for joint, true in zip(found.joints.values(), truth, strict=True):
        yield from row(f"{what}, N·m", float(true), joint.offset_nm, joint.offset_ci95)


def by_sensor(robot: str, seed: int, cache: Path) -> Iterator[Row]:
    """The wrist sensor's offset and what it carries, from poses at rest."""
    arm = robot_named(robot)
    model = arm.model()
    number = seed % _CALIBRATIONS
    experiment = plan("tool-calibration", arm, model, streams("tool-calibration", number)[0])
    trace = motion(experiment, arm, model, cache / f"{robot}-tool-{number}.npz")
    recording = record(trace, arm, model, streams("tool-calibration", seed)[2])
    log = logged(trace, arm, model, streams("tool-calibration", seed)[2])
    time_s = (recording.stamp_ns - recording.stamp_ns[0]) * 1e-9
    log = replace(log, wrench=WrenchSeries(time_s, recording.wrench, "/ft_sensor/wrench"))
    keys = {"wrench_frame": arm.sensor_frame, "wrench_sign": arm.log.wrench_sign}
    config = Config.of({"log": keys})
    facts, tool = calibrate_sensor(prepare(log, model, config), config), model.tool
    assert facts is not None
    assert tool is not None
    assert model.bodies is not None
    yield from row("sensor: mass, kg", tool.mass_kg, facts.mass_kg, facts.mass_ci95)
    centre = tool_centre(model, arm)
    for true, at, bounds in zip(centre, facts.com_m or (), facts.com_ci95 or (), strict=False):
        yield from row("sensor: centre of mass, m", float(true), at, bounds)
    for k, (true, at, bounds) in enumerate(
        zip(arm.sensors.wrench_offset, facts.offset, facts.offset_ci95, strict=True)
    ):
        yield from row("sensor: offset, N" if k < 3 else "sensor: offset, N·m", true, at, bounds)


def tool_centre(model: RobotModel, arm: FixtureRobot) -> np.ndarray:
    """(3,) the tool's centre in the sensor's frame."""
    assert model.bodies is not None
    pose = model.bodies.frame_offset(arm.tool_frame, arm.sensor_frame)
    assert pose is not None
    rotation, place = pose
    return np.asarray(rotation @ np.array(model.tool.com_m) + place)  # type: ignore[union-attr]


def of_seed(job: tuple[str, int, Path]) -> list[Row]:
    """All rows of one seed of one arm."""
    return [*by_motion(*job), *by_sensor(*job)]


def table(cache: Path, seeds: int) -> Iterator[str]:
    """Coverage, bias, error and half width."""
    yield "| arm | what | intervals | held the truth | bias | RMS error | half width |"
    yield "|---|---|---|---|---|---|---|"
    for robot in ("paper6", "seven"):
        found: dict[str, list[Row]] = defaultdict(list)
        with Pool(WORKERS) as pool:
            for rows in pool.imap(of_seed, [(robot, seed, cache) for seed in range(FIRST, FIRST + seeds)]):
                for its in rows:
                    found[its[0]].append(its)
        for what, its in found.items():
            held, error, half = (np.array([r[k] for r in its], dtype=float) for k in (1, 2, 3))
            yield (
                f"| {robot} | {what} | {len(its)} | {100 * held.mean():.1f} % | {error.mean():+.2g} "
                f"| {np.sqrt(np.mean(error**2)):.2g} | {np.median(half):.2g} |"
            )


def main(cache: Path, seeds: int, docs: Path | None) -> None:
    """Print the table; put it into the page when one is given."""
    cache.mkdir(parents=True, exist_ok=True)
    lines = list(table(cache, seeds))
    print("\n".join(lines))
    if docs is not None:
        put(docs, "coverage-identified", lines)


if __name__ == "__main__":
    main(
        Path(sys.argv[1]),
        int(sys.argv[2]) if len(sys.argv) > 2 else 100,
        Path(sys.argv[3]) if len(sys.argv) > 3 else None,
    )
