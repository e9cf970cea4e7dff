"""The manifest names every byte that was read and written; ``verify`` sees what changed, and says what it cannot."""

from __future__ import annotations

import json
import re
import shutil
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def audited(arm, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two logs, and the folder of their audit, signed; the keys lie beside it."""
    from minisign import KeyPair

    from collaudit.cli.main import run

    folder = tmp_path_factory.mktemp("audited")
    (folder / "logs").mkdir()
    for name, source in (("a.csv", arm.clean), ("b.csv", arm.pushed)):
        shutil.copyfile(source, folder / "logs" / name)
    pair = KeyPair.generate()
    (folder / "key").write_bytes(bytes(pair.secret_key))
    (folder / "key.pub").write_bytes(bytes(pair.public_key))
    (folder / "other.pub").write_bytes(bytes(KeyPair.generate().public_key))
    command = ["audit", str(folder / "logs"), "-c", str(arm.config), "--friction", str(arm.friction), "--as-of"]
    command += ["2026-06-15", "--format", "junit"]
    assert run([*command, "-o", str(folder / "out"), "--sign", str(folder / "key")]) == 1
    assert run([*command, "-o", str(folder / "two"), "-j", "2"]) == 1
    return folder, folder / "out"


@pytest.fixture
def out(audited: tuple[Path, Path], tmp_path: Path) -> Path:
    """A copy of the audit's folder to spoil."""
    return Path(shutil.copytree(audited[1], tmp_path / "out"))


def test_everything_stands_in_it(audited: tuple[Path, Path], arm) -> None:
    _, out = audited
    manifest = json.loads((out / "manifest.json").read_text())
    written = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert {item["path"] for item in manifest["outputs"]} == written - {"manifest.json", "manifest.json.minisig"}
    read = {(item["role"], Path(item["path"]).name) for item in manifest["inputs"]}
    assert read == {("log", "a.csv"), ("log", "b.csv"), ("configuration", "arm.toml"), ("friction", "friction.json")}
    assert {log["log"]: log["verdict"] for log in manifest["logs"]} == {"a.csv": "pass", "b.csv": "fail"}


def test_reports_share_the_plots_library_which_is_verified(collaudit, out: Path) -> None:
    pages = "".join(path.read_text() for path in out.glob("*/report.html"))
    named = set(re.findall(r'src="\.\./(assets/uplot[^"]*)"', pages))
    (library,) = named
    assert pages.count(library) == 2 and "uPlot" in (out / library).read_text() and "uPlot" not in pages
    (out / library).write_text("alert(1)")
    run = collaudit("verify", out)
    assert run.code == 1 and f"changed  {library}" in run.out


def test_a_log_may_be_called_as_the_folder_of_what_reports_share(collaudit, arm, tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    shutil.copyfile(arm.clean, tmp_path / "logs" / "assets.csv")
    command = ("audit", tmp_path / "logs", "-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "out")
    assert collaudit(*command).code == 0
    assert len(list((tmp_path / "out").glob("assets-*/report.html"))) == 1
    assert collaudit("verify", tmp_path / "out").code == 0


def test_one_worker_or_two_give_the_same_bytes(audited: tuple[Path, Path]) -> None:
    folder, out = audited
    assert (folder / "two" / "manifest.json").read_bytes() == (out / "manifest.json").read_bytes()


def test_what_was_written_is_verified(collaudit, audited: tuple[Path, Path]) -> None:
    folder, out = audited
    run = collaudit("verify", out, "--inputs", "--key", folder / "key.pub")
    assert run.code == 0 and run.out.startswith("AS WRITTEN"), run.out


@pytest.mark.parametrize("name", ["summary.json", "index.html", "policy.json", "a/signals.parquet", "b/audit.json"])
def test_a_changed_byte_or_a_file_that_is_gone(name: str, collaudit, out: Path) -> None:
    content = (out / name).read_bytes()
    (out / name).write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    run = collaudit("verify", out)
    assert run.code == 1 and f"changed  {name}" in run.out
    (out / name).unlink()
    run = collaudit("verify", out, "--json")
    assert run.code == 1 and json.loads(run.out)["counts"] == {"changed": 0, "missing": 1, "added": 0, "unknown": 0}


def test_a_file_that_came_later(collaudit, out: Path) -> None:
    (out / "a" / "note.txt").write_text("all clear")
    run = collaudit("verify", out)
    assert run.code == 1 and "added    a/note.txt" in run.out


def test_inputs_that_changed_or_are_gone(collaudit, arm, tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    shutil.copyfile(arm.clean, log)
    assert collaudit("audit", log, "-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "out").code == 0
    log.write_bytes(log.read_bytes()[:-1])
    assert collaudit("verify", tmp_path / "out").code == 0, "inputs are compared where that is asked for"
    assert collaudit("verify", tmp_path / "out", "--inputs").code == 1
    log.unlink()
    run = collaudit("verify", tmp_path / "out", "--inputs")
    assert run.code == 3 and "NOT ALL COMPARED" in run.out


def test_a_signature_is_of_one_key_and_one_manifest(collaudit, audited: tuple[Path, Path], out: Path) -> None:
    folder, _ = audited
    assert collaudit("verify", out, "--key", folder / "other.pub").code == 1
    manifest = out / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"fail"', '"pass"'))
    run = collaudit("verify", out, "--key", folder / "key.pub")
    assert run.code == 1 and "signature" in run.out
    (out / "manifest.json.minisig").unlink()
    assert collaudit("verify", out, "--key", folder / "key.pub").code == 1


def test_a_manifest_that_points_elsewhere_is_refused(collaudit, out: Path) -> None:
    manifest = out / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"path": "summary.json"', '"path": "../../etc/passwd"'))
    run = collaudit("verify", out)
    assert run.code == 2 and "outside its folder" in run.err


def test_without_the_extra_the_message_names_it(
    collaudit, arm, audited: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "minisign", None)
    run = collaudit("audit", arm.clean, "-c", arm.config, "-o", tmp_path / "out", "--sign", audited[0] / "key")
    assert run.code == 2 and "collaudit[sign]" in run.err and not (tmp_path / "out").exists()


def test_no_manifest_is_an_error(collaudit, tmp_path: Path) -> None:
    assert collaudit("verify", tmp_path).code == 2
