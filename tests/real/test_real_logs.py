"""The commands of docs/real-logs.md on the real logs: what each arm's log shows, and its trap."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from collaudit.core.api import open_log
from collaudit.core.config import load_config
from collaudit.core.friction_laws.law_registry import LAWS

pytestmark = pytest.mark.real

UR3_NAMES = """
[log.joint_names]
Base = "shoulder_pan_joint"
Shoulder = "shoulder_lift_joint"
Elbow = "elbow_joint"
"Wrist 1" = "wrist_1_joint"
"Wrist 2" = "wrist_2_joint"
"Wrist 3" = "wrist_3_joint"
"""
UR_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
INVERTED = "[log.units]\neffort_sign = { " + ", ".join(f"{j}_joint = -1" for j in UR_JOINTS) + " }\n"


def load(path: str | Path) -> Any:
    return json.loads(Path(path).read_text(encoding="utf-8"))


def config(data: Path, urdf: str, extra: str = "") -> str:
    path = Path("collaudit.toml")
    path.write_text(f'[robot]\nurdf = "{(data / "urdf" / urdf).as_posix()}"\n{extra}', encoding="utf-8")
    return str(path)


def codes(result: Any, joint: str | None = None) -> set[str]:
    return {f["code"] for f in result["findings"] if joint is None or f["joint"] == joint}


def test_ur10_from_inspect_to_report(cli, data_dir: Path) -> None:  # type: ignore[no-untyped-def]
    log = data_dir / "ur10_db3" / "ur10_exciting_trajectory.db3"
    seen = cli("inspect", log, "--json")
    assert seen.code == 0
    assert json.loads(seen.out)["logs"][0]["topics"][0]["count"] == 3441
    urdf = data_dir / "urdf" / "ur10_robot.urdf"
    assert cli("init", log, "--urdf", urdf, "-o", "ur10.toml").code == 0
    assert "GUESS" in Path("ur10.toml").read_text(encoding="utf-8")
    assert cli("fit", log, "-c", "ur10.toml", "-o", "friction.json").code == 0
    fits = load("friction.json")["joints"]
    # Motion of all joints at once above 0.2 rad/s never shows breakaway: no joint gets eq. (11)'s exponential.
    assert {f["model"] for f in fits.values()} <= {
        "coulomb-viscous",
        "stribeck-gauss",  # wrist 2 is driven slowly enough
        "smooth-coulomb-viscous",
        "rbf",  # a curve without meaning of its own, where it predicts other speeds best
    }
    assert all(f["not_identifiable"] for f in fits.values() if f["model"] == "coulomb-viscous")
    assert {p["source"] for f in fits.values() for p in f["points"]} == {"model"}, "no joint moves alone in this log"
    alone = cli("detect", log, "-c", "ur10.toml", "--friction", "friction.json", "-o", "alone")
    assert alone.code == 3, "nothing but this log says what it looks like without contact"
    assert [text for text in load("alone/audit.json")["reasons"] if "fitted on the judged log alone" not in text] == []
    allow = ("--set", 'policy.same_log="allow"')
    judged = cli("detect", log, "-c", "ur10.toml", "--friction", "friction.json", "-o", "run", *allow)
    assert judged.code == 0
    result = load("run/audit.json")
    level = {joint: s["mean_abs_nm"] for joint, s in result["residual"].items()}
    assert set(level) == {f"{j}_joint" for j in UR_JOINTS}
    # The model explains torques of up to 143 N·m to within a few N·m; a wrong sign, unit or joint order would not.
    # (mean |effort| is 50 N·m on the lift joint, 20 on the elbow; nothing is known of what the arm carried).
    limits = {"shoulder_lift_joint": 8.0, "elbow_joint": 5.0}
    assert all(value < limits.get(joint, 3.0) for joint, value in level.items()), level
    # Thresholds are the fit's: what scatters by more than 4 N·m on the lift joint is no contact.
    assert judged.code == 0 and result["exclusions"]
    guessed = cli(
        "detect", log, "-c", "ur10.toml", "--friction", "friction.json", "-o", "guess", "--set", "detect.gamma_nm=4"
    )
    assert guessed.code == 1
    assert "gamma-too-tight" in codes(load("guess/audit.json"), "shoulder_lift_joint")
    assert cli("report", "run", "-o", "report.html").code == 0
    page = Path("report.html").read_text(encoding="utf-8")
    assert "shoulder_lift_joint" in page


def test_ur3_inverted_effort_is_noticed_and_never_flipped(cli, data_dir: Path) -> None:  # type: ignore[no-untyped-def]
    log = data_dir / "ur3_bags" / "id1.bag"
    cfg = config(data_dir, "ur3_robot.urdf", UR3_NAMES)
    seen = cli("inspect", log, "-c", cfg, "--json")
    inverted = {f["joint"] for f in json.loads(seen.out)["logs"][0]["findings"] if f["code"] == "effort-sign-inverted"}
    assert {"shoulder_lift_joint", "elbow_joint", "wrist_1_joint"} <= inverted
    assert cli("init", log, "--urdf", data_dir / "urdf" / "ur3_robot.urdf", "-o", "guess.toml").code == 3
    guess = Path("guess.toml").read_text(encoding="utf-8")
    assert "runs against the model" in guess
    assert not any(line.startswith("effort_sign") for line in guess.splitlines()), "a sign must never be set silently"
    judged = cli("detect", log, "-c", cfg, "-o", "run")
    result = load("run/audit.json")
    assert judged.code == 3
    assert result["verdict"] == "not_judged"
    assert all(result["residual"][j]["judged_s"] == 0 for j in inverted)


def test_ur3_names_and_signs_by_config(  # type: ignore[no-untyped-def]
    cli, data_dir: Path
) -> None:
    logs = [data_dir / "ur3_bags" / name for name in ("id1.bag", "id2.bag")]
    cfg = config(data_dir, "ur3_robot.urdf", UR3_NAMES + INVERTED)
    assert cli("fit", *logs, "-c", cfg, "-o", "friction.json").code == 0
    fits = load("friction.json")["joints"]
    assert set(fits) == {f"{j}_joint" for j in UR_JOINTS}
    assert all(f["model"] for f in fits.values())
    # Sliding friction opposes motion: with the right sign every curve is positive where it was measured.
    for joint, fit in fits.items():
        values = {key.partition("_")[0]: value for key, value in fit["parameters"].items()}
        speeds = np.array(fit["speed_range_rad_s"])
        assert np.all(LAWS[fit["model"]].curve(values, speeds) > 0), joint
    cli("detect", logs[0], "-c", cfg, "--friction", "friction.json", "-o", "run")
    result = load("run/audit.json")
    assert len([f for f in result["findings"] if f["code"] == "friction-same-log"]) == 1
    assert result["residual"]["wrist_3_joint"]["mean_abs_nm"] < 1.0


def test_ur3_bag_and_its_mcaps_are_one_log(cli, data_dir: Path) -> None:  # type: ignore[no-untyped-def]
    """To the last bit, so their audits are, too."""
    settings = load_config(Path(config(data_dir, "ur3_robot.urdf", UR3_NAMES + INVERTED)))
    bag = open_log(data_dir / "ur3_bags" / "id1.bag", settings)
    assert bag.source.format == "ros1-bag"
    for form, log in {
        "mcap-ros2 folder": data_dir / "ur3_mcap_ros2",
        "mcap-ros2": data_dir / "ur3_mcap_ros2" / "ur3_id1_rosbag2_mcap.mcap",
        "mcap-ros1": data_dir / "ur3_mcap_ros1" / "ur3_id1_ros1profile.mcap",
    }.items():
        found = open_log(log, settings)
        assert found.source.format == form.split()[0]
        for name in ("time_s", "position_rad", "velocity_rad_s", "effort", "joint_names", "effort_unit", "findings"):
            np.testing.assert_equal(getattr(found, name), getattr(bag, name), err_msg=f"{form}: {name}")


def test_kuka_bag_and_its_mcap_give_the_same_audit(cli, data_dir: Path) -> None:  # type: ignore[no-untyped-def]
    Path("kuka.toml").write_text("[detect]\ngamma_nm = 4.0\n", encoding="utf-8")
    audits = []
    for name, log in (("bag", data_dir / "kuka_lwr_bag" / "test.bag"), ("mcap", data_dir / "kuka_mcap_ros2")):
        assert cli("detect", log, "-c", "kuka.toml", "-o", name).code == 3
        audits.append(load(f"{name}/audit.json"))
        own = audits[-1]["log"].pop("name")
        for key in ("sha256", "format"):
            audits[-1]["log"].pop(key)
        audits[-1] = json.loads(json.dumps(audits[-1], ensure_ascii=False).replace(own, "LOG"))
    assert audits[0] == audits[1]
    assert audits[0]["verdict"] == "not_judged"
    assert "model-approximate" in codes(audits[0])


def test_panda_wrists_are_judged_at_30_hz(cli, data_dir: Path) -> None:  # type: ignore[no-untyped-def]
    names = "[log.joint_names]\n" + "".join(f'fer_joint{i} = "panda_joint{i}"\n' for i in range(1, 8))
    cfg = config(data_dir, "panda.urdf", names)
    log = data_dir / "panda_db3" / "panda_exciting_trajectory.db3"
    cli("detect", log, "-c", cfg, "-o", "run")
    result = load("run/audit.json")
    assert result["rule"]["n"] == 1
    assert result["residual"]["panda_joint7"]["mean_abs_nm"] < 0.3


def test_tables_without_time_ask_for_the_rate_and_are_then_read(cli, data_dir: Path) -> None:  # type: ignore[no-untyped-def]
    lbr = [data_dir / "lbr_csv" / "measurements.csv"]
    tx40 = sorted((data_dir / "tx40_csv").glob("*.csv"))
    for logs, rate, joints in ((lbr, 100.0, 7), (tx40, 5000.0, 6)):
        refused = cli("inspect", *logs)
        assert refused.code == 3
        assert "rate_hz = 1000.0" in refused.out
        Path("rate.toml").write_text(f"[log.csv]\nrate_hz = {rate}\n", encoding="utf-8")
        seen = cli("inspect", *logs, "-c", "rate.toml", "--json")
        assert seen.code == 0
        (log,) = json.loads(seen.out)["logs"]
        assert log["topics"][0]["rate_hz"] == pytest.approx(rate)
        roles = [column["role"] for column in log["columns"]]
        assert roles.count("position") == joints


def test_tiago_csvs_are_one_log_in_an_unknown_unit(cli, data_dir: Path) -> None:  # type: ignore[no-untyped-def]
    parts = sorted((data_dir / "tiago_csv").glob("*.csv"))
    columns = '[log.csv]\ntime = "t"\n' + "".join(
        f'{q} = "- {{joint}}_{q}"\n' for q in ("position", "velocity", "effort")
    )
    cfg = config(data_dir, "tiago_no_hand.urdf", columns + '[log.units]\neffort = "raw"\n')
    fitted = cli("fit", *parts, "-c", cfg, "-o", "friction.json")
    assert fitted.code == 0
    file = load("friction.json")
    in_torque = {joint for joint, f in file["joints"].items() if f["effort_unit"] == "N·m"}
    assert in_torque == {"arm_2_joint", "arm_3_joint", "arm_4_joint"}, "those that gravity loads"
    assert {f["effort_unit"] for joint, f in file["joints"].items() if joint not in in_torque} == {"raw"}
    assert set(file["joints"]["arm_1_joint"]["parameters"]) == {"A_raw", "D_raw_s_per_rad"}
    assert set(file["joints"]["torso_lift_joint"]["parameters"]) == {"A_raw", "D_raw_s_per_m"}
    assert "effort-kind" in codes(file)
    inverted = {f["joint"] for f in file["findings"] if f["code"] == "effort-sign-inverted"}
    assert {"arm_3_joint", "arm_4_joint"} <= inverted
    judged = cli("detect", *parts, "-c", cfg, "-o", "run")
    assert judged.code == 3
    assert load("run/audit.json")["verdict"] == "not_judged"


@pytest.mark.parametrize(
    "log",
    ["not_a_robot_log_db3", "not_a_robot_log_db3/validation_trajectory.db3", "ur3_cobotops_csv/dataset_02052023.csv"],
)
@pytest.mark.parametrize("command", ["fit", "detect", "audit"])
def test_what_is_no_robot_log_is_refused(cli, data_dir: Path, log: str, command: str) -> None:  # type: ignore[no-untyped-def]
    outcome = cli(command, data_dir / log, "-o", "out")
    assert outcome.code == 3
    assert "found:" in outcome.err
    assert "expected:" in outcome.err
    if command != "audit":
        assert not Path("out").exists(), "no half-written output"


def test_a_truncated_bag_is_never_clean(cli, data_dir: Path) -> None:  # type: ignore[no-untyped-def]
    whole = (data_dir / "ur3_bags" / "id1.bag").read_bytes()
    Path("cut.bag").write_bytes(whole[: len(whole) * 2 // 3])
    settings = load_config(Path(config(data_dir, "ur3_robot.urdf", UR3_NAMES + INVERTED)))
    said = [f for f in open_log(Path("cut.bag"), settings).findings if f.code == "log-partial"]
    assert any(f.forbids_pass for f in said)
