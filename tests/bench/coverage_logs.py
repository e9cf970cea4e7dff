"""Simulated logs in memory for campaigns of many seeds: the motion is integrated once, the sensors differ by seed.

The plant of an experiment without force control has nothing random in it, so that all seeds of ``friction`` share one
motion; what a seed changes (noise, drift, ripple, stamps) is added to it as ``collaudit simulate`` does.
"""

from __future__ import annotations

import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from collaudit.core.data.joint_log import JointLog, LogSource
from collaudit.core.robot.robot_model import RobotModel
from collaudit.fixtures.experiments import Experiment, carry_out
from collaudit.fixtures.imperfections import geared, given_way, loads_nm, spoiled
from collaudit.fixtures.plant import LuGre, Trace
from collaudit.fixtures.simulated_robot import FixtureRobot, record

#: Symbols of other laws with the same meaning: the Coulomb level and the viscous slope.
SAME = {"A": "Fc", "Fc": "A", "D": "sigma2", "sigma2": "D"}


def streams(scenario: str, seed: int) -> list[np.random.Generator]:
    """The random streams of ``collaudit simulate``: plan, control, sensors, robot file, faults."""
    seeds = np.random.SeedSequence([seed, zlib.crc32(scenario.encode())]).spawn(5)
    return [np.random.default_rng(s) for s in seeds]


def motion(
    experiment: Experiment, arm: FixtureRobot, model: RobotModel, kept: Path | None, imperfections: tuple[str, ...] = ()
) -> Trace:
    """The true motion of an experiment, from ``kept`` when it is there; ``imperfections`` of the arm and its gears."""
    fields = tuple(Trace.__dataclass_fields__)
    if kept is not None and kept.exists():
        with np.load(kept) as stored:
            return Trace(**{name: stored[name] for name in fields})
    loads = loads_nm(imperfections, arm, experiment)
    trace = carry_out(experiment, arm, model, np.random.default_rng(0), loads_nm=loads).trace
    trace = given_way(geared(trace, imperfections, arm, model), imperfections, model, experiment)
    if kept is not None:
        np.savez(kept, **{name: getattr(trace, name) for name in fields})
    return trace


def logged(
    trace: Trace,
    arm: FixtureRobot,
    model: RobotModel,
    rng: np.random.Generator,
    raw: bool = False,
    imperfections: tuple[str, ...] = (),
) -> JointLog:
    """What a log of the motion holds once its units are understood; without the wrist sensor, which takes long.

    Args:
        trace: the true motion.
        arm, model: whose it is.
        rng: of the sensors.
        raw: leave the effort in the log's own unit and sign.
        imperfections: of the recording.
    """
    recording = spoiled(record(trace, arm, replace(model, tool=None), rng), imperfections, arm, rng)
    back = [recording.names.index(name) for name in arm.log.names]
    angle = np.pi / 180.0 if arm.log.degrees else 1.0
    scale = np.array(arm.log.effort_sign, dtype=float) * np.array(arm.log.torque_constant_nm_per_a or 1.0)
    time_s = (recording.stamp_ns - recording.stamp_ns[0]) * 1e-9
    log = JointLog(
        time_s,
        arm.joints,
        angle * recording.position[:, back],
        angle * recording.velocity[:, back],
        recording.effort[:, back] * scale,
        "Nm",
        None,
        LogSource("simulated", "0" * 64, "test", None, "column", "/joint_states"),
    )
    return replace(log, effort=recording.effort[:, back], effort_unit="raw") if raw else log


def truth(joint: LuGre) -> tuple[str, dict[str, float]]:
    """The law a joint's mean over both directions follows, and its parameters."""
    ahead, back = joint.forward, joint.backward
    fc, fs, viscous = (
        0.5 * (getattr(ahead, name) + getattr(back, name))
        for name in ("coulomb_nm", "stiction_nm", "viscous_nm_s_per_rad")
    )
    vs = ahead.stribeck_rad_s
    if joint.exponent == 2:
        return "stribeck-gauss", {"Fc": fc, "Fs": fs, "vs": vs, "sigma2": viscous}
    return "static-lugre", {"A": fc, "B": fs - fc, "C": 1.0 / vs, "D": viscous}
