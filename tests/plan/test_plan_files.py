"""The command and its files: every file is a proposal, the formats hold one and the same motion."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("ruckig")

import jsonschema
import plan_sampler as sampler
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from ruamel.yaml import YAML

from collaudit.cli.main import run

ARM = """
[robot]
dh_convention = "standard"
dh = [
  { d = 0.3, alpha = 1.5707963267948966, mass_kg = 4.0, com_m = [0, -0.1, 0], inertia_kg_m2 = [0.03, 0.02, 0.03, 0, 0, 0] },
  { a = 0.4, mass_kg = 4.0, com_m = [-0.2, 0, 0], inertia_kg_m2 = [0.01, 0.06, 0.06, 0, 0, 0] },
]
[log.joint_names]
"Axis 1" = "joint1"
[plan]
start_rad = { joint2 = 1.2 }
position_rad = { joint1 = [-2.0, 2.0], joint2 = [-0.5, 2.5] }
speed_rad_s = { joint1 = 1.5, joint2 = 1.2 }
torque_nm = { joint1 = 60.0, joint2 = 60.0 }
"""  # noqa: E501
SCHEMAS = Path(__file__).resolve().parents[2] / "docs" / "schemas"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("plan")
    (folder / "arm.toml").write_text(ARM)
    assert run(["plan", "-c", str(folder / "arm.toml"), "-o", str(folder / "plan"), "--minutes", "0.6"]) == 0
    return folder / "plan"


def test_every_file_says_that_it_is_a_proposal(made: Path) -> None:
    texts = {path.name: path.read_text(encoding="utf-8") for path in made.iterdir() if path.suffix != ".mcap"}
    assert set(texts) == {"plan.json", "plan.html", "plan.txt", "motion.csv", "trajectory.yaml"}
    with (made / "trajectory.mcap").open("rb") as file:
        (facts,) = make_reader(file).iter_metadata()
    for text in (*texts.values(), facts.metadata["statement"]):
        words = " ".join(text.split())
        assert "proposal" in words and "person must check it on the robot" in words and "slowly first" in words


def test_all_formats_hold_the_same_motion(made: Path) -> None:
    t, q, _, names = sampler.read_motion((made / "motion.csv").read_text(encoding="utf-8"))
    assert names == ["Axis 1", "joint2"]  # as the controller calls them
    with (made / "trajectory.mcap").open("rb") as file:
        (entry,) = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
    message = entry.decoded_message
    written = YAML(typ="safe").load((made / "trajectory.yaml").read_text(encoding="utf-8"))
    assert list(message.joint_names) == written["joint_names"] == names
    knots = [p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec for p in message.points]
    for points in (
        [(list(p.positions), list(p.velocities)) for p in message.points],
        [(p["positions"], p["velocities"]) for p in written["points"]],
    ):
        q1, v1 = (np.array(part) for part in zip(*points, strict=True))
        at = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(knots) - 2)
        h, s = np.diff(knots)[at][:, None], (t - np.array(knots)[at])[:, None]
        way = (q1[at + 1] - q1[at]) / h
        cubic = s * (
            v1[at] + s * ((3 * way - 2 * v1[at] - v1[at + 1]) / h + s * (v1[at] + v1[at + 1] - 2 * way) / h**2)
        )
        assert np.abs(q1[at] + cubic - q).max() < 1e-6


def test_plan_json_fits_its_schema(made: Path) -> None:
    document = json.loads((made / "plan.json").read_text(encoding="utf-8"))
    schema = json.loads((SCHEMAS / "plan-1.schema.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(schema).validate(document)
    assert document["duration_s"] <= 36.0
    assert any("acceleration" in words for words in document["assumed"])  # a limit that nobody stated is said


def test_the_page_has_no_script_and_shows_the_motion(made: Path) -> None:
    page = (made / "plan.html").read_text(encoding="utf-8")
    assert "<script" not in page and "script-src 'none'" in page
    assert page.count("<animate ") == 2
    for title in ("Sweeps", "What it should tell", "Clean hours", "Limits", "Taken for granted"):
        assert title in page


def test_six_joints_get_a_script_that_ends_where_the_arm_is_not_at_the_start(tmp_path: Path, data_dir: Path) -> None:
    start = "{ shoulder_lift_joint = -1.5, elbow_joint = 1.2, wrist_2_joint = 1.0 }"
    text = f'[robot]\nurdf = "{data_dir}/urdf/ur10_robot.urdf"\n[plan]\nstart_rad = {start}\n'
    (tmp_path / "ur.toml").write_text(text)
    assert run(["plan", "-c", str(tmp_path / "ur.toml"), "-o", str(tmp_path / "plan"), "--minutes", "0.3"]) == 0
    script = (tmp_path / "plan" / "motion.script").read_text(encoding="utf-8")
    assert script.index("halt") < script.index("  movej(")
    assert "proposal" in script.splitlines()[0]
    speeds = [float(line.split("v=")[1].rstrip(")")) for line in script.splitlines() if "v=" in line]
    assert min(speeds) > 0.0
    assert max(speeds) <= 3.2


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere.json"], "nowhere.json"),
        (["--joints", "joint7"], "no such joint"),
    ],
)
def test_bad_input_is_said_and_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    (tmp_path / "arm.toml").write_text(ARM)
    assert run(["plan", *arguments, "-c", str(tmp_path / "arm.toml"), "-o", str(tmp_path / "plan")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "plan").exists()
