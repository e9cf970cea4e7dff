"""Programs over nights from the command line: references in a store, and what changed since an earlier audit."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit
from repeated_program import GAMMA, Push, friction_file, program, stated

from collaudit.core.data.joint_log import JointLog
from collaudit.reports.files.run_files import write_friction


@pytest.fixture
def cell(tmp_path: Path) -> Path:
    """Settings and friction of the arm that repeats a program."""
    columns = {"time": "t", "position": "q{i}", "velocity": "dq{i}", "effort": "tau{i}"}
    log = {"csv": columns, "joint_names": {f"{i}": f"joint{i}" for i in (1, 2, 3)}}
    policy = {"observable_n": {"tool": 1000.0}}
    (tmp_path / "cell.toml").write_text(tomlkit.dumps(stated(log=log, policy=policy)), encoding="utf-8")
    write_friction(tmp_path / "friction.json", friction_file())
    return tmp_path


def write(path: Path, made: tuple[JointLog, np.ndarray]) -> Path:
    log = made[0]
    rows = np.column_stack([log.time_s, log.position_rad, log.velocity_rad_s, log.effort])
    head = ",".join(["t", *(f"{name}{i}" for name in ("q", "dq", "tau") for i in (1, 2, 3))])
    path.parent.mkdir(exist_ok=True)
    np.savetxt(path, rows, delimiter=",", header=head, comments="", fmt="%.7g")
    return path


def audit(collaudit: Any, cell: Path, log: Path, out: str, *more: str) -> Any:
    settings = ("-c", cell / "cell.toml", "--friction", cell / "friction.json")
    return collaudit("audit", log, *settings, "-o", cell / out, "--json", *more)


def test_nights_that_passed_show_a_contact_in_every_cycle(collaudit: Any, cell: Path) -> None:
    store = ("--store", cell / "store", "--robot", "arm")
    for night in range(1, 5):
        log = write(cell / f"2026-11-0{night}" / "pick.csv", program(8, seed=night))
        done = audit(collaudit, cell, log, f"out{night}", *store, "--night", f"2026-11-0{night}")
        assert done.code == 0, done.err
        assert len(list((cell / "store").rglob("*.npz"))) == night
    touched = program(8, seed=9, pushes=[Push(None, 0.1, 0.5 * GAMMA["joint2"])])
    log = write(cell / "2026-11-05" / "pick.csv", touched)
    done = audit(collaudit, cell, log, "out5", *store, "--night", "2026-11-05")
    assert done.code == 1
    (line,) = json.loads(done.out)["logs"]
    facts = json.loads((cell / "out5" / line["report"]).with_name("audit.json").read_text())
    assert facts["cycles"]["nights"] == 4 and len(facts["contacts"]) >= 7
    assert len(list((cell / "store").rglob("*.npz"))) == 4, "a night with contacts is no reference"


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({}, None),
        ({"speed": 1.05}, "speed"),
        ({"load_kg": 0.3}, "load"),
        ({"aside_rad": 0.006}, "path"),
        ({"friction": (1.0, 1.1, 1.0)}, "friction"),
    ],
)
def test_what_changed_since_an_earlier_audit_is_named(
    collaudit: Any, cell: Path, change: dict[str, Any], named: str | None
) -> None:
    old = write(cell / "old" / "pick.csv", program(20, seed=1))
    new = write(cell / "new" / "pick.csv", program(20, seed=2, **change))
    assert audit(collaudit, cell, old, "before").code == 0
    done = audit(collaudit, cell, new, "after", "--against", cell / "before")
    (compared,) = json.loads(done.out)["changes"]
    changed = [one for one in compared["changes"] if one["changed"]]
    assert [one["quantity"] for one in changed] == ([] if named is None else [named])
    if named == "friction":
        assert changed[0]["joint"] == "joint2" and changed[0]["ci95"][0] < 0.1 < changed[0]["ci95"][1]
    assert all("equal within" in one["text"] for one in compared["changes"] if not one["changed"])
    assert "What changed in the programs" in (cell / "after" / "index.html").read_text()


def test_a_log_can_be_held_against_a_log_and_another_program_is_said_to_be_one(collaudit: Any, cell: Path) -> None:
    old, new = (write(cell / f"{seed}.csv", program(8, seed=seed)) for seed in (1, 2))
    (compared,) = json.loads(audit(collaudit, cell, new, "one", "--against", old).out)["changes"]
    assert compared["cycles"] == [7, 7] and not any(one["changed"] for one in compared["changes"])
    other = write(cell / "other.csv", program(8, aside_rad=0.4))
    (compared,) = json.loads(audit(collaudit, cell, other, "two", "--against", old).out)["changes"]
    assert "are needed of each" in compared["reason"] and not compared["changes"]
