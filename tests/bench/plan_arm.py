"""Arms for benches of planned motions: the fixtures' own, and described ones with friction of a known truth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from collaudit.core.config import LoadedConfig, load_config
from collaudit.core.numeric.arrays import FloatArray
from collaudit.fixtures import experiments
from collaudit.fixtures.arms import PAPER6, robot_named
from collaudit.fixtures.experiments import Experiment, carry_out
from collaudit.fixtures.experiments import Path as MotionPath
from collaudit.fixtures.plant import SAMPLE_S, lugre
from collaudit.fixtures.simulated_robot import Description, FixtureRobot, record
from collaudit.fixtures.truth import config_text
from collaudit.fixtures.writers import write_log

#: File, joints (all movable ones but fingers), start.
DESCRIBED = {
    "ur10": ("ur10_robot.urdf", (0.0, -1.5, 1.2, 0.0, 1.0, 0.0), "ee_link"),
    "panda": ("panda.urdf", (0.0, -0.7, 0.0, -2.2, 0.0, 1.6, 0.8), "panda_link8"),
}
ARMS = ("paper6", "seven", *DESCRIBED)


def arm_named(name: str, data: Path) -> FixtureRobot:
    """A simulated arm; friction and sensors of a described one are a few per cent of its highest torques."""
    if name not in DESCRIBED:
        return robot_named(name)
    from movable_joints import movable_joints

    from collaudit.core.config.schema import RobotConfig
    from collaudit.core.robot.robot_building import build_robot

    file, home, frame = DESCRIBED[name]
    keys = {"urdf": file}
    joints = tuple(j for j in movable_joints(RobotConfig.of(keys), data / "urdf") if "finger" not in j)
    torque = build_robot(RobotConfig.of(keys), data / "urdf", joints).effort_limit_nm
    text = (data / "urdf" / file).read_text(encoding="utf-8")
    armature = dict(zip(joints, (0.004 * torque).tolist(), strict=True))
    of_torque = {key: tuple((share * torque).tolist()) for key, share in
                 (("torque_noise_nm", 0.003), ("torque_drift_nm", 0.003), ("ripple_nm", 0.005))}  # fmt: skip
    rates = np.linspace(18.0, 30.0, len(joints))
    return replace(
        PAPER6, name=name, summary=name, joints=joints, home=home, polish=home, sensor_frame=frame, tool_frame=frame,
        describe=lambda _spread: Description(
            {"joints": list(joints), "armature_kg_m2": armature, "tool": {"frame": frame, "mass_kg": 0.5}}, text
        ),
        links=(),
        friction=tuple(lugre(0.04 * t, 0.012 * t, float(c), 0.05 * t) for t, c in zip(torque, rates, strict=True)),
        log=replace(PAPER6.log, names=joints, order=tuple(range(len(joints))), effort_sign=(1,) * len(joints)),
        sensors=replace(PAPER6.sensors, **of_torque),
    )  # fmt: skip


def plan_table(arm: FixtureRobot) -> str:
    """``[plan]`` of an arm: its start, and limits that its description lacks."""
    start = ", ".join(f'"{name}" = {at:g}' for name, at in zip(arm.joints, arm.home, strict=True))
    out = f"\n[plan]\nstart_rad = {{ {start} }}\ntable_z_m = -0.1\n"
    accelerations = ", ".join(f"{name} = 6.0" for name in arm.joints)  # about that of the default sweep
    out += f"acceleration_rad_s2 = {{ {accelerations} }}\n"
    if arm.name == "paper6":
        speeds = ", ".join(f"{name} = 1.5" for name in arm.joints)
        ranges = ", ".join(f"{name} = [-2.6, 2.6]" for name in arm.joints)
        out += f"speed_rad_s = {{ {speeds} }}\nposition_rad = {{ {ranges} }}\n"
    return out


def write_run(arm: FixtureRobot, motion: Experiment, seed: int, path: Path) -> tuple[Path, LoadedConfig]:
    """Simulate a motion and write its log (MCAP), configuration and description; the log and its settings."""
    path.parent.mkdir(parents=True, exist_ok=True)
    streams = np.random.SeedSequence(seed).spawn(2)
    control, sensor = map(np.random.default_rng, streams)
    model = arm.model()
    run = carry_out(motion, arm, model, control)
    write_log(record(run.trace, arm, model, sensor), arm.log, "mcap", path)
    description = arm.describe(lambda: 0.0)
    if description.urdf is not None:
        path.with_suffix(".urdf").write_text(description.urdf, encoding="utf-8")
    urdf = path.with_suffix(".urdf").name if description.urdf is not None else None
    text = config_text(replace(arm, plan={}), description, motion, "mcap", urdf) + plan_table(arm)
    path.with_suffix(".toml").write_text(text, encoding="utf-8")
    return path, load_config(path.with_suffix(".toml"))


def free_run(arm: FixtureRobot, seed: int, seconds: float) -> Experiment:
    """Free motion between poses, as a log has it that nobody planned."""
    return experiments.free(arm, np.random.default_rng(seed), seconds, ())


def of_arrays(q: FloatArray, v: FloatArray, a: FloatArray) -> Experiment:
    """A motion sampled at the simulator's period."""
    return Experiment(q, v, a)


PERIOD_S = SAMPLE_S


def short_run(arm: FixtureRobot, joints: tuple[int, ...] | None = None) -> Experiment:
    """A program somebody has already: a few fast strokes both ways of every joint, nothing near standstill."""
    path = MotionPath(arm.home)
    path.hold(1.5)
    for joint in joints if joints is not None else range(len(arm.joints)):
        for speed in np.geomspace(0.25, 0.9, 5):
            half = 0.5 * float(speed) * 1.3
            path.move_joint(joint, arm.home[joint] - half, 0.6, 3.0)
            path.hold(0.06)
            path.move_joint(joint, arm.home[joint] + half, float(speed), float(speed) / 0.15)
            path.hold(0.06)
            path.move_joint(joint, arm.home[joint] - half, float(speed), float(speed) / 0.15)
        path.move_joint(joint, arm.home[joint], 0.6, 3.0)
        path.hold(0.3)
    return Experiment(*path.sampled(0.02))
