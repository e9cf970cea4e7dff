"""A three-joint arm that repeats a program, its description off in masses: cycles, overrides and pushes are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from origins import NOBODY, log_source
from three_joints import COULOMB, NAMES, VISCOUS, arm, settings, tables

from collaudit.core.audit import audit_log
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import FRICTION_SCHEMA, Audit, FrictionFile, Provenance
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.signals import CycleReference
from collaudit.core.prepare.preparation import prepare

PERIOD = 0.008
#: Masses of the description are off by this factor, and a cable turns the second joint by so much, N·m: a quarter of
#: what it carries.
OFF, CABLE_NM = 1.2, 5.0
GAMMA = {"joint1": 6.0, "joint2": 12.0, "joint3": 6.0}
_MOVES = 4


@dataclass(frozen=True)
class Push:
    """A torque on the second joint in one cycle, or in every one: a share of the cycle at which it begins, and N·m."""

    cycle: int | None
    share: float
    torque_nm: float
    lasts_s: float = 0.25


def program(
    cycles: int,
    overrides: Sequence[float] = (1.0,),
    wait_s: float = 0.0,
    pushes: Sequence[Push] = (),
    seed: int = 0,
    aside_rad: float = 0.0,
    friction: Sequence[float] = (1.0, 1.0, 1.0),
    load_kg: float = 0.0,
    speed: float = 1.0,
) -> tuple[JointLog, np.ndarray]:
    """The log, and when each of its cycles begins, s; the arm comes from elsewhere first.

    Args:
        cycles: how many.
        overrides: share of the usual speed, dealt out in turn.
        wait_s: longest wait after a move.
        pushes: on the arm.
        seed: of noise, waits and drift.
        aside_rad: how far its second place lies aside.
        friction: times the usual one.
        load_kg: besides, at the tool.
        speed: of every cycle.
    """
    rng, places = np.random.default_rng(seed), np.random.default_rng(99).uniform(-0.9, 0.9, (_MOVES, 3))
    places[1] += aside_rad
    goals = [places[-1], *(places[k % _MOVES] for k in range(cycles * _MOVES))]
    place, rows, starts, pushed = np.array([0.2, -1.2, 0.4]), [], [], []
    at = 0
    for number, goal in enumerate(goals):
        cycle, move = divmod(number - 1, _MOVES)
        lasts = 1.6 / (speed * overrides[max(cycle, 0) % len(overrides)])
        if move == 0 and cycle >= 0:
            starts.append(at * PERIOD)
        share = np.minimum(np.arange(round((lasts + rng.uniform(0.0, wait_s)) / PERIOD)) * PERIOD / lasts, 1.0)[:, None]
        way = goal - place
        rows.append(np.hstack([
            place + way * share**3 * (10 - 15 * share + 6 * share**2),
            way / lasts * 30 * share**2 * (1 - share) ** 2,
            way / lasts**2 * 60 * share * (1 - share) * (1 - 2 * share),
        ]))  # fmt: skip
        for push in pushes:
            if number > 0 and push.cycle in (None, cycle) and int(push.share * _MOVES) == move:
                begin = at + round((push.share * _MOVES - move) * lasts / PERIOD)
                pushed.append((begin, begin + round(push.lasts_s / PERIOD), push.torque_nm))
        at, place = at + len(share), goal
    motion = np.concatenate(rows)
    q, v, a = motion[:, :3], motion[:, 3:6], motion[:, 6:]
    t = PERIOD * np.arange(len(q))
    truth = settings(1.0, tool={"mass_kg": load_kg, "com_m": [0.0, 0.0, 0.05]}) if load_kg else settings(1.0)
    law = np.array(friction) * (COULOMB * np.sign(v) + VISCOUS * v)
    drift = 1.0 - 0.1 * np.exp(-t / 60.0)[:, None]  # warming up
    torque = arm(truth).inverse_dynamics(q, v, a) + drift * law + 0.3 * np.sin(40.0 * q)
    torque[:, 1] += CABLE_NM * np.sin(2.0 * q[:, 1] + q[:, 0])
    for begin, end, torque_nm in pushed:
        torque[begin:end, 1] += torque_nm
    torque += rng.normal(0.0, 0.3, torque.shape)
    source = log_source("program", t, q, torque)
    measured = q + rng.normal(0.0, 2e-5, q.shape), v + rng.normal(0.0, 1e-3, v.shape)
    return JointLog(t, NAMES, *measured, torque, "Nm", None, source), np.array(starts)


def friction_file() -> FrictionFile:
    """The law of the three joints, as known."""
    joints = {}
    for name, coulomb, viscous in zip(NAMES, COULOMB, VISCOUS, strict=True):
        values = {"A_nm": float(coulomb), "D_nm_s_per_rad": float(viscous)}
        joints[name] = FrictionFit(
            "coulomb-viscous", values, dict.fromkeys(values), None, True, (), (), 30, 30, (0.01, 3.0), 0.0, "N·m", ()
        )
    return FrictionFile(FRICTION_SCHEMA, joints, (), Provenance("test", {}))


def stated(**extra: object) -> dict[str, Any]:
    """The description that is off, and thresholds that its errors need, as they stand in a file."""
    return tables(OFF, **{"detect": {"gamma_nm": GAMMA}, "policy": {"observable_n": {}}, **extra})


def config(**extra: object) -> Config:
    """The same, read."""
    return Config.of(stated(**extra))


def judged(log: JointLog, earlier: Sequence[CycleReference] = (), **extra: object) -> Audit:
    """The log as ``audit`` judges it, with what earlier nights say of its cycles."""
    its = config(**extra)
    return audit_log(prepare(log, arm(its), its), its, friction_file(), NOBODY, earlier=earlier, siblings=None)
