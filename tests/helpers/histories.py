"""Records of nights whose truth is known: arms that stay as they are, wear, carry another tool, or feel the weather."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date, timedelta

import numpy as np

from collaudit.core.history.log_record import JointRecord, LogRecord

FIRST = date(2026, 9, 1)
Truth = Callable[[int, str], float]


def night(number: int) -> str:
    return (FIRST + timedelta(days=number)).isoformat()


def joint_record(joint: str, friction: float, load: float, rng: np.random.Generator, **besides: object) -> JointRecord:
    """A joint whose friction and load exceed the model by these shares, read with errors of 1 and 2 %."""
    values = {
        "joint": joint,
        "watched": True,
        "gamma_nm": 4.0,
        "n": 13,
        "judged_s": 50.0,
        "detectable_s": 40.0,
        "observed_s": 60.0,
        "clean_s": 50.0,
        "rms_nm": 0.3,
        "p99_nm": 0.9,
        "clean_mean_abs_nm": 0.2 + 2.0 * abs(friction) + rng.normal(0.0, 0.01),
        "gamma_margin": 3.0,
        "temperature_c": None,
        "friction_excess": friction + rng.normal(0.0, 0.01),
        "friction_excess_se": 0.01,
        "load_excess": load + rng.normal(0.0, 0.02),
        "load_excess_se": 0.02,
        "offset_nm": rng.normal(0.0, 0.05),
        "offset_nm_se": 0.05,
        "freedom": 40.0,
        "law_nm": 8.0,
        "law_nm_low": 7.8,
        "law_nm_high": 8.2,
        "law_speed_rad_s": 0.3,
        "friction_level": 1.0 + friction,
    }
    return JointRecord(**{**values, **besides})  # type: ignore[arg-type]


def log_record(robot: str, number: int, joints: tuple[JointRecord, ...], **besides: object) -> LogRecord:
    values = {
        "robot": robot,
        "night": night(number),
        "night_from": "log",
        "log": f"{robot}-{number}.mcap",
        "log_sha256": f"{robot}-{number}",
        "start": f"{night(number)}T22:00:00Z",
        "verdict": "pass",
        "reasons": (),
        "error": None,
        "duration_s": 60.0,
        "period_s": 0.002,
        "judged_h": 1 / 60,
        "detector": "direct",
        "persistence_s": 0.026,
        "config_sha256": "c",
        "friction_sha256": "f",
        "model_sha256": "m",
        "collaudit": "0.1.0",
    }
    return LogRecord(**{**values, **besides}, joints=joints)  # type: ignore[arg-type]


def history(
    robot: str,
    nights: int,
    joints: tuple[str, ...] = ("j1", "j2", "j3"),
    friction: Truth = lambda _number, _joint: 0.0,
    load: Truth = lambda _number, _joint: 0.0,
    warmth_c: Callable[[int], float] | None = None,
    seed: int = 0,
) -> list[LogRecord]:
    """One log a night of one robot."""
    rng = np.random.default_rng(seed)
    out = []
    for number in range(nights):
        warm = None if warmth_c is None else warmth_c(number)
        made = tuple(joint_record(j, friction(number, j), load(number, j), rng, temperature_c=warm) for j in joints)
        out.append(log_record(robot, number, made))
    return out
