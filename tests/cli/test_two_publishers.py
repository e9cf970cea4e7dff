"""Two publishers of the same joints on one topic, one of them with a push: no format lets either pass."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import log_writers as w
import numpy as np
import pytest
from faulty_case import clean_signals

from collaudit.core import api
from collaudit.core.config import load_config

PUSH_NM = 30.0
#: 8 s at 250 Hz; in the middle of them the push.
TAKEN = slice(1250, 3250)
PUSHED = slice(1000, 1075)


def course(text: str, push_nm: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Stamps (n,) and signals (n, 2) as one publisher tells them, each with noise of its own."""
    said = clean_signals(text, 0.0)
    assert said.dq is not None and said.tau is not None
    t, q, dq, tau = (values[TAKEN].copy() for values in (said.t, said.q, said.dq, said.tau))
    tau += np.random.default_rng(int(push_nm)).normal(0, 0.02, tau.shape)
    tau[PUSHED, 0] += push_nm
    return t - t[0], q, dq, tau


def messages(told: tuple[np.ndarray, ...], late_ns: int, encoding: str) -> list[w.Said]:
    stamps = w.EPOCH + np.rint(told[0] * 1e9).astype(np.int64)
    return [
        w.joint_state(
            ["joint1", "joint2"], *row, stamp_ns=int(stamp), log_ns=int(stamp) + late_ns, encoding=encoding
        )
        for stamp, *row in zip(stamps, *told[1:], strict=True)
    ]  # fmt: skip


def write(folder: Path, form: str, pair: Sequence[tuple[np.ndarray, ...]], every: int) -> Path:
    """The first publisher's samples with so many of the second's between them, under the same stamps."""
    if form == "csv":
        rows = [np.column_stack(told) for told in pair]
        mixed = [line for k in range(len(rows[0])) for line in (rows[0][k], *([rows[1][k]] if k % every == 0 else []))]
        names = "t,q1,q2,dq1,dq2,tau1,tau2"
        np.savetxt(folder / "log.csv", np.array(mixed), delimiter=",", header=names, comments="", fmt="%.9g")
        return folder / "log.csv"
    encoding = "ros1" if form == "bag" else "cdr"
    first, second = messages(pair[0], 0, encoding), messages(pair[1], 200_000, encoding)[::every]
    mixed = sorted([*first, *second], key=lambda one: one.log_ns)
    if form == "bag":
        return two_connections(folder / "log.bag", first, second)
    if form == "db3":
        return w.storage_file(w.write_folder(folder / "bag", mixed))
    return w.write_mcap(folder / "log.mcap", mixed, compression="zstd")


def two_connections(path: Path, *parts: list[w.Said]) -> Path:
    """A ROS 1 bag in which each part has its own connection to the topic."""
    with w.Bag1Writer(path) as writer:
        connections = [
            writer.add_connection("/joint_states", w.JOINT_STATE, typestore=w.ROS1, callerid=f"/node{number}")
            for number in range(len(parts))
        ]
        told = [(one.log_ns, number, one) for number, part in enumerate(parts) for one in part]
        for log_ns, number, one in sorted(told, key=lambda each: each[:2]):
            writer.write(connections[number], log_ns, w.encode(one, "ros1"))
    return path


FORMS = ["mcap", "bag", "db3", "csv"]
CONFLICT = "log-publishers-conflict"
#: Whether the calm publisher is first, the second's samples, and how much later its clock is.
PAIRS = [(True, 1, 0.0), (False, 1, 0.0), (True, 3, 0.0), (True, 3, 7e-4)]


def of_both(folder: Path, text: str, form: str, calm_first: bool, every: int, later_s: float) -> Path:
    """A log of the calm publisher and of the pushed one."""
    calm, pushed = course(text, 0.0), course(text, PUSH_NM)
    pushed = (pushed[0] + later_s, *pushed[1:])  # a clock of its own, where its stamps are not the same
    return write(folder, form, (calm, pushed) if calm_first else (pushed, calm), every)


@pytest.mark.parametrize("form", ["mcap", "bag", "db3"])
@pytest.mark.parametrize("pair", PAIRS[1:])
def test_their_conflict_forbids_a_pass(form: str, pair: tuple[bool, int, float], arm, tmp_path: Path) -> None:
    """As it is read; rows of a table conflict where they are put on one clock."""
    log = of_both(tmp_path, arm.config.read_text(), form, *pair)
    found = [f for f in api.open_log(log, load_config(arm.config)).findings if f.code == CONFLICT]
    assert found and all(f.forbids_pass for f in found)


@pytest.mark.parametrize(
    ("form", "pair"), [*((form, PAIRS[0]) for form in FORMS), *(("csv", pair) for pair in PAIRS[1:])]
)
def test_neither_is_judged(form: str, pair: tuple[bool, int, float], arm, collaudit, tmp_path: Path) -> None:
    log, out = of_both(tmp_path, arm.config.read_text(), form, *pair), tmp_path / "run"
    done = collaudit("detect", log, "-c", arm.config, "--friction", arm.friction, "-o", out)
    assert done.code == 3, done.out + done.err
    result = json.loads((out / "audit.json").read_text())
    assert result["verdict"] == "not_judged"
    assert CONFLICT in {finding["code"] for finding in result["findings"]}


@pytest.mark.parametrize("form", ["mcap", "bag", "db3"])
def test_the_same_twice_is_one(form: str, arm, tmp_path: Path) -> None:
    pushed = course(arm.config.read_text(), PUSH_NM)
    log = api.open_log(write(tmp_path, form, (pushed, pushed), 1), load_config(arm.config))
    assert CONFLICT not in {f.code for f in log.findings}
    assert not any(f.forbids_pass for f in log.findings)


@pytest.mark.parametrize("form", ["mcap", "csv"])
def test_the_same_twice_is_judged(form: str, arm, collaudit, tmp_path: Path) -> None:
    pushed = course(arm.config.read_text(), PUSH_NM)
    log = write(tmp_path, form, (pushed, pushed), 1)
    done = collaudit("detect", log, "-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "run")
    assert done.code == 1, done.out + done.err
