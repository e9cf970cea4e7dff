"""One name for each log, in every file of a night: read back as the systems do that know a log by what they read."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from xml.etree import ElementTree

import pytest

from collaudit.cli.batch.log_inputs import log_identities, run_folders
from collaudit.core.errors import ConfigError
from collaudit.reports.files.run_files import friction_of_run

FLEET = """
[fleet.robots.A]
paths = ["A/*"]
[fleet.robots.B]
paths = ["B/*"]
"""


def _names(*arguments: str, logs: list[str], robots: list[str | None] | None = None) -> list[str]:
    return log_identities(arguments, [(Path(log),) for log in logs], robots or [None] * len(logs))


def test_a_name_is_robot_folders_and_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for log in ("n/2026-01-01/cell1/run1.mcap", "n/2026-01-01/cell2/run1.mcap"):
        Path(log).parent.mkdir(parents=True)
        Path(log).touch()
    logs = ["n/2026-01-01/cell1/run1.mcap", "n/2026-01-01/cell2/run1.mcap"]
    below = ["cell1/run1.mcap", "cell2/run1.mcap"]
    assert _names("n/2026-01-01", logs=logs) == below
    assert _names("run1.mcap", logs=["run1.mcap"]) == ["run1.mcap"], "the working folder is named by nobody"
    assert _names("n/2026-01-01/*/*.mcap", logs=logs) == below
    assert _names(*logs, logs=logs) == below
    assert _names("n/2026-01-01/cell1", "n/2026-01-01/cell2", logs=logs) == below
    assert _names("n/2026-01-01", logs=logs, robots=["A", "cell2"]) == ["A/cell1/run1.mcap", "cell2/run1.mcap"]
    urls = ["s3://logs/n/cell1/run1.mcap", "s3://logs/n/cell2/run1.mcap"]
    assert _names("s3://logs/n/", logs=urls) == below


def test_a_name_does_not_change_with_the_other_logs_of_the_night(tmp_path: Path) -> None:
    logs = [str(tmp_path / cell / "run1.mcap") for cell in ("cell1", "cell2", "cell3")]
    for log in logs:
        Path(log).parent.mkdir()
        Path(log).touch()
    every = _names(*logs, logs=logs)
    assert [_names(log, logs=[log])[0] for log in logs] == every
    assert _names(str(tmp_path), logs=logs[:1]) == every[:1]


ROOTS = {
    "stated": ("/data/nights", None, None),
    "of the robot": (None, None, "A"),
    "of the configuration": (None, "/data", None),
    "of a date": (None, None, None),
}


@pytest.mark.parametrize("root", ROOTS)
def test_a_name_does_not_depend_on_the_arguments(root: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stated, beside, robot = (None if one is None else one.replace("/data", str(tmp_path)) for one in ROOTS[root])
    night = tmp_path / "nights" / "2026-11-22"
    logs = [night / "A" / cell / "run1.mcap" for cell in ("cell1", "cell2")]
    for log in logs:
        log.parent.mkdir(parents=True)
        log.touch()
    below = {path: Path(stated) if stated else None for path in logs}

    def names(*arguments: str | Path, of: list[Path]) -> list[str]:
        files = [(Path(os.path.relpath(log)),) for log in of]
        given = [str(one) for one in arguments]
        return log_identities(given, files, [robot] * len(of), below[of[0]], Path(beside) if beside else None)

    start = "nights/A" if root == "of the configuration" else "A"
    expected = [f"{start}/cell1/run1.mcap", f"{start}/cell2/run1.mcap"]
    for folder in (tmp_path, tmp_path / "nights", night, night / "A"):
        monkeypatch.chdir(folder)
        assert names(folder, of=logs) == names(f"{folder}/*", of=logs) == names(*logs, of=logs) == expected
        assert names(".", of=logs) == expected
    monkeypatch.chdir(logs[0].parent)
    assert names("run1.mcap", of=logs[:1]) == names(".", of=logs[:1]) == expected[:1]


def test_nights_that_are_audited_together_keep_their_dates_where_they_must() -> None:
    logs = [
        "/n/2026-11-21/cell1/a.mcap",
        "/n/2026-11-22/cell1/a.mcap",
        "/n/2026/11/22/b.mcap",
        "/n/20261122T0315/c.mcap",
    ]
    assert _names("/n", logs=logs) == ["2026-11-21/cell1/a.mcap", "2026-11-22/cell1/a.mcap", "b.mcap", "c.mcap"]
    assert _names("/n", logs=["/n/2026-13-21/a.mcap"]) == ["2026-13-21/a.mcap"], "no date"


def test_a_log_outside_the_root_is_refused() -> None:
    with pytest.raises(ConfigError, match="not below the root"):
        log_identities(["/x/a.mcap"], [(Path("/x/a.mcap"),)], [None], Path("/y"))


def test_names_and_folders_are_unique_whatever_the_paths() -> None:
    logs = ["/x/a/c/run.mcap", "/y/a/c/run.mcap", "/y/a_c/run.mcap", "/y/a/c/run.bag", "/y/A/c/run.mcap"]
    logs += ["/z/../y/a/c/run.mcap", "/z/assets", "/z/a/.mcap", "/z/a/\udcff.mcap"]
    names = _names(*logs, logs=logs)
    folders = run_folders(names, [(Path(log),) for log in logs])
    assert len(set(names)) == len({folder.lower() for folder in folders}) == len(logs)
    assert names[:3] == ["x/a/c/run.mcap", "y/a/c/run.mcap", "a_c/run.mcap"]
    assert "assets" not in folders and not any("/" in folder for folder in folders)


@pytest.fixture(scope="module")
def night(arm, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, int]:
    """OUT of eight logs of two robots that have two names, half of them pushed, and how many fail."""
    from collaudit.cli.main import run

    folder = tmp_path_factory.mktemp("night")
    for robot in "AB":
        for cell in ("cell1", "cell2"):
            place = folder / "logs" / robot / cell
            place.mkdir(parents=True)
            shutil.copyfile(arm.clean, place / "run1.csv")
            shutil.copyfile(arm.pushed, place / "run2.csv")
    config = folder / "collaudit.toml"
    config.write_text(arm.config.read_text() + FLEET, encoding="utf-8")
    command = ["audit", str(folder / "logs"), "-c", str(config), "--friction", str(arm.friction)]
    assert run([*command, "-o", str(folder / "out"), "--format", "junit,sarif,markdown,github"]) == 1
    return folder / "out", 4


def test_every_log_is_one_case_to_jenkins_gitlab_and_github(night: tuple[Path, int]) -> None:
    out, failed = night
    suites = ElementTree.parse(out / "summary.xml").getroot()
    cases = [(suite.get("name"), case.get("classname"), case) for suite in suites for case in suite.iter("testcase")]
    jenkins = {(suite, of, case.get("name")) for suite, of, case in cases}
    gitlab = {f"{of}_{case.get('name')}" for _, of, case in cases}  # also where suites are merged
    assert len(cases) == len(jenkins) == len(gitlab) == 8
    assert sum(case.find("failure") is not None for *_, case in cases) == failed
    results = json.loads((out / "summary.sarif").read_text())["runs"][0]["results"]
    prints = [one["partialFingerprints"]["primaryLocationLineHash"] for one in results]
    assert len(set(prints)) == len(prints)
    named = [one["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] for one in results]
    assert {name.partition("/")[2] for name in named} == {"cell1/run2.csv", "cell2/run2.csv"}
    assert len(set(named)) == failed and {one["ruleId"] for one in results} == {"policy-broken", "contact"}
    assert len([line for line in (out / "summary.txt").read_text().splitlines() if "title=PASS" in line]) == 4


def test_the_same_name_stands_in_every_file(night: tuple[Path, int]) -> None:
    out, _ = night
    names = {f"{robot}/cell{cell}/run{run}.csv" for robot in "AB" for cell in (1, 2) for run in (1, 2)}
    summary = json.loads((out / "summary.json").read_text())
    assert {log["name"] for log in summary["logs"]} == names
    for log in summary["logs"]:
        folder = log["name"].removesuffix(".csv").replace("/", "_")
        assert log["report"] == f"{folder}/report.html"
        assert json.loads((out / folder / "audit.json").read_text())["log"]["name"] == log["name"]
    assert {case.get("name") for case in ElementTree.parse(out / "summary.xml").iter("testcase")} == names
    page = (out / "index.html").read_text()
    for name in names:
        robot, _, place = name.partition("/")  # in columns of their own
        assert (
            page.count(f"<bdi>{place}</bdi>") == 2
            and f"{robot}_{place.removesuffix('.csv').replace('/', '_')}/" in page
        )


def test_fingerprints_are_those_of_the_night_before(night: tuple[Path, int], arm, tmp_path: Path) -> None:
    """The same contacts by another threshold: other values in the messages, the same results."""
    from collaudit.cli.main import run

    out, _ = night
    command = [
        "audit",
        str(out.parent / "logs"),
        "-c",
        str(out.parent / "collaudit.toml"),
        "--friction",
        str(arm.friction),
    ]
    assert run([*command, "-o", str(tmp_path / "out"), "--set", "detect.gamma_nm=3.9", "--format", "sarif"]) == 1

    def prints(folder: Path) -> set[str]:
        results = json.loads((folder / "summary.sarif").read_text())["runs"][0]["results"]
        return {one["partialFingerprints"]["primaryLocationLineHash"] for one in results}

    assert prints(tmp_path / "out") == prints(out)


def test_a_friction_file_stands_once_in_an_audit(night: tuple[Path, int], arm) -> None:
    out, _ = night
    (kept,) = (out / "friction").iterdir()
    assert kept.read_bytes() == arm.friction.read_bytes() and not list(out.glob("*/friction.json"))
    runs = list(out.glob("*/audit.json"))
    assert len(runs) == 8
    assert {json.loads(run.read_text())["provenance"]["friction_sha256"] for run in runs} == {kept.stem}
    assert f"{kept.stem}  friction/{kept.name}" in (out / "SHA256SUMS").read_text()
    assert {friction_of_run(run.parent) for run in runs} == {kept.absolute()}, "which plan RUN starts from"


def test_out_holds_this_audit_only(arm, collaudit, tmp_path: Path) -> None:
    logs, out = tmp_path / "logs", tmp_path / "out"
    logs.mkdir()
    for name in ("a", "b", "c"):
        os.link(arm.clean, logs / f"{name}.csv")
    settings = ("-c", arm.config, "--friction", arm.friction, "-o", out)
    assert collaudit("audit", logs, *settings).code == 0
    (out / "b" / "mine.txt").write_text("a note of mine")
    old = out / "assets" / "uplot-0123456789ab.js"
    old.write_text("of an earlier version")
    (out / "AUDIT-UNDER-WAY.txt").write_text('{"host": "elsewhere", "process": 1, "runs": ["ended", "../logs"]}')
    (out / "ended").mkdir()
    (out / "ended" / "audit.json").write_text("half of it")
    assert collaudit("audit", logs / "a.csv", *settings).code == 0
    (run,) = (path.parent for path in out.glob("*/audit.json"))
    assert run.name == "logs_a" and not old.exists() and not (out / "ended").exists() and len(list(logs.iterdir())) == 3
    assert [path.name for path in (out / "b").iterdir()] == ["mine.txt"]
    assert "mine.txt" not in (out / "SHA256SUMS").read_text()
