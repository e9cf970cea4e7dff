"""A message type, a vendor's mode and a key are added in one file each, as docs/architecture.md says."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer

ROOT = Path(__file__).parents[2]


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """The sources, to be edited."""
    for package in ("cli", "core", "reports", "fixtures"):
        shutil.copytree(ROOT / package, tmp_path / "collaudit" / package, ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path / "collaudit"


def edit(file: Path, before: str, added: str) -> None:
    """Insert text behind the one place that holds ``before``."""
    text = file.read_text(encoding="utf-8")
    assert text.count(before) == 1
    file.write_text(text.replace(before, before + added), encoding="utf-8")


def run(tree: Path, program: str) -> str:
    """What a program prints that sees the edited sources."""
    done = subprocess.run(
        [sys.executable, "-c", program], env={**os.environ, "PYTHONPATH": str(tree.parent)}, capture_output=True,
        text=True, check=False, cwd=tree.parent,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_message_type_is_a_profile(tree: Path) -> None:
    edit(
        tree / "core/vendors/message_profiles.py",
        "PROFILES: tuple[Profile, ...] = (\n",
        '    Profile(name="acme", role="joint_states", types=("acme.ArmState",), stamp="sec,nanosec",\n'
        '            fixed_names=("acme_{i}",), position="angles", velocity="rates", effort="torques"),\n',
    )
    with (tree.parent / "log.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("acme.ArmState", "jsonschema", b"{}")
        channel = writer.register_channel("/arm", "json", schema)
        for k in range(50):
            values = {
                "sec": 0,
                "nanosec": 2_000_000 * k,
                "angles": [0.1 * k, 1.0],
                "rates": [0.1, 0],
                "torques": [1, 2],
            }
            writer.add_message(channel, 2_000_000 * k, json.dumps(values).encode(), 2_000_000 * k)
        writer.finish()
    program = """
from pathlib import Path
from collaudit.core.config.schema import LogConfig
from collaudit.core.logs.log_reading import read_log
log = read_log((Path("log.mcap"),), LogConfig(), robot_joints=None)
print(*log.joint_names, log.position_rad[10, 0], log.effort[10, 1])
"""
    assert run(tree, program).split() == ["acme_1", "acme_2", "1.0", "2.0"]


def test_a_mode_of_a_vendor_is_a_word(tree: Path) -> None:
    edit(tree / "core/vendors/vendor_words.py", "MODE_WORDS = {", '"acmeteach": "guiding", ')
    time_s = 0.002 * np.arange(100)
    rows = [f"{t:.3f},{np.sin(t):.6f},1,{'ACME_TEACH' if 40 <= k < 60 else 'AUTO'}" for k, t in enumerate(time_s)]
    (tree.parent / "log.csv").write_text("\n".join(["t,q1,tau1,robot_mode", *rows]), encoding="utf-8")
    program = """
from pathlib import Path
from collaudit.core.config.schema import LogConfig
from collaudit.core.logs.log_reading import read_log
log = read_log((Path("log.csv"),), LogConfig.of({"units": {"effort": "Nm"}}), robot_joints=None)
print(log.annotations)
"""
    said = run(tree, program)
    assert "'guiding'" in said and "0.08" in said


def test_a_key_is_a_field(tree: Path) -> None:
    edit(
        tree / "core/config/schema.py",
        '    operator: Annotated[Stated, about("Who ran the robot, or answers for the recording.")] = None\n',
        '    shift: Annotated[Stated, about("The shift in which it ran.")] = None\n',
    )
    (tree.parent / "collaudit.toml").write_text('[report]\nshift = "early"\n', encoding="utf-8")
    program = """
from pathlib import Path
from collaudit.core.config import load_config
from collaudit.core.config.describe import all_keys
print(load_config(Path("collaudit.toml"), {}).config.report.stated())
print([key.dotted for key in all_keys() if key.dotted == "report.shift"])
"""
    assert run(tree, program).splitlines() == ["{'shift': 'early'}", "['report.shift']"]
