"""A small arm and its logs, made in a second: enough to run every command for real."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from collaudit.cli import main as entry

SCHEMAS = Path(__file__).resolve().parents[2] / "docs" / "schemas"
RATE_HZ = 250.0
CONFIG = """
[robot]
dh_convention = "standard"
dh = [
  { a = 0.4, alpha = 1.5707963267948966, mass_kg = 4.0, com_m = [-0.2, 0.0, 0.0], inertia_kg_m2 = [0.01, 0.06, 0.06, 0, 0, 0] },
  { a = 0.3, mass_kg = 2.0, com_m = [-0.15, 0.0, 0.0], inertia_kg_m2 = [0.01, 0.02, 0.02, 0, 0, 0] },
]
base_rpy_deg = [90, 0, 0]
[log.csv]
time = "t"
position = "q{i}"
velocity = "dq{i}"
effort = "tau{i}"
[detect]
gamma_nm = 4.0
persistence_ms = 25
"""  # noqa: E501
_SPEEDS = (0.05, 0.1, 0.15, 0.25, 0.4, 0.6)
_TRAVEL = 0.45


@dataclass(frozen=True)
class Outcome:
    """What a command did."""

    code: int
    out: str
    err: str


def check_printed_json(text: str) -> None:
    """Whatever a command prints with --json keeps to the published schema that it names."""
    if not text:
        return  # stopped by a test before it printed
    document = json.loads(text)
    name = document["schema"].split("/")[1]
    schema = json.loads((SCHEMAS / f"{name}-1.schema.json").read_text(encoding="utf-8"))
    assert schema["properties"]["schema"]["const"] == document["schema"]
    Draft202012Validator(schema).validate(document)


@pytest.fixture
def collaudit(capfd: pytest.CaptureFixture[str]) -> Callable[..., Outcome]:
    """Run a command in this process and give its exit code and both streams."""

    def run(*args: object) -> Outcome:
        capfd.readouterr()
        code = entry.run([str(arg) for arg in args])
        out, err = capfd.readouterr()
        if "--json" in args:
            check_printed_json(out)
        return Outcome(code, out, err)

    return run


def _motion(start: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Each joint in turn there and back at six speeds, the other at rest: position, velocity (n, 2)."""
    period = 1 / RATE_HZ
    velocity = []
    for joint in (0, 1):
        for speed in _SPEEDS:
            ramp = np.arange(0, speed, 2.0 * period)
            hold = np.full(int(_TRAVEL / speed / period), speed)
            stroke = np.concatenate([ramp, hold, ramp[::-1], np.zeros(25)])
            both = np.concatenate([stroke, -stroke])
            velocity.append(np.column_stack([both if joint == column else 0 * both for column in (0, 1)]))
    dq = np.concatenate([np.zeros((50, 2)), *velocity, np.zeros((50, 2))])
    return np.cumsum(dq, axis=0) * period + np.array(start), dq


def write_arm_csv(path: Path, push_nm: float = 0.0, seed: int = 0, start: tuple[float, float] = (0.2, -0.3)) -> None:
    """Write a log of the arm in CONFIG as CSV; a push of 0.3 s acts on joint 1 in its fastest stroke."""
    from collaudit.core.config import parse_config
    from collaudit.core.robot.robot_building import build_robot

    config = parse_config(CONFIG, None).config
    model = build_robot(config.robot, Path(), ["joint1", "joint2"])
    q, dq = _motion(start)
    ddq = np.gradient(dq, 1 / RATE_HZ, axis=0)
    friction = np.sign(dq) * (1.0 + 0.8 * np.exp(-np.abs(dq) / 0.08)) + 1.5 * dq
    tau = model.inverse_dynamics(q, dq, ddq) + friction
    tau += np.random.default_rng(seed).normal(0, 0.05, tau.shape)
    fastest = np.flatnonzero(dq[:, 0] > 0.599)
    start = fastest[len(fastest) // 2]
    tau[start : start + int(0.3 * RATE_HZ), 0] += push_nm
    rows = np.column_stack([np.arange(len(q)) / RATE_HZ, q, dq, tau])
    np.savetxt(path, rows, delimiter=",", header="t,q1,q2,dq1,dq2,tau1,tau2", comments="", fmt=["%.3f"] + 6 * ["%.9g"])


@dataclass(frozen=True)
class Arm:
    """Files of the small arm.

    Attributes:
        config: its collaudit.toml.
        clean: a log without contact.
        pushed: a log with a push of 12 N·m.
        friction: friction fitted on another clean log.
    """

    config: Path
    clean: Path
    pushed: Path
    friction: Path

    @staticmethod
    def run(log: Path) -> str:
        """The run folder of a log that is named itself, away from its configuration."""
        return f"{log.parent.name}_{log.stem}"


@pytest.fixture(scope="session")
def arm(once: Callable[..., Path]) -> Arm:
    """The small arm's files, made once; no test changes them."""

    def files(folder: Path) -> Arm:
        return Arm(folder / "arm.toml", folder / "clean.csv", folder / "pushed.csv", folder / "friction.json")

    def make(folder: Path) -> Path:
        made = files(folder)
        made.config.write_text(CONFIG, encoding="utf-8")
        write_arm_csv(made.clean)
        write_arm_csv(made.pushed, push_nm=12.0, seed=1)
        write_arm_csv(folder / "fit.csv", seed=2)
        assert entry.run(["fit", str(folder / "fit.csv"), "-c", str(made.config), "-o", str(made.friction)]) == 0
        return folder

    return files(once(("small arm",), make))
