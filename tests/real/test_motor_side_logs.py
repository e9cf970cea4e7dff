"""Arms that log their motors behind gears with a coupled wrist, and joint torques without a time column."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.real

TX40 = """
[robot]
urdf = "{urdf}"
joints = ["joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6"]
reduction = [[32, 0, 0, 0, 0, 0], [0, 32, 0, 0, 0, 0], [0, 0, 45, 0, 0, 0],
             [0, 0, 0, -48, 0, 0], [0, 0, 0, 0, 45, 0], [0, 0, 0, 0, 32, 32]]
joint_offset_rad = [0, -1.5707963, 1.5707963, 0, 0, 0]
[log.csv]
rate_hz = 5000
position = "*pos*:Joint_{{i}}"
effort = "*curr*:Joint_{{i}}"
[log.units]
effort = "Nm"
[fit]
estimate = ["friction", "inertials"]
motion = "any"
[friction]
model = "coulomb-viscous"
"""
#: Published identification, at the joints. Friction and inertia of joint 5 are published with those of the axis that
#: joints 5 and 6 turn together; its own are the difference.
COULOMB = (7.14, 8.26, 6.34, 2.48, 3.03, 0.282)
AXIS = {"coulomb_nm": 1.95, "viscous_nm_s_per_rad": 0.616, "inertia_kg_m2": 0.00964}
VISCOUS = (8.05, 5.53, 1.97, 1.11, 1.86 - 0.616, 0.65 - 0.616)
INERTIA = {"joint_3": 0.0988, "joint_4": 0.0313, "joint_5": 0.0468 - 0.00964, "joint_6": 0.0105 - 0.00964}


@pytest.fixture
def tx40(cli, data_dir: Path, once: Any) -> Any:  # type: ignore[no-untyped-def]
    def fitted(_: Path) -> Any:
        urdf = (data_dir / "urdf" / "tx40_mdh_modified.urdf").as_posix()
        Path("c.toml").write_text(TX40.format(urdf=urdf), encoding="utf-8")
        logs = sorted((data_dir / "tx40_csv").glob("*.csv"))
        assert cli("fit", *logs, "-c", "c.toml", "-o", "friction.json").code == 0
        return json.loads(Path("friction.json").read_text(encoding="utf-8"))

    return once(("fit of the tx40",), fitted)


def inside(bounds: list[float], value: float) -> bool:
    return bounds[0] <= value <= bounds[1]


def test_a_staubli_by_its_motors_gives_the_published_coupling_and_drive_inertia(tx40: Any) -> None:
    (axis,) = tx40["coupled"].values()
    assert axis["weights"] == {"joint_5": 1.0, "joint_6": 1.0}
    for key, value in AXIS.items():
        assert inside(axis["ci95"][key], value), key
    drives = tx40["identified"]["joints"]
    for joint, value in INERTIA.items():
        assert inside(drives[joint]["armature_ci95"], value), joint


def test_its_friction_is_the_published_one_at_the_speeds_that_were_used(tx40: Any) -> None:
    """Published lines were fitted through reversals, too, where friction is below its sliding value: their Coulomb part
    is lower and their slope steeper. At the speeds both were fitted at they agree, to the scatter of the points.
    """
    for j, (name, fit) in enumerate(tx40["joints"].items()):
        low, high = fit["speed_range_rad_s"]
        speed = np.linspace(low, high, 20)
        published = COULOMB[j] + VISCOUS[j] * speed
        found = fit["parameters"]["A_nm"] + fit["parameters"]["D_nm_s_per_rad"] * speed
        middle = slice(5, 15)
        assert np.abs(found - published)[middle].max() < max(0.06 * published.max(), 0.35), name
    for name, index in (("joint_5", 4), ("joint_6", 5)):
        assert inside(tx40["joints"][name]["ci95"]["D_nm_s_per_rad"], VISCOUS[index]), name


def test_an_lbr_without_time_goes_from_init_to_audit_once_its_rate_and_sign_are_stated(cli, data_dir: Path) -> None:  # type: ignore[no-untyped-def]
    log = data_dir / "lbr_csv" / "measurements.csv"
    first = cli("init", log, "--urdf", data_dir / "urdf" / "med7dock.urdf", "-o", "c.toml")
    assert first.code == 3
    assert "rate_hz" in first.err
    text = Path("c.toml").read_text(encoding="utf-8").replace("[log.csv]", "[log.csv]\nrate_hz = 100", 1)
    Path("c.toml").write_text(text, encoding="utf-8")
    assert cli("fit", log, "-c", "c.toml", "-o", "friction.json").code == 3  # every joint's friction drives it
    found = json.loads(Path("friction.json").read_text(encoding="utf-8"))
    inverted = {f["joint"] for f in found["findings"] if f["code"] == "effort-sign-inverted"}
    assert {"A2", "A4"} <= inverted  # these sensors count what acts on the arm, not what it does
    signs = "effort_sign = { " + ", ".join(f"A{i} = -1" for i in range(1, 8)) + " }"
    text = text.replace("[log.units]", f"[log.units]\n{signs}", 1)
    Path("c.toml").write_text(text, encoding="utf-8")
    assert cli("fit", log, "-c", "c.toml", "-o", "friction.json").code == 0
    done = cli("audit", log, "-c", "c.toml", "--friction", "friction.json", "-o", "out")
    assert done.code in (0, 1, 3)
    (result,) = Path("out").glob("*/audit.json")
    audit = json.loads(result.read_text(encoding="utf-8"))
    assert any(stats["judged_s"] > 1.0 for stats in audit["residual"].values())
