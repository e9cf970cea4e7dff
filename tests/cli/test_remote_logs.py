"""Logs on an S3 server are fetched one at a time, judged as local ones, and leave nothing behind."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def bucket(arm, tmp_path_factory: pytest.TempPathFactory):
    """A bucket of two logs on moto's server."""
    moto = pytest.importorskip("moto.server")
    boto3 = pytest.importorskip("boto3")
    pytest.importorskip("s3fs")
    server = moto.ThreadedMotoServer(port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AWS_ENDPOINT_URL", f"http://{host}:{port}")
        patch.setenv("AWS_ACCESS_KEY_ID", "test")
        patch.setenv("AWS_SECRET_ACCESS_KEY", "test")
        patch.setenv("AWS_DEFAULT_REGION", "us-east-1")
        client = boto3.client("s3")
        client.create_bucket(Bucket="logs")
        for name, source in (("night/clean.csv", arm.clean), ("night/pushed.csv", arm.pushed)):
            client.upload_file(str(source), "logs", name)
        client.put_object(Bucket="logs", Key="night/notes.pdf", Body=b"%PDF")
        yield "s3://logs/night"
    server.stop()


def test_a_folder_on_s3_is_judged_as_a_local_one(bucket: str, arm, collaudit, tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    settings = ("-c", arm.config, "--friction", arm.friction)
    assert collaudit("audit", bucket, *settings, "-o", tmp_path / "out").code == 1
    logs = json.loads((tmp_path / "out" / "summary.json").read_text())["logs"]
    assert {Path(entry["name"]).name: entry["verdict"] for entry in logs} == {"clean.csv": "pass", "pushed.csv": "fail"}
    assert not list((tmp_path / "tmp").iterdir())
    assert collaudit("audit", arm.pushed, *settings, "-o", tmp_path / "local").code == 1
    local = (tmp_path / "local" / arm.run(arm.pushed) / "audit.json").read_bytes()
    run = next(path for path in (tmp_path / "out").glob("pushed*/audit.json"))
    named = local.replace(f"{arm.pushed.parent.name}/".encode(), b"")
    assert run.read_bytes() == named, "where a log came from changes nothing but its name"
    inputs = json.loads((tmp_path / "out" / "manifest.json").read_text())["inputs"]
    assert {item["path"] for item in inputs if item["role"] == "log"} == {f"{bucket}/clean.csv", f"{bucket}/pushed.csv"}


def test_what_is_not_there(bucket: str, arm, collaudit, tmp_path: Path) -> None:
    run = collaudit("audit", f"{bucket}/*.bag", "-c", arm.config, "-o", tmp_path / "out")
    assert run.code == 2 and "there is no log" in run.err
    run = collaudit("audit", f"{bucket}/*.bag", arm.clean, "-c", arm.config, "-o", tmp_path / "out", "--keep-going")
    assert run.code == 3
