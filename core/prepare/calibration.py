"""A prepared log seen through what was identified: torque from effort, the arm's real inertials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import ChannelFacts, Identified, SensorFacts
from collaudit.core.errors import ConfigError
from collaudit.core.findings import Finding
from collaudit.core.prepare.calibrated_tool import with_calibrated_tool
from collaudit.core.prepare.commanded_force import contact_torque
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.prepare.with_model import with_model
from collaudit.core.robot.robot_model import RobotModel


def with_known(
    prepared: Prepared, identified: Identified | None, channels: Mapping[str, ChannelFacts], config: Config
) -> Prepared:
    """A log with all that a friction file knows of sensor, drives, inertials and tool."""
    seen = with_sensor(prepared, channels, config)
    if identified is not None:  # its bodies are the whole arm, the tool in use at the fit included
        return with_identified(seen, identified)
    used = calibration(channels, config) if prepared.series.wrench is not None else None
    return seen if used is None else with_calibrated_tool(seen, used, config)


def before_fit(
    prepared: Prepared, estimate: tuple[str, ...], channels: Mapping[str, ChannelFacts], config: Config
) -> Prepared:
    """A log with what its wrist sensor knows, for fitting; its tool only where the torques are not to tell one."""
    if {"tool", "inertials"} & set(estimate):
        return with_sensor(prepared, channels, config)
    return with_known(prepared, None, channels, config)


def calibration(channels: Mapping[str, ChannelFacts], config: Config) -> SensorFacts | None:
    """The calibration of most poses in the sensor's frame, where ``wrench_bias = "calibrated"`` asks for one."""
    if config.log.wrench_bias != "calibrated":
        return None
    found = [c.sensor for c in channels.values() if c.sensor is not None]
    return max((s for s in found if s.frame == config.log.wrench_frame), key=lambda s: s.poses, default=None)


def with_identified(prepared: Prepared, identified: Identified | None) -> Prepared:
    """The same log with identified gains, offsets and inertials; unchanged when there are none.

    Raises:
        ConfigError: the file was identified on another arm.
    """
    if identified is None:
        return prepared
    names = prepared.series.joint_names
    missing = [name for name in names if name not in identified.joints]
    if missing:
        raise ConfigError(
            "the friction file identifies other joints than this log has",
            found=", ".join(identified.joints),
            expected=", ".join(names),
            hint="fit again on a log of this arm",
        )
    robot = _robot(prepared.robot, identified)
    series = prepared.series
    if series.effort is not None:
        found = [identified.joints[name].gain for name in names]
        gain = np.array([np.nan if value is None else value for value in found])
        offset = np.array([identified.joints[name].offset_nm for name in names])
        series = replace(series, effort=series.effort / gain - offset, effort_unit="Nm")
    said = Finding("identified-used", "info", _words(identified), where="friction file")
    seen = with_model(prepared, robot, series)
    return replace(seen, findings=(*seen.findings, said))


def with_sensor(prepared: Prepared, channels: Mapping[str, ChannelFacts], config: Config) -> Prepared:
    """The same log with the wrist sensor's offset and tool of the friction file; unchanged unless that is asked for.

    Args:
        prepared: the log.
        channels: what the friction file holds, by the log it was found on; the log of most poses counts.
        config: ``[log] wrench_bias = "calibrated"`` asks for it.
    """
    if config.log.wrench_bias != "calibrated" or prepared.series.wrench is None:
        return prepared
    sensor = calibration(channels, config)
    if sensor is None:
        text = (
            f"The friction file holds no calibration of a sensor in frame '{config.log.wrench_frame}': its offset was "
            "estimated from this log instead."
        )
        return replace(prepared, findings=(*prepared.findings, Finding("log-wrench-bias", "warning", text)))
    contact, said = contact_torque(prepared.series, prepared.robot, prepared.phases, config, sensor)
    kept = tuple(f for f in prepared.findings if f.code not in {"log-wrench-bias", *(g.code for g in said)})
    return replace(prepared, contact_nm=contact, findings=(*kept, *said))


def _robot(robot: RobotModel, identified: Identified) -> RobotModel:
    assert robot.bodies is not None
    names = robot.bodies.joint_names
    if set(names) != set(identified.bodies):
        raise ConfigError(
            "the friction file identifies another arm's inertials",
            found=", ".join(identified.bodies),
            expected=", ".join(names),
        )
    parameters = np.concatenate([np.array(identified.bodies[name].parameters) for name in names])
    armature = robot.armature
    for name, joint in identified.joints.items():
        if name in names:
            armature[names.index(name)] = joint.armature_kg_m2
    return robot.with_inertials(parameters, armature)


def _words(identified: Identified) -> str:
    what = ", ".join(item for item in identified.estimate if item != "friction")
    return (
        f"Effort and model torque are taken with what the friction file identified: {what}, and a constant offset of "
        "torque for each joint."
    )
