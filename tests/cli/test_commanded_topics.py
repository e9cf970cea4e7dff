"""Every command takes the measured topic, and none judges a lone commanded one: contact does not show in it."""

from __future__ import annotations

import tomllib
from pathlib import Path

import log_writers as w
import numpy as np
import pytest

NAMES = ("joint1", "joint2")


def rows_of(path: Path) -> np.ndarray:
    return np.loadtxt(path, delimiter=",", skiprows=1)


@pytest.fixture(params=["/joint_command", "/desired/joint_states", "/a/ipo"])
def commanded(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def recording(path: Path, **topics: Path) -> Path:
    """The signals of tables as topics of one recording."""
    said = []
    for topic, table in topics.items():
        for row in rows_of(table):
            stamp = w.EPOCH + round(1e9 * row[0])
            said.append(w.joint_state(NAMES, row[1:3], row[3:5], row[5:7], stamp_ns=stamp, topic=topic))
    return w.write_mcap(path, sorted(said, key=lambda one: one.log_ns), chunk_size=1 << 18)


def test_every_command_takes_the_measured_topic(arm, collaudit, tmp_path: Path, commanded: str) -> None:
    log = recording(tmp_path / "x.mcap", **{commanded: arm.clean, "/joint_states": arm.pushed})
    stated = ("-c", arm.config, "--friction", arm.friction)
    assert collaudit("detect", log, *stated, "-o", tmp_path / "run").code == 1
    assert collaudit("audit", log, *stated, "-o", tmp_path / "out").code == 1
    assert collaudit("inspect", log, "-c", arm.config).code == 0
    assert collaudit("fit", log, "-c", arm.config, "-o", tmp_path / "f.json").code == 0
    collaudit("init", log, "-c", arm.config, "-o", tmp_path / "c.toml")
    assert tomllib.loads((tmp_path / "c.toml").read_text())["log"]["joint_states"] == "/joint_states"


def test_no_command_judges_a_lone_commanded_topic(arm, collaudit, tmp_path: Path, commanded: str) -> None:
    log = recording(tmp_path / "x.mcap", **{commanded: arm.clean})
    stated = ("-c", arm.config, "--friction", arm.friction)
    line = f'[log] joint_states = "{commanded}"; [log] effort_kind = '
    for command in (("detect", *stated, "-o", tmp_path / "run"), ("inspect",), ("inspect", "-c", arm.config),
                    ("fit", "-c", arm.config, "-o", tmp_path / "f.json"), ("audit", *stated, "-o", tmp_path / "out"),
                    ("init", "-c", arm.config, "-o", tmp_path / "c.toml")):  # fmt: skip
        outcome = collaudit(command[0], log, *command[1:])
        assert outcome.code == 3 and line in outcome.err + outcome.out, command
    assert not (tmp_path / "f.json").exists()
    text = (tmp_path / "c.toml").read_text()
    (tmp_path / "c.toml").write_text(text.replace("# effort_kind = ", "effort_kind = "))
    said = collaudit("detect", log, "-c", tmp_path / "c.toml", "--friction", arm.friction, "-o", tmp_path / "run")
    assert said.code == 0, "what the advice says to state is stated"
