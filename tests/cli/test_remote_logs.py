"""Remote logs are fetched one at a time, judged as local ones, and leave nothing behind; every backend is run."""

from __future__ import annotations

import base64
import json
import os
import shutil
import sys
import tempfile
from pathlib import Path

import pytest
from log_servers import FolderServer, served

from collaudit.cli.batch import remote_logs as remote
from collaudit.cli.batch.remote_logs import EXTRAS, local_copy, remote_logs
from collaudit.core.errors import CollauditError, ConfigError, NotJudgedError

_AZURE_KEY = base64.b64encode(b"no secret").decode()


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
    local = (tmp_path / "local" / arm.pushed.stem / "audit.json").read_bytes()
    run = next(path for path in (tmp_path / "out").glob("pushed*/audit.json"))
    assert run.read_bytes() == local, "where a log came from changes nothing"


def test_what_is_not_there(bucket: str, arm, collaudit, tmp_path: Path) -> None:
    run = collaudit("audit", f"{bucket}/*.bag", "-c", arm.config, "-o", tmp_path / "out")
    assert run.code == 2 and "there is no log" in run.err
    run = collaudit("audit", f"{bucket}/*.bag", arm.clean, "-c", arm.config, "-o", tmp_path / "out")
    assert run.code == 3


def test_a_log_that_was_replaced_is_not_taken_over(arm, collaudit, tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    log = Path(shutil.copyfile(arm.clean, tmp_path / "logs" / "log.csv"))
    with served(FolderServer(tmp_path)) as server:
        url = f"{server.url}/logs/log.csv"
        command = ("audit", url, "-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "out", "--resume")
        assert collaudit(*command).code == 0
        shutil.copyfile(arm.pushed, log)
        run = collaudit(*command)
    assert run.code == 1 and "0 of 1 logs were finished earlier" in run.err


def _store(arm, folder: Path) -> Path:
    """A folder ``logs`` of a log and a short table."""
    (folder / "logs").mkdir()
    shutil.copyfile(arm.clean, folder / "logs" / "night.csv")
    (folder / "logs" / "short.csv").write_text("t,q1\n0,1\n")
    return folder


def test_logs_on_google_storage(arm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    emulator, gcsfs = pytest.importorskip("gcp_storage_emulator.server"), pytest.importorskip("gcsfs")
    monkeypatch.setenv("GCSFS_EXPERIMENTAL_ZB_HNS_SUPPORT", "false")
    store = _store(arm, tmp_path)
    server = emulator.create_server("127.0.0.1", 0, in_memory=True, default_bucket="logs")
    server.start()
    try:
        address = f"http://127.0.0.1:{server._api._httpd.server_address[1]}"
        monkeypatch.setenv("STORAGE_EMULATOR_HOST", address)
        system = gcsfs.GCSFileSystem()
        for path in (store / "logs").iterdir():
            system.pipe_file(f"logs/{path.name}", path.read_bytes())
        _found_and_read("gs://logs", store)
    finally:
        server.stop()


def test_logs_on_azure_storage(arm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("adlfs")
    store = _store(arm, tmp_path)
    with served(FolderServer(store, account="tests")) as server:
        place = f"BlobEndpoint={server.url}/tests;DefaultEndpointsProtocol=http"
        text = f"AccountName=tests;AccountKey={_AZURE_KEY};{place}"
        monkeypatch.setenv("AZURE_STORAGE_CONNECTION_STRING", text)
        _found_and_read("az://logs", store)


def _found_and_read(folder: str, store: Path) -> None:
    """Both logs are found and fetched."""
    assert remote_logs(folder) == [f"{folder}/night.csv", f"{folder}/short.csv"]
    assert remote_logs(f"{folder}/n*.csv") == [f"{folder}/night.csv"]
    for name in ("night.csv", "short.csv"):
        with local_copy(f"{folder}/{name}") as copy:
            assert copy.name == name and copy.read_bytes() == (store / "logs" / name).read_bytes()
        assert not copy.exists()
    with pytest.raises(ConfigError, match="no log"):
        remote_logs(f"{folder}/*.bag")


def test_a_log_that_is_replaced_while_it_is_fetched_is_not_judged(arm, tmp_path: Path, monkeypatch) -> None:
    store, fetch = _store(arm, tmp_path), remote._fetch

    def fetched_and_replaced(*arguments: object) -> None:
        fetch(*arguments)
        os.utime(store / "logs" / "night.csv", ns=(1, 1))

    monkeypatch.setattr(remote, "_fetch", fetched_and_replaced)
    with (
        served(FolderServer(store)) as server,
        pytest.raises(NotJudgedError, match="replaced"),
        local_copy(f"{server.url}/logs/night.csv"),
    ):
        raise AssertionError("it was handed out")


@pytest.mark.parametrize(
    ("scheme", "module"),
    [("s3", "s3fs"), ("gs", "gcsfs"), ("gcs", "gcsfs"), ("az", "adlfs"), ("abfs", "adlfs"), ("http", "aiohttp")],
)
def test_a_backend_that_is_missing_is_named(scheme: str, module: str, monkeypatch: pytest.MonkeyPatch) -> None:
    registry = pytest.importorskip("fsspec.registry")
    for known in EXTRAS:
        monkeypatch.delitem(registry._registry, known, raising=False)
    monkeypatch.delitem(sys.modules, "fsspec.implementations.http", raising=False)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(CollauditError) as caught:
        remote_logs(f"{scheme}://logs/a.mcap")
    assert f"collaudit[{EXTRAS[scheme]}]" in str(caught.value.hint)


@pytest.mark.parametrize("name", ["night#1.dat", "NIGHT#2.DAT", "all axes.dat"])
def test_a_trace_of_several_files_is_refused_by_a_line_that_leads_on(name: str, arm, collaudit, tmp_path: Path) -> None:
    (tmp_path / "at").mkdir()
    (tmp_path / "at" / name).write_text("DIAEXTENDED  {@:DIADEM}\n#BEGINCHANNELHEADER\n#ENDCHANNELHEADER\n")
    url = f"file://{tmp_path}/at/{name}"
    run = collaudit("audit", url, "-c", arm.config, "-o", tmp_path / "out")
    assert run.code == 3
    assert "a KUKA trace is several files, and a URL names one of them" in run.err
    assert "fetch all of them into one folder, and name that folder" in run.err


def test_another_table_of_that_ending_is_fetched(arm, tmp_path: Path) -> None:
    shutil.copyfile(arm.clean, tmp_path / "table.dat")
    with local_copy(f"file://{tmp_path}/table.dat") as path:
        assert path.read_bytes() == arm.clean.read_bytes()
