"""Simulated pushes and the same pushes injected into other, clean logs: how many of each are missed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from pathlib import Path

import numpy as np

from collaudit.core import api
from collaudit.core.config import load_config
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun, run_detector
from collaudit.core.detection.rule_settings import make_rule
from collaudit.core.findings import joints_not_judged
from collaudit.core.friction.applied_friction import applied_friction
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.rule_study.injected_contacts import (
    ContactShape,
    InjectedContact,
    open_moments,
    spread_moments,
    unit_torques,
)
from collaudit.core.rule_study.shown_torque import alarmed, margin_samples, through_filters, windows
from collaudit.fixtures.pushes import Push
from collaudit.fixtures.robots.robot_registry import robot_named
from collaudit.fixtures.simulation import SimulatedFiles


@dataclass(frozen=True, slots=True)
class Outcome:
    """One push: what it was, and whether it was noticed."""

    push: Push
    noticed: bool


def simulated_outcomes(
    files: SimulatedFiles, pushes: Sequence[Push], friction: FrictionFile, overrides: dict[str, object]
) -> list[Outcome]:
    """Which simulated pushes alarm."""
    audit = api.audit(files.log, load_config(files.config, overrides), friction)
    spans = np.array([(c.onset_s, c.onset_s + c.duration_s) for c in audit.result.collisions]).reshape(-1, 2)
    out = []
    for push in pushes:
        overlaps = (spans[:, 0] < push.onset_s + push.duration_s + 0.1) & (spans[:, 1] > push.onset_s - 0.06)
        out.append(Outcome(push, bool(overlaps.any())))
    return out


def judged_run(prepared: Prepared, config: Config, friction: FrictionFile) -> tuple[DetectorRun, DetectionInputs]:
    """What the detector makes of a log, as an audit computes it."""
    applied = applied_friction(prepared, friction, config)
    rule, watch = make_rule(prepared.judged_series, prepared.phases, config)
    forbidden = joints_not_judged(prepared.findings, prepared.judged)
    inputs = DetectionInputs(applied.laws, forbidden, rule, watch, quiet=applied.quiet)
    return run_detector(prepared, inputs, config), inputs


def injected_outcomes(
    files: SimulatedFiles, robot: str, pushes: Sequence[Push], friction: FrictionFile, overrides: dict[str, object]
) -> list[Outcome]:
    """Which of the same pushes alarm when they are added to a clean log at other moments."""
    settings = load_config(files.config, overrides)
    prepared = api.prepare(files.log, settings, friction)
    config = settings.config
    run, inputs = judged_run(prepared, config, friction)
    series = prepared.judged_series
    kernel, period = run.residual.balance.kernel, series.period_s
    joints = [j for j, name in enumerate(series.joint_names) if inputs.watch[name].watched]
    gamma = np.array([inputs.rule.gamma_nm[series.joint_names[j]] for j in joints])
    out = []
    for duration in dict.fromkeys(push.duration_s for push in pushes):
        same = [push for push in pushes if push.duration_s == duration]
        shape = ContactShape("push", duration, same[0].edge_s)
        margin = margin_samples(kernel, series.bandwidth_hz, period)
        after = round(duration / period) + margin
        usable = np.ones(series.time_s.size, dtype=bool)
        moments = open_moments(series, usable, margin, after)
        moments = moments[(series.time_s[moments] > 2.0) & (series.time_s[moments] < series.time_s[-1] - 2.5)]
        moments = spread_moments(moments, len(same), np.random.default_rng(5))
        contacts = [_contact(prepared, robot, push, int(at)) for push, at in zip(same, moments, strict=True)]
        samples = moments[:, None] + np.arange(-margin, after)
        unit = unit_torques(prepared, contacts, samples, shape)[joints]
        shown = through_filters(unit, kernel, series.bandwidth_hz, period)
        around = windows(series, run, inputs.laws, joints, samples)
        force = np.array([push.force_n for push in same])
        fired = alarmed(around, force[None, :, None] * shown, gamma, inputs.rule.n)
        out += [Outcome(push, bool(found)) for push, found in zip(same, fired, strict=True)]
    return out


def _contact(prepared: Prepared, robot: str, push: Push, sample: int) -> InjectedContact:
    arm = robot_named(robot)
    frame, point = arm.links[push.link - 1]
    bodies = prepared.robot.bodies
    assert bodies is not None
    forward = bodies.forward()
    forward.update(prepared.series.position_rad[sample])
    rotation, origin = forward.pose(forward.arm.frame_number(frame))
    place = origin + rotation @ np.array(point)
    radius = np.array([place[0], place[1], 0.0]) / np.hypot(place[0], place[1])
    direction = {
        "down": np.array([0.0, 0.0, -1.0]),
        "inward": -radius,
        "around": np.array([-radius[1], radius[0], 0.0]),
    }[push.direction]
    return InjectedContact(sample, "", frame, (direction[0], direction[1], direction[2]), point)


def wilson(missed: int, count: int) -> tuple[float, float]:
    """95 % interval of a share."""
    z, share = 1.96, missed / count
    centre = share + z * z / (2 * count)
    half = z * sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    return (centre - half) / (1 + z * z / count), (centre + half) / (1 + z * z / count)


def difference_sd(a: FloatArray, b: FloatArray) -> float:
    """Standard errors between two shares of misses."""
    share = (a.sum() + b.sum()) / (a.size + b.size)
    return float((a.mean() - b.mean()) / max(1e-9, sqrt(share * (1 - share) * (1 / a.size + 1 / b.size))))


def log_paths(folder: Path, name: str) -> SimulatedFiles:
    """Files of a log that was simulated before."""
    return SimulatedFiles((folder / f"{name}.csv",), folder / f"{name}.toml", None, folder / f"{name}.truth.json")
