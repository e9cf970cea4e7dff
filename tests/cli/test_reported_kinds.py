"""Kinds of recordings that public reports describe and that are read as they stand: the push is found in each."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import log_writers as w
import numpy as np
import pytest

Rows = np.ndarray[Any, Any]
Made = Callable[[Path, Rows], Path]
NAMES = "t,q1,q2,dq1,dq2,tau1,tau2"


def table(change: Callable[[Rows], Rows] = lambda rows: rows, names: str = NAMES, time: str = "%.9f") -> Made:
    def make(folder: Path, rows: Rows) -> Path:
        changed = change(rows.copy())
        form = [time, *(changed.shape[1] - 1) * ["%.9g"]]
        np.savetxt(folder / "run.csv", changed, delimiter=",", header=names, comments="", fmt=form)
        return folder / "run.csv"

    return make


def since_epoch(scale: float) -> Made:
    def make(folder: Path, rows: Rows) -> Path:
        times = 1_600_000_000 + rows[:, 0]
        stamps = [f"{t:.6f}" if scale == 1 else str(round(t * scale)) for t in times.tolist()]
        lines = (",".join([stamp, *(f"{x:.9g}" for x in row[1:])]) for stamp, row in zip(stamps, rows, strict=True))
        (folder / "run.csv").write_text("\n".join([NAMES, *lines]) + "\n", encoding="utf-8")
        return folder / "run.csv"

    return make


def wrapped(low: float) -> Callable[[Rows], Rows]:
    """Angles from ``low`` to a turn above it; the joints are turned so that their motion crosses the seam."""

    def change(rows: Rows) -> Rows:
        rows[:, 1] = np.mod(rows[:, 1] - low, 2 * np.pi) + low
        return rows

    return change


def cut_times(rows: Rows) -> Rows:
    rows[:, 0] = np.floor(rows[:, 0] * 100) / 100
    return rows


def filled(every: int, *, later_s: float = 0.0013) -> Callable[[Rows], Rows]:
    """Rows of another sensor between, each with the values of the row before (forward filled)."""

    def change(rows: Rows) -> Rows:
        between = rows[::every].copy()
        between[:, 0] += later_s
        both = np.vstack([rows, between])
        return both[np.argsort(both[:, 0], kind="stable")]

    return change


def messages(*, zero: int = 0, names: tuple[str, ...] = ("joint1", "joint2"), fingers: int = 0, other: int = 0) -> Made:
    """A recording: the first ``zero`` messages without a stamp, ``fingers`` joints without effort in each message, and
    after each ``other`` messages one of another arm on the same topic.
    """

    def make(folder: Path, rows: Rows) -> Path:
        said = []
        extra = [f"finger{k}" for k in range(fingers)]
        still = np.zeros(fingers)
        for k, row in enumerate(rows):
            ns = w.EPOCH + round(1e9 * row[0])
            values = (np.concatenate([row[1 + 2 * j : 3 + 2 * j], still]) for j in range(3))
            stamp = 0 if k < zero else ns
            said.append(w.joint_state([*names, *extra], *values, stamp_ns=stamp, log_ns=ns))
            if other and k % other == 0:
                half = (row[2:0:-1].copy(), row[4:2:-1].copy(), row[6:4:-1].copy())
                said.append(w.joint_state(["right_1", "right_2"], *half, stamp_ns=ns + 10_000, log_ns=ns + 10_000))
        return w.write_mcap(folder / "run.mcap", said, chunk_size=1 << 18)

    return make


#: Kind, and its siblings.
KINDS: dict[str, dict[str, Made]] = {
    "messages before the clock, at stamp 0": {f"{k}": messages(zero=k) for k in (1, 20, 100)},
    "joints without effort in the list": {f"{k}": messages(fingers=k) for k in (1, 2, 6)},
    "another arm's messages on the topic": {f"every {k}": messages(other=k) for k in (1, 2, 10)},
    "stamps since 1970": {unit: since_epoch(scale) for unit, scale in
                          (("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9))},
    "wrapped angles": {f"from {low} rad": table(wrapped(low)) for low in (-np.pi, 0.0, 0.4, 0.4 - 2 * np.pi)},
    "times printed coarsely": {"1 ms": table(time="%.3f"), "10 ms": table(time="%.2f"), "10 ms, cut": table(cut_times)},
    "forward-filled rows": {"every row": table(filled(1)), "every second": table(filled(2)),
                            "every tenth": table(filled(10)), "much later": table(filled(3, later_s=0.003))},
}  # fmt: skip


@pytest.fixture(scope="module")
def pushed(arm: Any) -> Rows:
    """Some seconds about the push."""
    rows = np.loadtxt(arm.pushed, delimiter=",", skiprows=1)
    return rows[(rows[:, 0] > 33.5) & (rows[:, 0] < 54)]


@pytest.mark.parametrize("sibling", [f"{kind}: {name}" for kind, made in KINDS.items() for name in made])
def test_the_push_is_found(sibling: str, pushed: Rows, arm: Any, collaudit: Any, tmp_path: Path) -> None:
    kind, _, name = sibling.partition(": ")
    log, config = KINDS[kind][name](tmp_path, pushed), tmp_path / "c.toml"
    config.write_text(arm.config.read_text(encoding="utf-8"), encoding="utf-8")
    found = collaudit("detect", log, "-c", config, "--friction", arm.friction, "-o", tmp_path / "run")
    assert found.code == 1, found.err
    contacts = json.loads((tmp_path / "run" / "audit.json").read_text(encoding="utf-8"))["contacts"]
    assert len(contacts) == 1
