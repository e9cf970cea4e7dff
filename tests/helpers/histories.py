"""Rows of nights whose truth is known: one log a night, whose joints have a stated friction."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date, timedelta

from collaudit.core.history.night_row import JointContact, NightRow

FIRST = date(2026, 9, 1)
HIT = JointContact(1, 3.0, 6.0, (0.4, 0.0, 0.5), "new")


def night(number: int) -> str:
    return (FIRST + timedelta(days=number)).isoformat()


def night_row(robot: str, number: int, joint: str | None = "j1", **besides: object) -> NightRow:
    """A joint that was judged for 50 s and passed."""
    values = {
        "robot": robot,
        "night": night(number),
        "night_from": "log",
        "log": f"{robot}-{number}.mcap",
        "log_sha256": f"{robot}-{number}",
        "start": f"{night(number)}T22:00:00Z",
        "verdict": "pass",
        "why": "",
        "joint": joint,
        "tested": True,
        "judged_s": 50.0,
        "level_nm": 0.2,
        "gamma_nm": 4.0,
        "friction_nm": 8.0,
        "near_misses": 0,
        "contacts": (),
        "config_sha256": "c",
        "friction_sha256": "f",
        "collaudit": "0.1.0",
    }
    return NightRow(**{**values, **besides})  # type: ignore[arg-type]


def dark_row(robot: str, number: int) -> NightRow:
    """A log that could not be judged."""
    return night_row(robot, number, None, verdict="not_judged", why="the file ends early", tested=False, judged_s=0.0,
                     level_nm=None, gamma_nm=None, friction_nm=None)  # fmt: skip


def history(
    robot: str,
    nights: int,
    joints: tuple[str, ...] = ("j1", "j2", "j3"),
    friction_nm: Callable[[int, str], float] = lambda _number, _joint: 8.0,
) -> list[NightRow]:
    """One log a night of one robot."""
    every = [(number, joint) for number in range(nights) for joint in joints]
    return [night_row(robot, number, joint, friction_nm=friction_nm(number, joint)) for number, joint in every]
