"""Every kind of bad input: the contracted exit code, one clear message, no traceback, nothing half-written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

Run = Callable[..., object]


def _refused(outcome, code: int, *parts: str) -> None:
    assert outcome.code == code, outcome.err
    assert outcome.out == ""
    assert "Traceback" not in outcome.err
    assert "bug" not in outcome.err
    for part in parts:
        assert part in outcome.err, outcome.err


def _files(folder: Path) -> set[Path]:
    return {path for path in folder.rglob("*") if path.is_file()}


COMMANDS = ("detect", "audit", "fit")


def _output(command: str, folder: Path) -> Path:
    return folder / ("friction.json" if command == "fit" else "out")


@pytest.mark.parametrize("command", COMMANDS)
def test_misspelt_key(command: str, arm, collaudit: Run, tmp_path: Path) -> None:
    config = tmp_path / "c.toml"
    config.write_text(arm.config.read_text().replace("gamma_nm", "gama_nm"))
    before = _files(tmp_path)
    outcome = collaudit(command, arm.clean, "-c", config, "-o", _output(command, tmp_path))
    line = config.read_text().splitlines().index("gama_nm = 4.0") + 1
    _refused(outcome, 2, f"c.toml:{line}:", "did you mean gamma_nm?")
    assert _files(tmp_path) == before


@pytest.mark.parametrize("command", COMMANDS)
def test_missing_configuration(command: str, arm, collaudit: Run, tmp_path: Path) -> None:
    outcome = collaudit(command, arm.clean, "-c", tmp_path / "none.toml", "-o", _output(command, tmp_path))
    _refused(outcome, 2, "none.toml: there is no such configuration file")
    assert not _files(tmp_path)


@pytest.mark.parametrize("command", ["detect", "fit"])
@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [("arm.urdf", "this is not XML", "arm.urdf"), ("arm.urdf", "", "arm.urdf"), ("arm.urdf", "<robot>", "arm.urdf")],
)
def test_urdf_that_is_none(
    command: str, name: str, text: str, expected: str, arm, collaudit: Run, tmp_path: Path
) -> None:
    (tmp_path / name).write_text(text)
    outcome = collaudit(command, arm.clean, "--set", f"robot.urdf={tmp_path / name}", "-o", _output(command, tmp_path))
    _refused(outcome, 2, expected)
    assert not _output(command, tmp_path).exists()


def test_missing_urdf(arm, collaudit: Run, tmp_path: Path) -> None:
    _refused(collaudit("inspect", arm.clean, "--urdf", tmp_path / "none.urdf"), 2, "none.urdf")


def _write(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


_BAD_LOGS = {
    "empty.mcap": b"",
    "empty.csv": b"",
    "text.mcap": b"This is a letter, not a log.\n",
    "text.bag": b"This is a letter, not a log.\n",
    "magic-only.mcap": b"\x89MCAP0\r\n",
    "magic-only.bag": b"#ROSBAG V2.0\n",
    "noise.db3": bytes(range(256)) * 40,
    "sqlite-only.db3": b"SQLite format 3\x00" + bytes(84),
    "words.csv": b"name,colour\nrobot,orange\n",
}


@pytest.mark.parametrize("name", sorted(_BAD_LOGS))
@pytest.mark.parametrize("command", ["detect", "fit", "inspect"])
def test_file_that_is_no_log(command: str, name: str, arm, collaudit: Run, tmp_path: Path) -> None:
    log = _write(tmp_path / name, _BAD_LOGS[name])
    output = () if command == "inspect" else ("-o", _output(command, tmp_path))
    config = () if name == "words.csv" else ("-c", arm.config)
    outcome = collaudit(command, log, *config, *output)
    assert outcome.code == 3, outcome.err
    assert "Traceback" not in outcome.err
    assert name in outcome.err
    assert _files(tmp_path) == {log}


@pytest.mark.parametrize("command", [*COMMANDS, "inspect", "init"])
def test_missing_log(command: str, arm, collaudit: Run, tmp_path: Path) -> None:
    output = () if command == "inspect" else ("-o", _output(command, tmp_path))
    outcome = collaudit(command, tmp_path / "none.mcap", "-c", arm.config, *output)
    _refused(outcome, 2, "none.mcap")
    assert not _files(tmp_path)


def test_folder_without_logs(arm, collaudit: Run, tmp_path: Path) -> None:
    _refused(collaudit("audit", tmp_path, "-c", arm.config, "-o", tmp_path / "out"), 3, str(tmp_path))


@pytest.mark.parametrize("command", ["detect", "fit"])
def test_damaged_friction_or_run(command: str, arm, collaudit: Run, tmp_path: Path) -> None:
    bad = _write(tmp_path / "friction.json", b'{"schema": "collaudit/friction/1"')
    if command == "detect":
        _refused(collaudit("detect", arm.clean, "-c", arm.config, "--friction", bad), 2, "friction.json")
    _refused(
        collaudit("audit", arm.clean, "-c", arm.config, "--friction", bad, "-o", tmp_path / "o"), 2, "friction.json"
    )
    _refused(collaudit("report", tmp_path, "-o", tmp_path / "r.html"), 2, "not a run folder")
    assert not (tmp_path / "r.html").exists()


@pytest.mark.parametrize("command", [*COMMANDS, "init"])
def test_output_below_a_file(command: str, arm, collaudit: Run, tmp_path: Path) -> None:
    blocker = _write(tmp_path / "file", b"kept")
    outcome = collaudit(command, arm.clean, "-c", arm.config, "-o", blocker / "sub" / "out")
    assert outcome.code == 2, outcome.err
    assert "Traceback" not in outcome.err
    assert "bug" not in outcome.err
    assert str(blocker) in outcome.err
    assert blocker.read_bytes() == b"kept"


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a folder where not even root may write")
@pytest.mark.parametrize("command", [*COMMANDS, "init"])
def test_output_in_a_folder_without_permission(command: str, arm, collaudit: Run) -> None:
    outcome = collaudit(command, arm.clean, "-c", arm.config, "-o", "/proc/self/out")
    assert outcome.code == 2, outcome.err
    assert "Traceback" not in outcome.err
    assert "bug" not in outcome.err
    assert "/proc/self" in outcome.err


@pytest.mark.parametrize(
    ("args", "part"),
    [
        ((), "Usage"),
        (("detcet",), "Did you mean 'detect'?"),
        (("detect",), "Missing argument"),
        (("detect", "x.csv", "--set", "detect.gamma_nm=four"), "a number above 0"),
        (("detect", "x.csv", "--set", "detect.gamma_nm=-4"), "a number above 0"),
        (("detect", "x.csv", "--set", "detect.n=2.5"), "a whole number"),
        (
            ("detect", "x.csv", "--set", "detect.n=3", "--set", "detect.persistence_ms=25"),
            "either persistence_ms or n",
        ),
        (("detect", "x.csv", "--set", "detect.gama_nm=4"), "did you mean gamma_nm?"),
        (("detect", "x.csv", "--set", "nonsense"), "KEY=VALUE"),
        (("detect", "x.csv", "--set", "detect.detector=psychic"), '"direct"'),
        (("fit", "x.csv", "--set", "friction.model=cubic"), '"static-lugre"'),
        (("report", "run", "-o", "r.html", "--format", "pdf"), "html"),
        (("audit", "x.csv"), "Missing option"),
    ],
)
def test_usage(args: tuple[str, ...], part: str, collaudit: Run, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    outcome = collaudit(*args)
    assert outcome.code == 2, outcome.err
    assert part in outcome.err + (outcome.out if not args else "")
    assert not _files(tmp_path)


def test_init_replaces_only_when_asked(arm, collaudit: Run, tmp_path: Path) -> None:
    target = _write(tmp_path / "collaudit.toml", b"# mine\n")
    _refused(collaudit("init", arm.clean, "-o", target), 2, "--force")
    assert target.read_bytes() == b"# mine\n"
    assert collaudit("init", arm.clean, "-c", arm.config, "-o", target, "--force").code == 0
    assert target.read_bytes() != b"# mine\n"


def test_no_output_is_an_input(arm, collaudit: Run, tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    log = _write(tmp_path / "logs" / "run.csv", arm.clean.read_bytes())
    config = _write(tmp_path / "c.toml", arm.config.read_bytes())
    run = tmp_path / "run"
    assert collaudit("detect", arm.clean, "-c", arm.config, "--friction", arm.friction, "-o", run).code == 0
    kept = {path: path.read_bytes() for path in (log, config, run / "audit.json", run / "signals.parquet")}
    for command in (
        ("fit", log, "-c", config, "-o", log),
        ("fit", log.parent, "-c", config, "-o", log),
        ("fit", str(log.parent / "*.csv"), "-c", config, "-o", log),
        ("fit", log, "-c", config, "-o", config),
        ("init", log, "-o", log, "--force"),
        ("report", run, "-o", run / "audit.json", "--format", "json"),
        ("detect", run / "signals.parquet", "-c", config, "-o", run),
    ):
        _refused(collaudit(*command), 2, "one of the inputs")
        assert {path: path.read_bytes() for path in kept} == kept
    assert collaudit("report", run, "-o", run / "report.html").code == 0
    assert collaudit("report", run, "-o", run / "report.html").code == 0, "a page may be written again"
