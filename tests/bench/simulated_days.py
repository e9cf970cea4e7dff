"""Days of an arm: clean logs, or pushed ones, whose drives drift, warm up and carry what no description states.

A day's joints follow random moves between random poses. Their torque is that of the arm with a tool and rotors that
the judged description lacks, friction (Coulomb, viscous, Stribeck; over a reversal it turns within a few thousandths of
a radian, as Dahl's model has it) whose level differs from day to day and falls by 15 % as the gears warm up, a zero of
the sensor that drifts, and noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np

from collaudit.core import api
from collaudit.core.config import LoadedConfig, load_config
from collaudit.core.data.joint_log import JointLog, LogSource
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.robot_model import RobotModel
from collaudit.fixtures.arms import robot_named
from collaudit.fixtures.simulation import simulate_to

RATE_HZ = 100.0
#: Drift of the torque's zero, N·m: at most so much, with this period, s.
DRIFT_NM, DRIFT_S = 0.14, (200.0, 1500.0)
#: Friction of a day over that of the first, at most; what it falls by as it warms up, within so many seconds.
DAY_SHARE, WARM_SHARE, WARM_S = 0.2, 0.15, 600.0
_SETTLED_RAD = (0.001, 0.004)
#: Moves of a motion that comes back.
_MOVES = 5


@dataclass(frozen=True, slots=True, eq=False)
class Arm:
    """One arm.

    Attributes:
        name: of it.
        described: what is judged with.
        robot: as it is, its tool and rotors included.
        middle_rad: (j,) of its motion.
        speed_rad_s: (j,) fastest moves.
        coulomb_nm, viscous_nm_s, extra_nm, stribeck_rad_s, travel_rad: (j,) of its friction.
        noise_nm: (j,) of its torque sensors.
        unmodelled: RMS of torque that no rigid body has (cables, geometry), a function of the pose, over that of the
            rigid bodies in the motion.
        friction: (j,) times the friction stated above.
    """

    name: str
    described: LoadedConfig
    robot: RobotModel
    middle_rad: FloatArray
    speed_rad_s: FloatArray
    coulomb_nm: FloatArray
    viscous_nm_s: FloatArray
    extra_nm: FloatArray
    stribeck_rad_s: FloatArray
    travel_rad: FloatArray
    noise_nm: FloatArray
    unmodelled: float = 0.0
    friction: FloatArray | float = 1.0


#: Joints of the arms of the description files, the middle of their motion, and the frame of the tool.
_URDFS = {
    "ur10_robot.urdf": (
        ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"),
        (0.0, -1.2, 1.2, -1.0, -1.0, 0.0), "tool0",
    ),
    "panda.urdf": (
        tuple(f"panda_joint{k}" for k in range(1, 8)), (0.0, 0.0, 0.0, -1.6, 0.0, 1.6, 0.0), "panda_link8",
    ),
}  # fmt: skip


def arm_of(name: str, work: Path, urdfs: Path, more_kg: float = 0.0) -> Arm:
    """``paper6``, ``seven``, or the arm of a URDF in a folder; with so much more at the tool than usual."""
    work.mkdir(parents=True, exist_ok=True)
    plain = work / f"{name}.rule.toml"
    if name in _URDFS:
        names, middle, frame = _URDFS[name]
        head = f'[robot]\nurdf = "{urdfs / name}"\njoints = {list(names)}\n'.replace("'", '"')
    else:
        fixture = robot_named(name)
        names, middle, frame = fixture.joints, fixture.home, None
        made = simulate_to("free-clean", name, 1, "csv", work / f"{name}-robot.csv", duration_s=5.0)
        kept, keep = [], False
        for line in made.config.read_text(encoding="utf-8").splitlines():
            keep = line.startswith(("[robot]", "[[robot")) if line.startswith("[") else keep
            kept += [line] if keep and not line.startswith("armature") else []
        head = "\n".join(kept)
    plain.write_text(f'{head}\n[detect]\ngamma_nm = "auto"\n', encoding="utf-8")
    rng = np.random.default_rng(sum(map(ord, name)))
    j = len(names)
    load = np.geomspace(12.0, 0.6, j)
    truth: dict[str, object] = {
        "robot.armature_kg_m2": (0.02 * load).tolist(), "robot.tool.mass_kg": 0.9 + more_kg,
        "robot.tool.com_m": [0.01, 0.0, 0.06],
        **({} if frame is None else {"robot.tool.frame": frame}),
    }  # fmt: skip
    return Arm(
        name, load_config(plain), api.load_robot(load_config(plain, truth), names), np.array(middle),
        speed_rad_s=rng.uniform(0.8, 1.6, j),
        coulomb_nm=load * rng.uniform(0.6, 1.2, j),
        viscous_nm_s=0.5 * load * rng.uniform(0.6, 1.4, j),
        extra_nm=load * rng.uniform(0.1, 0.4, j),
        stribeck_rad_s=rng.uniform(0.03, 0.12, j),
        travel_rad=rng.uniform(*_SETTLED_RAD, j),
        noise_nm=0.02 * load,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Push:
    """A force at the tool, N in base axes, from a moment on, s."""

    start_s: float
    force_n: tuple[float, float, float]
    lasts_s: float = 0.2


@dataclass(frozen=True, slots=True)
class Program:
    """A motion that comes back.

    Attributes:
        cycle_s: of a cycle at full speed.
        seed: of its places; None: those of the day.
        overrides: share of full speed, drawn for each cycle.
        wait_s: longest wait after a move, drawn for each.
        aside_rad: how far its second place lies beside the program's, on every joint.
    """

    cycle_s: float
    seed: int | None = None
    overrides: tuple[float, ...] = (1.0,)
    wait_s: float = 0.0
    aside_rad: float = 0.0


def day(
    arm: Arm,
    seed: int,
    seconds: float,
    pushes: Sequence[Push] = (),
    *,
    first: bool = False,
    cycle_s: float = 0.0,
    program: Program | None = None,
) -> JointLog:
    """A log of one day; without pushes nothing touches the arm. The first day's friction is as the arm has it.

    With ``cycle_s``, or a program, its motion comes back.
    """
    rng = np.random.default_rng([seed, 60])
    time_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    q, v, a, settled = _motion(arm, rng, time_s, program or (Program(cycle_s) if cycle_s else None))
    curve = arm.coulomb_nm + arm.extra_nm * np.exp(-((np.abs(v) / arm.stribeck_rad_s) ** 2))
    share = 0.0 if first else DAY_SHARE
    level = rng.uniform(1.0 - share, 1.0 + share, len(arm.speed_rad_s))
    level = level * (1.0 - WARM_SHARE * (1.0 - np.exp(-time_s[:, None] / WARM_S)))
    size, period, phase = (rng.uniform(*x, len(arm.speed_rad_s)) for x in ((0.0, DRIFT_NM), DRIFT_S, (0.0, 2 * np.pi)))
    zero = size * np.sin(2.0 * np.pi * time_s[:, None] / period + phase)
    rigid = arm.robot.inverse_dynamics(q, v, a)
    effort = rigid + arm.friction * level * (settled * curve + arm.viscous_nm_s * v) + zero
    size = arm.unmodelled * np.sqrt(2.0) * np.std(rigid, axis=0)
    effort += size * np.sin(2.0 * q + np.roll(q, 1, axis=1) + np.arange(q.shape[1]))
    effort += 0.5 * arm.noise_nm * np.sin(100.0 * q) + rng.normal(0.0, arm.noise_nm, q.shape)
    frame = arm.robot.outer_frame(arm.robot.joint_names[-1])
    for push in pushes:
        rows = np.flatnonzero((time_s >= push.start_s) & (time_s < push.start_s + push.lasts_s))
        effort[rows] += arm.robot.torque_per_newton(q[rows], str(frame)) @ np.array(push.force_n)
    source = LogSource(f"{arm.name} {seed}", sha256(f"{arm.name} {seed} {pushes}".encode()).hexdigest(), "made", None,
                       "column", "made")  # fmt: skip
    measured = q + rng.normal(0.0, 2e-5, q.shape), v + rng.normal(0.0, 1e-3, q.shape)
    return JointLog(time_s, arm.robot.joint_names, *measured, effort, "Nm", None, source)


def _motion(
    arm: Arm, rng: np.random.Generator, time_s: FloatArray, program: Program | None
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Position, velocity, acceleration, and how far friction has turned to the motion's side, -1 to 1; (n, j) each."""
    j, at = len(arm.speed_rad_s), 0
    out = np.zeros((4, time_s.size, j))
    place, side = arm.middle_rad + rng.uniform(-0.5, 0.5, j), np.zeros(j)
    goals, moves, override = None, 0, 1.0
    if program is not None:
        places = rng if program.seed is None else np.random.default_rng([program.seed, 61])
        goals = arm.middle_rad + places.uniform(-1.0, 1.0, (_MOVES, j))
        goals[1] += program.aside_rad
    while at < time_s.size:
        goal = arm.middle_rad + rng.uniform(-1.0, 1.0, j) if goals is None else goals[0]
        way = goal - place
        lasts = max(0.5, float(np.max(1.875 * np.abs(way) / (rng.uniform(0.15, 1.0) * arm.speed_rad_s))))
        rests = rng.uniform(0.0, 0.6) if rng.random() < 0.3 else 0.0
        if goals is not None and program is not None:
            override = float(rng.choice(program.overrides)) if moves % _MOVES == 0 else override
            goals, moves = np.roll(goals, -1, axis=0), moves + 1
            lasts, rests = program.cycle_s / _MOVES / override, float(rng.uniform(0.0, program.wait_s))
        s = np.arange(round((lasts + rests) * RATE_HZ)) / RATE_HZ
        x = np.minimum(s / lasts, 1.0)[:, None]
        q = place + way * x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
        v = way / lasts * 30.0 * x**2 * (1.0 - x) ** 2
        a = way / lasts**2 * 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)
        sign = np.sign(way)
        turned = sign * (1.0 - (1.0 - sign * side) * np.exp(-np.abs(q - place) / arm.travel_rad))
        stop = min(at + s.size, time_s.size)
        out[:, at:stop] = np.stack([q, v, a, turned])[:, : stop - at]
        place, side, at = goal, turned[-1], stop
    return out[0], out[1], out[2], out[3]
