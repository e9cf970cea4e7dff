"""Known-truth logs judged by every detector: the measurements behind docs/evidence.md."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from strong_pushes import strong_pushes

from collaudit.core.api import prepare
from collaudit.core.config import load_config
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun, run_detector
from collaudit.core.detection.rule_settings import make_rule
from collaudit.core.findings import joints_not_judged
from collaudit.core.fitting import fit_logs
from collaudit.core.friction.joint_fits import friction_models
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.scoring.detection_score import JudgedResidual, Score, score
from collaudit.fixtures import simulation
from collaudit.fixtures.arms import robot_named
from collaudit.fixtures.simulated_robot import FixtureRobot
from collaudit.reports.files.run_files import read_friction, write_friction

#: Pushes count when their true torque exceeds 1.3 gamma for longer than n.
FACTOR = 1.3


def soft(robot: FixtureRobot, times: float = 5.0) -> FixtureRobot:
    """The same arm with bristles that travel further before they slip."""
    softer = tuple(replace(f, bristle_nm_per_rad=f.bristle_nm_per_rad / times) for f in robot.friction)
    return replace(robot, friction=softer)


def simulated(folder: Path, robot: str, scenario: str, seed: int, duration_s: float | None = None) -> Path:
    """The log of a scenario, simulated unless it is there; ``robot`` may end in ``-soft``."""
    path = folder / robot / f"{scenario}-{seed}.mcap"
    if not path.with_suffix(".truth.json").exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        base = robot.removesuffix("-soft")
        arm = robot_named(base)
        original = simulation.robot_named
        simulation.robot_named = lambda _: soft(arm) if robot.endswith("-soft") else arm
        try:
            simulation.simulate_to(scenario, base, seed, "mcap", path, duration_s=duration_s)
        finally:
            simulation.robot_named = original
    return path


def friction_of(folder: Path, robot: str) -> FrictionFile:
    """Friction fitted once from the identification run of the robot (never of its soft twin)."""
    robot = robot.removesuffix("-soft")
    file = folder / robot / "friction-1.json"
    if not file.exists():
        log = simulated(folder, robot, "friction", 1)
        loaded = load_config(log.with_suffix(".toml"))
        prepared = prepare((log,), loaded)
        write_friction(file, fit_logs([prepared], loaded.config, loaded.provenance(None, None)))
    return read_friction(file)


def off_calibration(friction: FrictionFile, share: float) -> FrictionFile:
    """A calibration against which the arm's friction is off by ``share`` (-0.15: the arm has 15 % less)."""
    joints = {
        name: replace(
            fit, parameters={k: v if k.startswith("C") else v / (1 + share) for k, v in fit.parameters.items()}
        )
        for name, fit in friction.joints.items()
    }
    return replace(friction, joints=joints)


@dataclass(frozen=True)
class Bench:
    """A log ready to be judged by any detector."""

    prepared: Prepared
    inputs: DetectionInputs
    config: Config
    truth: Path

    def with_friction(self, friction: FrictionFile) -> Bench:
        """The same log against another calibration."""
        laws, _ = friction_models(friction.joints, self.prepared.judged_series)
        return replace(self, inputs=replace(self.inputs, laws=laws))

    def judged(self, name: str, causal: bool) -> DetectorRun:
        detect = self.config.detect.changed({"causal": causal})
        return run_detector(self.prepared, self.inputs, self.config.changed({"detect": detect}), name)

    def score(
        self, found: DetectorRun, watch: Sequence[str] | None = None, factor: float = FACTOR
    ) -> tuple[Score, tuple[float, float]]:
        """Score of all joints combined against pushes above ``factor`` times γ, and shares of joint time.

        The shares are those judged by friction's value, and judged at all (friction's range, too).
        """
        series = self.prepared.judged_series
        rule = self.inputs.rule
        events = strong_pushes(self.truth, factor, (rule.n + 1) * series.period_s)
        if watch is not None:
            events = [replace(e, required={j: t for j, t in e.required.items() if j in watch}) for e in events]
        ratio = found.residual.torque_nm / found.threshold.all_joints()
        judged = JudgedResidual(series.time_s, ratio, found.detected.state, series.joint_names, rule.n)
        columns = [k for k, name in enumerate(series.joint_names) if watch is None or name in watch]
        state = found.detected.state[:, columns]
        shares = (float(np.mean(state == State.JUDGED)), float(np.mean(state <= State.FRICTION_INTERVAL)))
        return score(events, found.detected.collisions, judged)[0], shares


def bench(log: Path, friction: FrictionFile, watch: Sequence[str] | None = None) -> Bench:
    """Read and prepare a simulated log."""
    overrides: dict[str, object] = {} if watch is None else {"detect.watch": list(watch)}
    loaded = load_config(log.with_suffix(".toml"), overrides)
    prepared = prepare((log,), loaded)
    series = prepared.judged_series
    laws, _ = friction_models(friction.joints, series)
    rule, watched = make_rule(series, prepared.phases, loaded.config)
    not_judged = joints_not_judged(prepared.findings, prepared.judged)
    return Bench(
        prepared, DetectionInputs(laws, not_judged, rule, watched), loaded.config, log.with_suffix(".truth.json")
    )


@dataclass(frozen=True)
class Total:
    """Scores of several logs added up."""

    events: int
    found: int
    not_observable: int
    alarms: int
    false_alarms: int
    judged_h: float
    delay_ms: tuple[float, ...]
    auc: float

    @property
    def recall(self) -> float:
        return self.found / max(1, self.events - self.not_observable)

    @property
    def precision(self) -> float:
        return 1.0 - self.false_alarms / max(1, self.alarms)


def add_up(scores: Sequence[Score]) -> Total:
    """Totals over logs; the mean of the areas under the curve."""
    aucs = [s.auc for s in scores if s.auc is not None]
    return Total(
        events=sum(s.events for s in scores),
        found=sum(s.found for s in scores),
        not_observable=sum(s.not_observable for s in scores),
        alarms=sum(s.alarms for s in scores),
        false_alarms=sum(s.false_alarms for s in scores),
        judged_h=sum(s.judged_h for s in scores),
        delay_ms=tuple(1e3 * d for s in scores for d in s.delay_s),
        auc=float(np.mean(aucs)) if aucs else float("nan"),
    )
