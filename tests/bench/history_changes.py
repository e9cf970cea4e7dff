"""What trends find in histories of known truth: ``python tests/bench/history_changes.py [FLEETS]`` (docs/history.md).

Records of 20 robots with two joints over 60 nights, without logs. Friction of a night is off its law by a scatter of
its own besides the error of its log. Quiet fleets: how many histories have an event. Worn ones: growth of 0.5 % a night
from night 10 on in one joint of one robot; found, first night and slope within their intervals, told after how many
nights, and what else was said.
"""

from __future__ import annotations

import sys
from datetime import date
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from histories import joint_record, log_record, night

from collaudit.core.history.log_record import LogRecord
from collaudit.core.history.robot_trend import robot_trends

ROBOTS, NIGHTS, BEGIN, GROWTH = 20, 60, 10, 0.005
JOINTS = ("joint1", "joint2")
LOG_ERROR = 0.0005  # of friction_excess in a minute of the small arm of fleet_night.py


def carried(rng: np.random.Generator, sd: float, r: float) -> np.ndarray:
    """(nights,) normal errors of which a share ``r`` carries over to the next."""
    x = rng.normal(0.0, sd, NIGHTS)
    for k in range(1, NIGHTS):
        x[k] = r * x[k - 1] + np.sqrt(1.0 - r**2) * x[k]
    return x


def robot(name: str, rng: np.random.Generator, scatter: float, r: float, worn: bool = False) -> list[LogRecord]:
    """One log a night."""
    off = {joint: carried(rng, scatter, r) for joint in JOINTS}
    out = []
    for k in range(NIGHTS):
        made = []
        for joint in JOINTS:
            true = off[joint][k] + (GROWTH * max(0, k - BEGIN) if worn and joint == "joint2" else 0.0)
            besides = {
                "clean_mean_abs_nm": 0.016 + rng.normal(0.0, 0.0003),
                "friction_excess": true + rng.normal(0.0, LOG_ERROR),
                "friction_excess_se": LOG_ERROR,
                "law_nm": 1.37,
                "law_nm_low": 1.36,
                "law_nm_high": 1.38,
            }
            made.append(joint_record(joint, 0.0, 0.0, rng, **besides))
        out.append(log_record(name, k, tuple(made)))
    return out


def quiet(fleets: int, scatter: float, r: float) -> None:
    """Print how many histories without a change have an event."""
    rng = np.random.default_rng([1, round(1e4 * scatter), round(10 * r)])
    false = 0
    for _ in range(fleets):
        records = [x for k in range(ROBOTS) for x in robot(f"robot-{k:02d}", rng, scatter, r)]
        false += sum(bool(trend.events) for trend in robot_trends(records))
    print(f"quiet, scatter {scatter:.1%}, carried over {r}: {false} of {fleets * ROBOTS} histories with an event")


def worn(fleets: int, scatter: float, r: float) -> None:
    """Print how the wearing joint of each fleet is found."""
    rng = np.random.default_rng([2, round(1e4 * scatter), round(10 * r)])
    found, since, slope, told, other, width = 0, 0, 0, [], 0, []
    for _ in range(fleets):
        records = [x for k in range(ROBOTS) for x in robot(f"robot-{k:02d}", rng, scatter, r, worn=k == 7)]
        for trend in robot_trends(records):
            right = [e for e in trend.events if e.cause == "wear-like growth" and e.changes[0].joint == "joint2"]
            right = right if trend.robot == "robot-07" else []
            other += len(trend.events) - len(right[:1])
            if right:
                change = right[0].changes[0]
                first, last = (date.fromisoformat(x).toordinal() for x in change.night_ci95)
                found += 1
                since += change.night_ci95[0] <= night(BEGIN) <= change.night_ci95[1]
                low, high = change.per_night_ci95 or (np.inf, -np.inf)
                slope += low <= GROWTH <= high
                told.append((date.fromisoformat(change.told_night) - date.fromisoformat(night(BEGIN))).days)
                width.append(last - first)
    print(
        f"worn, scatter {scatter:.1%}, carried over {r}: found {found} of {fleets}, first night held {since}, "
        f"slope held {slope}, told after {np.median(told):.0f} ({max(told)}) nights, interval {np.median(width):.0f} "
        f"nights, other events {other}"
    )


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 25
    for errors in ((0.005, 0.0), (0.02, 0.0), (0.005, 0.5), (0.02, 0.8)):
        quiet(count, *errors)
        worn(count, *errors)
