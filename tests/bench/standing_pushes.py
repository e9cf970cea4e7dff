"""Arms that mostly stand, pushed while they do: known truth for what is disturbed at rest.

The arm goes to a random pose, stands there for some seconds, and is pushed once: any link, a force that gives the
joint that it loads most a stated multiple of its threshold, blows of 40 ms to pushes of more than a second.
``python standing_pushes.py LOGS SEEDS SECONDS [DOCS]``: LOGS keeps the friction, SECONDS is clean rest for each seed.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path as FilePath

import numpy as np
from detection_runs import friction_of
from tables import put

from collaudit.core.config.schema import Config
from collaudit.core.contacts.contacts import find_contacts, rest_disturbances
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.detection_result import Contact, RestDisturbance
from collaudit.core.data.joint_log import JointLog
from collaudit.core.detection.detector_run import DetectionInputs, run_detector
from collaudit.core.detection.rest_steps import rest_steps
from collaudit.core.detection.rule_settings import make_rule
from collaudit.core.friction.joint_fits import friction_models
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.preparation import prepare
from collaudit.core.robot.robot_model import RobotModel
from collaudit.fixtures.arms import robot_named
from collaudit.fixtures.experiments import Experiment, Path
from collaudit.fixtures.pushes import Push, apply_push
from collaudit.fixtures.simulated_robot import FixtureRobot

GAMMA_NM = 4.0


@dataclass(frozen=True)
class StandingPush:
    """One push: when, and its largest torque on each joint over the threshold."""

    onset_s: float
    end_s: float
    ratio: FloatArray


def standing(
    arm: FixtureRobot, model: RobotModel, rng: np.random.Generator, count: int, ratios: Sequence[float]
) -> tuple[Experiment, list[StandingPush]]:
    """So many rests, each in another pose and with one push; every third move is of one joint only."""
    path = Path(arm.home)
    path.hold(2.0)
    home = np.array(arm.home)
    onsets = []
    for k in range(count):
        target = home + rng.uniform(-0.7, 0.7, home.size)
        if k % 3 == 0:
            path.move_joint(j := int(rng.integers(home.size)), float(target[j]), float(rng.uniform(0.2, 0.9)), 3.0)
        else:
            path.move(target, float(rng.uniform(0.2, 0.9)), 3.0)
        before = float(rng.uniform(1.0, 2.5))
        onsets.append(path.time_s + before)
        path.hold(before + 1.5 + float(rng.uniform(1.0, 2.0)))
    plain = Experiment(*path.sampled(0.05))
    pushes, truth = [], []
    for onset in onsets:
        duration = float(np.exp(rng.uniform(np.log(0.04), np.log(1.4))))
        edge = min(float(np.exp(rng.uniform(np.log(0.008), np.log(0.25)))), duration / 2.2)
        link = int(rng.integers(1, len(arm.links) + 1))
        direction = ("around", "down", "inward")[int(rng.integers(3))] if link > 1 else "around"
        unit = Push(link, 1.0, direction, onset, duration, edge)  # type: ignore[arg-type]
        felt = np.abs(apply_push(unit, arm, model, plain.position).torque_nm).max(axis=0)
        ratio = float(rng.uniform(*ratios))
        push = replace(unit, force_n=ratio * GAMMA_NM / float(felt.max()))
        pushes.append(push)
        truth.append(StandingPush(onset, onset + duration, push.force_n * felt / GAMMA_NM))
    return replace(plain, pushes=tuple(pushes)), truth


def braked_rest(arm: FixtureRobot, model: RobotModel, rng: np.random.Generator, seconds: float) -> JointLog:
    """An arm at rest that is never touched: drifting torque, friction that creeps, brakes now and then.

    The drives hold gravity but for a share that friction took over when the arm stopped; with the brakes on they hold
    nothing, and the arm sags by a few counts.
    """
    from coverage_logs import logged

    from collaudit.fixtures.plant import SAMPLE_S, Trace

    n = round(seconds / SAMPLE_S)
    t = SAMPLE_S * np.arange(n)
    q0 = np.array(arm.home) + rng.uniform(-0.5, 0.5, len(arm.home))
    gravity = model.gravity_torque(q0[None, :])[0]
    count = q0.size
    step = 2.0 * np.pi / arm.sensors.encoder_counts
    held = rng.uniform(-0.6, 0.6, count) * np.array([f.forward.coulomb_nm for f in arm.friction])
    creep = held * np.exp(-t[:, None] / rng.uniform(200.0, 2000.0, count))
    drive = gravity + creep
    position = q0 + step * rng.uniform(-1.5, 1.5, count) * np.sin(2 * np.pi * t[:, None] / rng.uniform(60, 600, count))
    at = 60.0
    while at < seconds - 60.0:
        a, b = np.searchsorted(t, [at, at + rng.uniform(5.0, 40.0)])
        ramp = np.clip((t[a:b] - t[a]) / 0.05, 0.0, 1.0) * np.clip((t[b - 1] - t[a:b]) / 0.05, 0.0, 1.0)
        drive[a:b] *= 1.0 - ramp[:, None]
        position[a:b] -= ramp[:, None] * step * rng.uniform(0.0, 30.0, count) * np.sign(gravity)
        at += float(rng.uniform(120.0, 600.0))
    trace = Trace(position, np.gradient(position, SAMPLE_S, axis=0), drive, np.zeros((n, 6)))
    return logged(trace, arm, model, rng)


def report(friction_logs: FilePath, seeds: Sequence[int], clean_s: float) -> Iterator[str]:
    """The table of docs/evidence.md: pushes found, and reports in clean hours."""
    from coverage_logs import logged

    from collaudit.fixtures import experiments
    from collaudit.fixtures.experiments import carry_out

    yield "| arm | pushes, 1.5–2.5 γ | contacts | disturbed | missed | besides | false: rest | false: stop-go |"
    yield "|---|---|---|---|---|---|---|---|"
    for name in ("paper6", "seven"):
        arm = robot_named(name)
        model, friction = arm.model(), friction_of(friction_logs, name)
        pushes = alarmed = told = besides = 0
        false = {"rest": 0, "stop-go": 0}
        for seed in seeds:
            rng = np.random.default_rng([seed, 77])
            plan, truth = standing(arm, model, rng, 40, (1.5, 2.5))
            contacts, found = _events(logged(carry_out(plan, arm, model, rng).trace, arm, model, rng), arm, friction)
            for push in truth:
                spans = [_during(push, c.onset_s, c.end_s) for c in contacts]
                seen = [_during(push, d.onset_s, d.end_s) for d in found]
                alarmed, told = alarmed + any(spans), told + (any(seen) and not any(spans))
            pushes += len(truth)
            besides += sum(not any(_during(p, d.onset_s, d.end_s) for p in truth) for d in found)
            rng = np.random.default_rng([seed, 78])
            false["rest"] += len(_events(braked_rest(arm, model, rng, clean_s), arm, friction)[1])
            moved = carry_out(experiments.stop_go(arm, rng, 0.1 * clean_s), arm, model, rng).trace
            false["stop-go"] += len(_events(logged(moved, arm, model, rng), arm, friction)[1])
        hours = len(seeds) * clean_s / 3600.0
        cells = (pushes, alarmed, told, pushes - alarmed - told, besides)
        clean = (f"{false['rest']} in {hours:.1f} h", f"{false['stop-go']} in {0.1 * hours:.2f} h")
        yield "| " + " | ".join([name, *map(str, cells), *clean]) + " |"


def _during(push: StandingPush, onset_s: float, end_s: float) -> bool:
    return onset_s < push.end_s + 0.3 and push.onset_s - 0.3 < end_s


def _events(
    log: JointLog, arm: FixtureRobot, friction: FrictionFile
) -> tuple[Sequence[Contact], Sequence[RestDisturbance]]:
    """Contacts and disturbances of a log at the usual rule."""
    config = Config.of({"detect": {"gamma_nm": GAMMA_NM}})
    prepared = prepare(log, arm.model(), config)
    laws, _ = friction_models(friction.joints, prepared.judged_series)
    rule, watch = make_rule(prepared.judged_series, prepared.phases, config)
    inputs = DetectionInputs(laws, frozenset(), rule, watch)
    run = run_detector(prepared, inputs, config)
    contacts = find_contacts(prepared, run, config)
    spans = [(c.onset_s, c.end_s) for c in contacts]
    return contacts, rest_disturbances(rest_steps(prepared, run, inputs), prepared.judged_series.joint_names, spans)


if __name__ == "__main__":
    lines = []
    for line in report(FilePath(sys.argv[1]), range(801, 801 + int(sys.argv[2])), float(sys.argv[3])):
        print(line, flush=True)
        lines.append(line)
    if len(sys.argv) > 4:
        put(FilePath(sys.argv[4]), "standing", lines)
