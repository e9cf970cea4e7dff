"""A log of two arms is two audits of one arm each, whatever tells the arms apart."""

from __future__ import annotations

import json
import re
from pathlib import Path

import log_writers as w
import numpy as np
import pytest
from simulated_logs import without_thresholds
from small_arm import arm_module

from collaudit.core.logs.log_guess import arms_of
from collaudit.core.logs.log_summary import LogSummary

ROBOT = arm_module().CONFIG.partition("[log.csv]")[0] + "[detect]\ngamma_nm = 4.0\n"
#: How much later the second arm's messages come than the first's, ns.
LATE = 700_000
SIDES = ("left", "right")


def _signals(log: Path) -> tuple[np.ndarray, ...]:
    rows = np.loadtxt(log, delimiter=",", skiprows=1)[::5]  # 50 Hz: a push of 0.3 s has 15 samples
    return rows[:, 0], rows[:, 1:3], rows[:, 3:5], rows[:, 5:7]


def _messages(log: Path, topic: str, names: list[str], late_ns: int) -> list[w.Said]:
    t, *rest = _signals(log)
    stamps = w.EPOCH + late_ns + np.rint(t * 1e9).astype(np.int64)
    return [
        w.joint_state(names, *row, stamp_ns=int(stamp), topic=topic) for stamp, *row in zip(stamps, *rest, strict=True)
    ]


def _both(folder: Path, form: str, logs: tuple[Path, Path]) -> tuple[Path, Path]:
    """The log of both arms, and the left arm's own log, in one form."""
    folder.mkdir()
    if form == "columns":
        parts = [_signals(log) for log in logs]
        rows = min(len(part[0]) for part in parts)
        table = np.column_stack([parts[0][0][:rows], *(v[:rows] for part in parts for v in part[1:])])
        each = [name for quantity in ("q", "dq", "tau") for name in (f"{quantity}1", f"{quantity}2")]
        header = ",".join(["t", *(f"{side}_{name}" for side in SIDES for name in each)])
        np.savetxt(folder / "both.csv", table, delimiter=",", header=header, comments="", fmt="%.9g")
        own = ",".join(["t", *each])
        np.savetxt(folder / "left.csv", table[:, :7], delimiter=",", header=own, comments="", fmt="%.9g")
        return folder / "both.csv", folder / "left.csv"
    told = []
    for k, (side, log) in enumerate(zip(SIDES, logs, strict=True)):
        names = [f"{side}_joint1", f"{side}_joint2"] if form == "publishers" else ["joint1", "joint2"]
        told.append(
            _messages(log, "/joint_states" if form == "publishers" else f"/{side}/joint_states", names, k * LATE)
        )
    alone = w.write_mcap(folder / "left.mcap", told[0])
    mixed = sorted([*told[0], *told[1]], key=lambda one: one.log_ns)
    return w.write_mcap(folder / "both.mcap", mixed), alone


def _numbers(path: Path) -> str:
    """An audit without what tells which file and settings it is of, and what else is in the file."""
    content = json.loads(path.read_text())
    del content["provenance"], content["log"]["name"], content["log"]["sha256"]
    for contact in content["contacts"]:
        del contact["id"]  # it holds the log's hash
    content["findings"] = [
        found for found in content["findings"] if "joints that the robot does not have" not in found["text"]
    ]
    text = json.dumps(content, sort_keys=True)
    for name in ("both.", "left.", "right."):
        text = text.replace(name, "")
    return text


def _logs(folder: Path) -> dict[str, tuple[Path, Path]]:
    """Of a night and of a fit the logs of both arms, which move apart; the left one is pushed in the night."""
    write = arm_module().write_arm_csv
    out = {}
    for seed, (name, push) in enumerate({"fit": 0.0, "night": 12.0}.items()):
        out[name] = folder / f"{name}_left.csv", folder / f"{name}_right.csv"
        write(out[name][0], push, seed)
        write(out[name][1], 0.0, 10 + seed, (0.5, -0.1))
    return out


@pytest.mark.parametrize("form", ["topics", "publishers", "columns"])
def test_each_arm_is_judged_as_if_alone(collaudit, tmp_path: Path, form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    without_thresholds(monkeypatch)  # 4 N·m are stated
    (tmp_path / "arm.toml").write_text(ROBOT)
    logs = _logs(tmp_path)
    clean, alone_clean = _both(tmp_path / "clean", form, logs["fit"])
    both, alone = _both(tmp_path / "pushed", form, logs["night"])
    config = tmp_path / "both.toml"
    made = collaudit("init", both, "-c", tmp_path / "arm.toml", "-o", config)
    assert made.code == 0 and "one of 2 arms" in made.err, made.err
    for side in SIDES:
        friction = tmp_path / f"both.{side}.friction.json"
        assert collaudit("fit", clean, "-c", tmp_path / f"both.{side}.toml", "-o", friction).code == 0
    run = collaudit("audit", both, "-c", config, "-o", tmp_path / "out", "--set", "detect.gamma_nm=4")
    assert run.code == 1, run.err
    entries = {entry["robot"]: entry for entry in json.loads((tmp_path / "out" / "summary.json").read_text())["logs"]}
    assert {side: entry["verdict"] for side, entry in entries.items()} == {"left": "fail", "right": "pass"}
    single, friction, out = tmp_path / "left.toml", tmp_path / "left.json", tmp_path / "out_left"
    assert collaudit("init", alone, "-c", tmp_path / "arm.toml", "-o", single).code == 0
    assert collaudit("fit", alone_clean, "-c", single, "-o", friction).code == 0
    assert (
        collaudit("audit", alone, "-c", single, "--friction", friction, "-o", out, "--set", "detect.gamma_nm=4").code
        == 1
    )
    (ours,) = [path for path in (tmp_path / "out").glob("*/audit.json") if path.parent.name.startswith("left")]
    assert _numbers(ours) == _numbers(next(out.glob("*/audit.json")))


def test_two_topics_on_one_arm_are_no_two_arms(collaudit, tmp_path: Path) -> None:
    """A relay of the same messages under another namespace."""
    (tmp_path / "arm.toml").write_text(ROBOT)
    arm_module().write_arm_csv(tmp_path / "run.csv")
    told = [_messages(tmp_path / "run.csv", f"/{name}/joint_states", ["joint1", "joint2"], 0) for name in ("a", "b")]
    log = w.write_mcap(tmp_path / "log.mcap", sorted([*told[0], *told[1]], key=lambda one: one.log_ns))
    made = collaudit("init", log, "-c", tmp_path / "arm.toml", "-o", tmp_path / "one.toml")
    assert not re.search(r"\barms\b", made.err) and not (tmp_path / "one.a.toml").exists()


def test_a_second_encoder_is_no_arm() -> None:
    """Two sides of positions beside one of efforts, as drives log the motor's and the joint's encoder."""
    names = [f"{what}_{k}" for what in ("pos_mot", "pos_se", "tau") for k in (1, 2)]
    columns = {side: {"position": f"pos_{side}_{{i}}"} for side in ("mot", "se")}
    summary = LogSummary("run.csv", "csv", 1, None, 1.0, (), tuple(names))
    assert arms_of(summary, ("joint1", "joint2"), (), columns) == {}
    with_efforts = {side: {**patterns, "effort": f"tau_{side}_{{i}}"} for side, patterns in columns.items()}
    assert set(arms_of(summary, ("joint1", "joint2"), (), with_efforts)) == {"mot", "se"}
