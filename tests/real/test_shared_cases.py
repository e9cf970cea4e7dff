"""Logs written after public reports, each with its right value, by ``inspect`` and ``detect`` alike."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

pytestmark = pytest.mark.real

#: Log, settings, exit code of ``detect``, contacts; None where nothing is judged.
CASES: dict[str, tuple[str, str, int, int | None]] = {
    "hint_command_topic": ("log.mcap", "c.toml", 1, 5),
    "desired_topic_alone": ("log.mcap", "c.toml", 3, None),
    "effort_noise_only": ("log.mcap", "c.toml", 3, None),
    "effort_uninitialised": ("log.mcap", "c.toml", 3, None),
    "effort_per_mille": ("log.mcap", "c.toml", 3, None),
    "rail_mm": ("log.csv", "stated.toml", 3, None),
    "time_ns_one_run": ("log.csv", "c.toml", 3, None),
    "time_ns_runs": ("log.csv", "c.toml", 3, None),
    "time_us_runs": ("log.csv", "c.toml", 3, None),
    "dynamic_gpio": ("log.mcap", "c.toml", 1, 5),
    "dynamic_gripper_without_effort": ("log.mcap", "c.toml", 1, 5),
    "merged_rows_of_another_sensor": ("log.csv", "c.toml", 1, 5),
    "names_joint_interface": ("log.mcap", "c.toml", 1, 5),
    "efforts_on_a_topic_of_their_own": ("log.mcap", "c.toml", 3, None),
    "unknown_message_type": ("log.mcap", "c.toml", 3, None),
}


@pytest.fixture(scope="module")
def cases(data_dir: Path) -> Path:
    folder = data_dir.parent / "cases"
    if not folder.is_dir():
        pytest.skip(f"cases after public reports absent: {folder}")
    return folder


@pytest.mark.parametrize("name", CASES)
def test_a_case_has_its_right_value(cli, cases: Path, name: str) -> None:  # type: ignore[no-untyped-def]
    log, settings, code, contacts = CASES[name]
    config = ("-c", cases / name / settings)
    found = cli("detect", cases / name / log, *config, "--friction", cases / "friction.json", "-o", "run")
    assert found.code == code, found.err
    if contacts is not None:
        assert len(json.loads(Path("run/audit.json").read_text(encoding="utf-8"))["contacts"]) == contacts
        return
    assert 'try: [log] joint_states = "/joint_command"' not in found.err
    seen = cli("inspect", cases / name / log, *config)
    assert seen.code == 3, "inspect says that no command can read on, or judge it"


def test_what_a_night_left_out_is_named(cli, cases: Path) -> None:  # type: ignore[no-untyped-def]
    shutil.copytree(cases / "folder_of_other_suffixes" / "night", "night")
    config = ("-c", cases / "folder_of_other_suffixes" / "c.toml", "--friction", cases / "friction.json")
    assert cli("audit", "night", *config, "-o", "out").code == 3
    summary = Path("out/summary.json").read_text(encoding="utf-8")
    assert "run2.txt" in summary and "run3.dat" in summary


def test_traces_of_two_axes_are_one_log(cli, cases: Path) -> None:  # type: ignore[no-untyped-def]
    seen = cli("inspect", cases / "kuka_trace_r64", "--json")
    assert seen.code == 0, seen.err
    topic = json.loads(seen.out)["logs"][0]["topics"][0]
    assert (topic["joints"], topic["count"]) == (["joint_a1", "joint_a2"], 5000)
