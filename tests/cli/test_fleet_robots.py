"""Each log of a fleet is judged with the settings of its own robot; a log of no robot is not judged."""

from __future__ import annotations

import io
import json
import shutil
from pathlib import Path

import pytest
from camera_log import write_camera_log

from collaudit.cli.batch.log_jobs import LogTraits, robot_settings, robots_of
from collaudit.core.config import load_config, parse_config
from collaudit.core.config.schema import FleetRobot
from collaudit.core.contacts.contact_states import matches, program_of, runs_program
from collaudit.core.errors import NotJudgedError

FLEET = """
[fleet.robots.left]
paths = ["left/*"]
friction = "{friction}"
gamma_nm = 4.0
[fleet.robots.right]
paths = ["right/*"]
friction = "{friction}"
gamma_nm = {{ joint1 = 25.0, joint2 = 4.0 }}
"""


def _fleet(folder: Path, arm, text: str = FLEET) -> Path:
    """A fleet of two arms; each pushed by 12 N·m in one log, which 25 N·m allows."""
    for side in ("left", "right"):
        (folder / "logs" / side).mkdir(parents=True)
        shutil.copyfile(arm.pushed, folder / "logs" / side / "night.csv")
    config = folder / "collaudit.toml"
    config.write_text(f"{arm.config.read_text()}\n{text.format(friction=arm.friction)}", encoding="utf-8")
    return config


def _logs(out: Path) -> dict[str, dict[str, object]]:
    return {entry["name"]: entry for entry in json.loads((out / "summary.json").read_text())["logs"]}


def test_each_robot_has_its_own_threshold(arm, collaudit, tmp_path: Path) -> None:
    config = _fleet(tmp_path, arm)
    run = collaudit("audit", tmp_path / "logs", "-c", config, "-o", tmp_path / "out")
    assert run.code == 1, run.err
    logs = {entry["robot"]: entry for entry in _logs(tmp_path / "out").values()}
    assert logs["left"]["verdict"] == "fail" and logs["left"]["contacts"] == 1
    assert logs["right"]["contacts"] == 0
    rules = [json.loads(path.read_text())["rule"]["gamma_nm"] for path in sorted(tmp_path.glob("out/*/audit.json"))]
    assert {rule["joint1"] for rule in rules} == {4.0, 25.0}


def test_flags_win_over_a_robots_own_settings(arm, collaudit, tmp_path: Path) -> None:
    config = _fleet(tmp_path, arm)
    assert (
        collaudit("audit", tmp_path / "logs", "-c", config, "-o", tmp_path / "out", "--set", "detect.gamma_nm=4").code
        == 1
    )
    assert {entry["contacts"] for entry in _logs(tmp_path / "out").values()} == {1}


def test_a_log_of_no_robot_or_of_two_is_not_judged(arm, collaudit, tmp_path: Path) -> None:
    config = _fleet(tmp_path, arm, FLEET + '[fleet.robots.both]\njoints = ["joint1", "joint2"]\npaths = ["right/*"]\n')
    shutil.copyfile(arm.clean, tmp_path / "logs" / "stray.csv")
    run = collaudit("audit", tmp_path / "logs", "-c", config, "-o", tmp_path / "out", "--set", "detect.gamma_nm=15")
    assert run.code == 3, run.err
    assert "no robot of the fleet" in run.err and "both, right" in run.err.replace("right, both", "both, right")
    verdicts = {name.rpartition("logs/")[2]: entry["verdict"] for name, entry in _logs(tmp_path / "out").items()}
    assert verdicts["stray.csv"] == verdicts["right/night.csv"] == "not_judged" != verdicts["left/night.csv"]


def test_joints_and_paths_tell_robots_apart(arm, collaudit, tmp_path: Path) -> None:
    text = '[fleet.robots.a]\npaths = ["left/*"]\n[fleet.robots.b]\npaths = ["right/*"]\njoints = ["joint2"]\n'
    config = _fleet(tmp_path, arm, text)
    collaudit("audit", tmp_path / "logs", "-c", config, "--friction", arm.friction, "-o", tmp_path / "out")
    robots = {name: entry["robot"] for name, entry in _logs(tmp_path / "out").items()}
    assert robots == {"a/logs/left/night.csv": "a", "b/logs/right/night.csv": "b"}


def test_each_rule_and_all_of_a_robots_rules_tell_whose_a_log_is(arm, tmp_path: Path) -> None:
    """Topics and joints of a real MCAP; several rules of one robot must all hold; two robots are refused."""
    table = tmp_path / "table.csv"
    table.write_text("".join(arm.clean.read_text().splitlines(keepends=True)[:20]))
    log = tmp_path / "cell1" / "night.mcap"
    log.parent.mkdir()
    write_camera_log(log, table, images=1)
    loaded = parse_config("", None)
    traits = LogTraits(log.as_posix(), lambda: (log,), loaded)
    assert traits.topics == {"/joint_states", "/camera"} and traits.joints == {"joint1", "joint2"}

    def whose(*rules: dict[str, object]) -> list[str]:
        return robots_of(traits, {f"r{k}": FleetRobot.of(rule) for k, rule in enumerate(rules, 1)})

    other = {"paths": ["cell2/*"]}
    for rule in (
        {"topics": ["/camera"]},
        {"joints": ["joint2"]},
        {"paths": ["cell1/*"], "topics": ["/left/joint_states", "/joint_states"]},
    ):
        assert whose(other, rule) == ["r2"]
    for rule in (
        {"topics": ["/joint"]},
        {"joints": ["joint2", "joint3"]},
        {"paths": ["cell1/*"], "topics": ["/joint"]},
    ):
        with pytest.raises(NotJudgedError, match="no robot of the fleet"):
            whose(other, rule)
    with pytest.raises(NotJudgedError, match="several robots") as caught:
        whose({"topics": ["/camera"]}, {"joints": ["joint1"]}, other)
    assert caught.value.found == "r1, r2"
    assert whose({"joints": ["joint2"]}, {"joints": ["joint1"]}, other) == ["r1", "r2"]
    assert whose({"topics": ["/joint_states"]}, {"topics": ["/camera"]}, other) == ["r1", "r2"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[fleet.robots.a]\nconfig = 'x'\n", "no rule tells which logs"),
        ("[fleet.robots.a]\npaths = ['x']\nconfig = 'own.toml'\n", "common to the fleet"),
        ("[fleet.robots.a]\npath = ['x']\n", "did you mean paths?"),
    ],
)
def test_a_fleet_that_cannot_be_meant(text: str, said: str, arm, collaudit, tmp_path: Path) -> None:
    config = _fleet(tmp_path, arm, text)
    (tmp_path / "own.toml").write_text("[fleet.robots.b]\npaths = ['y']\n")
    run = collaudit("audit", tmp_path / "logs", "-c", config, "-o", tmp_path / "out")
    assert run.code == 2 and said in run.err, run.err


def test_a_list_on_stdin(arm, collaudit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = ("-c", arm.config, "--friction", arm.friction)
    monkeypatch.setattr("sys.stdin", io.StringIO(f"{arm.clean}\n\n{arm.pushed}\n"))
    assert collaudit("audit", "-", *settings, "-o", tmp_path / "out").code == 1
    assert {Path(name).name for name in _logs(tmp_path / "out")} == {"clean.csv", "pushed.csv"}
    monkeypatch.setattr("sys.stdin", io.StringIO("\n"))
    run = collaudit("audit", "-", *settings, "-o", tmp_path / "none")
    assert run.code == 2 and "nothing would be judged" in run.err


def test_what_is_not_there_is_not_judged_and_an_error_where_it_is_all(arm, collaudit, tmp_path: Path) -> None:
    command = ("-c", arm.config, "--friction", arm.friction, "-o")
    assert collaudit("audit", tmp_path / "gone.mcap", *command, tmp_path / "stopped").code == 2
    assert not (tmp_path / "stopped").exists()
    run = collaudit("audit", arm.clean, tmp_path / "gone.mcap", *command, tmp_path / "out")
    assert run.code == 3
    verdicts = {Path(name).name: entry["verdict"] for name, entry in _logs(tmp_path / "out").items()}
    assert verdicts == {"clean.csv": "pass", "gone.mcap": "not_judged"}


def test_patterns_begin_at_a_folder() -> None:
    assert matches("logs/cell1/a/b.mcap", ["cell1/*"]) and matches("s3://bucket/cell1/a.mcap", ["s3://bucket/*"])
    assert not matches("logs/xcell1/a.mcap", ["cell1/*"]) and not matches("cell1/a.mcap", [])


def test_a_program_is_a_name_without_dates_and_times() -> None:
    assert program_of("cell1/pick_2026-11-28_031502.mcap") == "cell1/pick_#.mcap"
    assert program_of("a/2026-11-28-03-15-02.bag") == program_of("a/2026-12-01-04-00-00.bag") == "a/#.bag"
    assert program_of("run2.csv") == "run2.csv" != program_of("run3.csv")
    assert runs_program("a/#.bag", "A/a/20261128.bag", "night/a/20261128.bag")
    assert not runs_program("#.bag", "A/a/pick_20261128.bag", "a/pick_20261128.bag")


def test_a_robots_own_file_states_what_differs_in_its_policy(tmp_path: Path) -> None:
    (tmp_path / "lab.toml").write_text("[policy]\nmax_collisions = 3\n")
    text = "[policy]\nmax_near_misses_per_hour = 5\n[fleet.robots.lab]\npaths = ['lab/*']\nconfig = 'lab.toml'\n"
    (tmp_path / "night.toml").write_text(text + "[fleet.robots.hall]\npaths = ['hall/*']\n")
    common = load_config(tmp_path / "night.toml")
    settings = robot_settings(common, {}, common.config.fleet.robots)
    policies = {name: one.config.policy for name, one in settings.items()}
    assert {name: (p.max_collisions, p.max_near_misses_per_hour) for name, p in policies.items()} == {
        "lab": (3, 5.0),
        "hall": (0, 5.0),
    }
