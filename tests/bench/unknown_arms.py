"""Arms that nothing here was tuned on, by a simulator of a page of its own: init, fit and detect as a user types them.

    python tests/bench/unknown_arms.py --work build/unknown [--arms ur5,xarm7,z1]

Moves from rest to rest between random poses at 200 Hz. The truth differs from the description by 8 % in each mass and a
centimetre in each centre, has rotors that nobody states, friction that gives way over 4 mrad after a reversal, rubs
another 10 % more or less each day and warms up, and efforts that are stamped a sample (5 ms) late. Logged are encoder
counts, a velocity that the drive filters, and efforts in steps with noise.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import sysconfig
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.signal import lfilter

from collaudit.core.numeric.arrays import FloatArray

RATE_HZ, LATE = 200.0, 1
ROBOTS = {
    "ur5": "ur_description/urdf/ur5_robot.urdf",
    "xarm7": "xarm_description/urdf/xarm7.urdf",
    "z1": "z1_description/urdf/z1.urdf",
}
LOAD_KG, PUSHES_N = 0.8, {"tool": 100.0, "elbow": 150.0}


@dataclass(frozen=True)
class Truth:
    """An arm as it is; friction by joint, (j,) each."""

    model: Any
    coulomb: FloatArray
    fall: FloatArray
    rate: FloatArray
    viscous: FloatArray
    one_sided: FloatArray
    rotor: FloatArray

    @classmethod
    def of(cls, urdf: Path, load_kg: float = 0.0) -> Truth:
        """Of a description: its gripper held, its bodies and friction varied."""
        whole = pin.buildModelFromUrdf(str(urdf))
        grips = [j for j in range(1, whole.njoints) if re.search("grip|finger", whole.names[j], re.IGNORECASE)]
        model = pin.buildReducedModel(whole, grips, pin.neutral(whole))
        rng = np.random.default_rng(5)
        for k in range(1, model.njoints):
            body = model.inertias[k]
            offset = 0.01 * rng.normal(size=3)
            model.inertias[k] = pin.Inertia(body.mass * (1.0 + 0.08 * rng.normal()), body.lever + offset, body.inertia)
        poses = np.random.default_rng(6).uniform(*_limits(model), (200, model.nv))
        zero, data = np.zeros(model.nv), model.createData()
        heavy = np.max([np.abs(pin.rnea(model, data, q, zero, zero)) for q in poses], axis=0)
        if load_kg:
            model.inertias[model.njoints - 1] += pin.Inertia(load_kg, np.array([0.0, 0.0, 0.08]), 1e-3 * np.eye(3))
        size, draw = np.maximum(0.12 * heavy, 0.25), np.random.default_rng(9)
        coulomb = size * draw.uniform(0.6, 1.4, model.nv)
        return cls(
            model,
            coulomb,
            0.4 * coulomb * draw.uniform(0.0, 1.0, model.nv),
            draw.uniform(8.0, 25.0, model.nv),
            coulomb * draw.uniform(0.3, 1.2, model.nv),
            draw.normal(0.0, 0.05, model.nv),
            draw.uniform(0.02, 0.2, model.nv) * np.maximum(heavy, 1.0) / 30.0,
        )

    def friction(self, v: FloatArray) -> FloatArray:
        """(n, j) of a motion: bristles of 4 mrad, Stribeck's fall, viscous."""
        bristle = np.zeros_like(v)
        for k in range(1, len(v)):
            bristle[k] = np.clip(bristle[k - 1] + v[k] / RATE_HZ / 0.004, -1.0, 1.0)
        sliding = (self.coulomb + self.fall * np.exp(-self.rate * np.abs(v))) * bristle + self.viscous * v
        return np.asarray(sliding * (1.0 + self.one_sided * np.sign(v)))


def _limits(model: Any) -> tuple[FloatArray, FloatArray]:
    return np.maximum(model.lowerPositionLimit, -2.2) + 0.25, np.minimum(model.upperPositionLimit, 2.2) - 0.25


def moves(model: Any, seconds: float, rng: np.random.Generator) -> FloatArray:
    """(n, j) quintic moves between poses, with waits."""
    low, high = _limits(model)
    parts, here, count = [], 0.5 * (low + high), 0
    while count < seconds * RATE_HZ:
        there = rng.uniform(low, high)
        lasts = max(1.875 * float(np.abs(there - here).max()) / rng.uniform(0.4, 1.4), 0.6)
        s = np.arange(0.0, lasts, 1.0 / RATE_HZ) / lasts
        wait = round(float(rng.choice([0.0, 0.0, rng.uniform(0.2, 0.8)])) * RATE_HZ)
        parts += [here + np.outer(10 * s**3 - 15 * s**4 + 6 * s**5, there - here), np.tile(there, (wait, 1))]
        here, count = there, count + s.size + wait
    return np.vstack(parts)[: round(seconds * RATE_HZ)]


def logged(truth: Truth, seconds: float, day: int, push: tuple[str, float] | None = None) -> FloatArray:
    """(n, 1 + 3 j) time, positions, velocities and efforts of a day; a push of a quarter of a second in its middle."""
    rng, model = np.random.default_rng(day), truth.model
    q = moves(model, seconds, rng)
    v = np.gradient(q, 1.0 / RATE_HZ, axis=0)
    a = np.gradient(v, 1.0 / RATE_HZ, axis=0)
    data, n = model.createData(), model.nv
    torque = np.array([pin.rnea(model, data, *one) for one in zip(q, v, a, strict=True)]) + truth.rotor * a
    level = 1.0 + (0.1 * rng.normal(size=n) if day else 0.0)
    warm = 1.0 + 0.1 * np.exp(-np.arange(len(q)) / RATE_HZ / 400.0)
    torque += truth.friction(v) * level * warm[:, None] + (0.03 * truth.coulomb * rng.normal(size=n) if day else 0.0)
    if push is not None:
        joint = model.njoints - 1 if push[0] == "tool" else model.njoints // 2
        first, count = len(q) // 2, round(0.25 * RATE_HZ)
        way = rng.normal(size=3)
        way *= push[1] / np.linalg.norm(way)
        for k in range(count):
            pin.computeJointJacobians(model, data, q[first + k])
            reach = pin.getJointJacobian(model, data, joint, pin.LOCAL_WORLD_ALIGNED)[:3]
            torque[first + k] -= np.sin(np.pi * k / count) * reach.T @ way
    torque = np.vstack([np.repeat(torque[:1], LATE, axis=0), torque[:-LATE]])
    step = 0.005 * truth.coulomb
    torque = step * np.round((torque + 0.02 * truth.coulomb * rng.normal(size=torque.shape)) / step)
    counts = 2.0 * np.pi / 2**17
    seen = counts * np.round(q / counts)
    fast = lfilter([0.35], [1.0, -0.65], np.diff(seen, axis=0, prepend=seen[:1]) * RATE_HZ, axis=0)
    return np.column_stack([np.arange(len(q)) / RATE_HZ, seen, fast, torque])


def spoilt(log: FloatArray, joints: int) -> dict[str, FloatArray]:
    """One thing wrong with each: what a cause or a finding should name."""
    effort = 1 + 2 * joints
    first, second, third = (effort + np.argsort(-log[:, effort:].std(axis=0))[:3]).tolist()
    out = {kind: log.copy() for kind in ("exchanged", "inverted", "scale", "zero", "delay")}
    out["exchanged"][:, [first, second]] = log[:, [second, first]]
    out["inverted"][:, second] *= -1.0
    out["scale"][:, third] *= 0.7
    out["zero"][:, second] += 0.5 * log[:, second].std()
    out["delay"][8:, effort:] = log[:-8, effort:]
    return out


def typed(*words: object) -> subprocess.CompletedProcess[str]:
    """A command as a user types it."""
    whole = [str(Path(sys.executable).with_name("collaudit")), *map(str, words)]
    return subprocess.run(whole, capture_output=True, text=True, check=False)


def judged(name: str, log: FloatArray, work: Path, arm: str, *more: str) -> dict[str, Any]:
    """The audit of a log."""
    file, out = _written(work / f"{arm}-{name}.csv", log), work / f"{arm}-{name}"
    typed("detect", file, "-c", work / f"{arm}.toml", "--friction", work / f"{arm}.friction.json", "-o", out, *more)
    audit: dict[str, Any] = json.loads((out / "audit.json").read_text(encoding="utf-8"))
    return audit


def _written(path: Path, log: FloatArray) -> Path:
    names = [f"{stem}{k + 1}" for stem in ("q", "qd", "tau") for k in range((log.shape[1] - 1) // 3)]
    np.savetxt(path, log, delimiter=",", header=",".join(["time", *names]), comments="", fmt="%.9g")
    return path


def rows_of(arm: str, work: Path) -> list[str]:
    """What is found on one arm, a line each."""
    (robots,) = Path(sysconfig.get_path("purelib")).glob("*/share/example-robot-data/robots")
    urdf = robots / ROBOTS[arm]
    truth = Truth.of(urdf)
    fitted = _written(work / f"{arm}-fit.csv", logged(truth, 240.0, 0))
    typed("init", fitted, "--urdf", urdf, "-o", work / f"{arm}.toml", "--force")
    delay = re.search(r"^#? ?effort_delay_ms = .*", (work / f"{arm}.toml").read_text(encoding="utf-8"), re.MULTILINE)
    typed("fit", fitted, "-c", work / f"{arm}.toml", "-o", work / f"{arm}.friction.json")
    clean = logged(truth, 240.0, 1)
    found = {"clean": judged("clean", clean, work, arm)}
    for day, (place, force) in enumerate(PUSHES_N.items(), 2):
        found[f"push, {place}"] = judged(place, logged(truth, 120.0, day, (place, force)), work, arm)
    carried = logged(Truth.of(urdf, LOAD_KG), 120.0, 4)
    found[f"{LOAD_KG} kg"] = judged("load", carried, work, arm)
    estimate = ("--set", 'robot.tool.mass_kg="estimate"')
    found["the same, estimated"] = judged("estimate", carried, work, arm, *estimate)
    for kind, log in spoilt(clean, truth.model.nv).items():
        found[kind] = judged(kind, log, work, arm)
    out = [f"| {arm} | delay by init | {delay[0] if delay else 'none'} | | |"]
    for name, audit in found.items():
        cause = next((one["text"] for one in audit["causes"] if one["speaks"]), "")
        errors = sorted({one["code"] for one in audit["findings"] if one["severity"] == "error"})
        out.append(f"| {arm} | {name} | {audit['verdict']} | {len(audit['contacts'])} | {cause or ', '.join(errors)} |")
    return out


def main() -> None:
    """Print the table."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--work", type=Path, default=Path("build/unknown"))
    asked.add_argument("--arms", default=",".join(ROBOTS))
    given = asked.parse_args()
    given.work.mkdir(parents=True, exist_ok=True)
    print("| arm | log | verdict | contacts | cause, or errors |\n|---|---|---|---|---|")
    for arm in given.arms.split(","):
        print("\n".join(rows_of(arm, given.work)), flush=True)


if __name__ == "__main__":
    main()
