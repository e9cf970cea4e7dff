"""What the logs of one worker share is read or built once, and follows its file where that changes."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np

from collaudit.cli.shared_steps import audit_files
from collaudit.core.config import load_config
from collaudit.core.logs.inputs import group_inputs
from collaudit.core.numeric.parallel import threads, use_threads
from collaudit.core.robot.robot_building import build_robot


def test_friction_is_shared_and_the_result_is_the_same(arm) -> None:
    loaded = load_config(arm.config, {"friction.file": str(arm.friction)})
    (first, friction), (again, kept) = (audit_files([arm.clean], loaded) for _ in range(2))
    assert kept is friction
    assert first.result == again.result and np.array_equal(first.signals.residual_nm, again.signals.residual_nm)


def test_a_friction_file_that_changes_is_read_again(arm, tmp_path: Path) -> None:
    file = tmp_path / "friction.json"
    file.write_bytes(arm.friction.read_bytes())
    stamp = file.stat().st_mtime_ns
    loaded = load_config(arm.config, {"friction.file": str(file)})
    _, before = audit_files([arm.clean], loaded)
    text = json.loads(file.read_text())
    text["joints"]["joint1"]["parameters"]["A_nm"] *= 1.5
    file.write_text(json.dumps(text))
    os.utime(file, ns=(stamp, stamp))
    changed, after = audit_files([arm.clean], loaded)
    assert after.joints["joint1"].parameters["A_nm"] == 1.5 * before.joints["joint1"].parameters["A_nm"]
    assert changed.result.friction["joint1"].parameters["A_nm"] == after.joints["joint1"].parameters["A_nm"]


def test_a_changed_urdf_is_another_robot(tmp_path: Path) -> None:
    link = '<link name="{0}"><inertial><mass value="{1}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    joint = '<joint name="j1" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>'

    def robot(mass: float) -> str:
        links = "".join(f"{link.format(name, mass)}</inertial></link>" for name in "ab")
        (tmp_path / "arm.urdf").write_text(f'<robot name="r">{links}{joint}</robot>')
        config = load_config(None, {"robot.urdf": str(tmp_path / "arm.urdf")})
        return build_robot(config.config.robot, config.base_dir, ["j1"]).sha256

    first = robot(1.0)
    assert robot(1.0) == first and robot(2.0) != first


def test_parts_of_one_recording_are_found_among_many_logs(tmp_path: Path) -> None:
    for k in range(5):
        (tmp_path / f"{k}-q.csv").write_text(f"t,q1\n{k},0\n{k + 1},1\n")
        (tmp_path / f"{k}-tau.csv").write_text(f"t,tau1\n{k},0\n{k + 1},1\n")
    settings = load_config(None, {"log.csv.position": "q{i}", "log.csv.effort": "tau{i}"}).config.log
    found = group_inputs(sorted(tmp_path.iterdir()), settings)
    assert [[path.name for path in log] for log in found] == [[f"{k}-q.csv", f"{k}-tau.csv"] for k in range(5)]


def test_a_long_log_cut_among_threads_gives_the_bytes_of_the_whole(collaudit, arm, tmp_path: Path) -> None:
    rows = arm.pushed.read_text().splitlines()
    log = tmp_path / "gaps.csv"
    log.write_text("\n".join([rows[0], *rows[1:4000], *rows[4600:7000], *rows[7500:]]) + "\n")
    before, files = threads(), ("audit.json", "signals.parquet", "report.html")
    made = {}
    try:
        for count in (1, 2, 7):
            use_threads(1)
            out = tmp_path / f"out{count}"
            asked = ("-c", arm.config, "--friction", arm.friction, "-o", out, "-j", count)
            assert collaudit("audit", log, *asked).code == 1 and threads() == count
            (run,) = (path.parent for path in out.rglob("audit.json"))
            made[count] = [(run / name).read_bytes() for name in files]
    finally:
        use_threads(before)
    assert made[1] == made[2] == made[7]
