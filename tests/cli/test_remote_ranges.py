"""Large indexed MCAPs at URLs are read by ranges, with the results of the local file; every backend is run."""

from __future__ import annotations

import base64
import hashlib
import json
import os
import shutil
import sys
from pathlib import Path

import pytest
from camera_log import write_camera_log
from log_servers import FolderServer, served

from collaudit.cli.fleet import remote_logs as remote
from collaudit.cli.fleet.remote_logs import EXTRAS, fetched_of, local_copy, remote_logs
from collaudit.core.errors import CollauditError, ConfigError, NotJudgedError
from collaudit.core.logs.storage.file_reading import RandomFile

_AZURE_KEY = base64.b64encode(b"no secret").decode()


@pytest.fixture(scope="module")
def store(arm, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder ``logs`` of a log of 50 MB of images and 3 MB of joint states, and of a short table."""
    folder = tmp_path_factory.mktemp("store")
    (folder / "logs").mkdir()
    write_camera_log(folder / "logs" / "night.mcap", arm.pushed, images=50)
    (folder / "logs" / "short.csv").write_text("t,q1\n0,1\n")
    return folder


@pytest.fixture
def judged(arm, collaudit, tmp_path: Path):
    """Audit one log; bytes of its audit.json, and the manifest."""

    def run(log: object, out: str, *flags: str) -> tuple[bytes, dict[str, object]]:
        settings = ("-c", arm.config, "--friction", arm.friction)
        story = tmp_path / f"{out}{''.join(flags)}.jsonl"
        done = collaudit("audit", log, *settings, "-o", tmp_path / out, "--log-json", story, *flags)
        assert done.code == 1, done.err
        (audit,) = (tmp_path / out).glob("*/audit.json")
        return audit.read_bytes(), json.loads((tmp_path / out / "manifest.json").read_text())

    return run


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def test_a_log_of_images_is_judged_by_the_chunks_of_its_joints(store: Path, judged, tmp_path: Path) -> None:
    log = store / "logs" / "night.mcap"
    with served(FolderServer(store)) as server:
        parts, manifest = judged(f"{server.url}/logs/night.mcap", "parts")
        assert server.sent < 5_000_000 < log.stat().st_size / 10, "images were fetched"
        sent = server.sent
        again, taken_over = judged(f"{server.url}/logs/night.mcap", "parts", "--resume")
        assert server.sent == sent and taken_over == manifest, "a log that its store still has as it was is not fetched"
        beside = log.with_name("night.mcap.sha256")
        beside.write_text(f"{_sha256(log)}  night.mcap\n")
        stated, stating = judged(f"{server.url}/logs/night.mcap", "stated")
        beside.unlink()
    local, _ = judged(log, "local")
    assert stated == local and parts == again
    assert manifest["logs"][0]["log_hash_of"] == "parts" and stating["logs"][0]["log_hash_of"] == "stated"
    assert manifest["inputs"][-1]["size_bytes"] == log.stat().st_size
    event = json.loads((tmp_path / "parts.jsonl").read_text().splitlines()[1])
    assert event["fetched_bytes"] < 5_000_000 and event["hash_of"] == "parts"
    one, other = json.loads(parts), json.loads(local)
    (said,) = [finding for finding in one["findings"] if "were fetched" in finding["text"]]
    one["findings"].remove(said)
    assert one["log"].pop("sha256") != other["log"].pop("sha256") == _sha256(log)
    assert one == other, "but for the hash, and that it is said"


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


def test_s3_states_the_hash_of_a_log(bucket, store: Path) -> None:
    log = store / "logs" / "night.mcap"
    bucket.put_object(Bucket="logs", Key="night.mcap", Body=log.read_bytes(), ChecksumAlgorithm="SHA256")
    with local_copy("s3://logs/night.mcap") as copy:
        assert _middle(copy) == _middle(log)
        assert fetched_of(copy).hash_of == "stated" and fetched_of(copy).fetched_bytes < 1_000_000
        from collaudit.core.logs.log_hashing import sha256_of

        assert sha256_of([copy]) == _sha256(log)


@pytest.fixture
def bucket(monkeypatch: pytest.MonkeyPatch):
    """The client of a bucket "logs" on moto's server."""
    moto, boto3 = pytest.importorskip("moto.server"), pytest.importorskip("boto3")
    pytest.importorskip("s3fs")
    server = moto.ThreadedMotoServer(port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    keys = {"AWS_ACCESS_KEY_ID": "test", "AWS_SECRET_ACCESS_KEY": "test", "AWS_DEFAULT_REGION": "us-east-1"}
    for name, value in {**keys, "AWS_ENDPOINT_URL": f"http://{host}:{port}"}.items():
        monkeypatch.setenv(name, value)
    client = boto3.client("s3")
    client.create_bucket(Bucket="logs")
    _forget_stores()
    yield client
    server.stop()
    _forget_stores()


def _forget_stores() -> None:
    """fsspec keeps connections by their options, and these servers are told apart by the environment alone."""
    from fsspec.registry import registry

    for system in registry.values():
        system.clear_instance_cache()


def _middle(path: Path) -> bytes:
    file = RandomFile(path)
    try:
        return file.read(file.size // 2, 1000)
    finally:
        file.close()


def test_logs_on_google_storage(store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    emulator, gcsfs = pytest.importorskip("gcp_storage_emulator.server"), pytest.importorskip("gcsfs")
    monkeypatch.setenv("GCSFS_EXPERIMENTAL_ZB_HNS_SUPPORT", "false")
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


def test_logs_on_azure_storage(store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("adlfs")
    with served(FolderServer(store, account="tests")) as server:
        place = f"BlobEndpoint={server.url}/tests;DefaultEndpointsProtocol=http"
        text = f"AccountName=tests;AccountKey={_AZURE_KEY};{place}"
        monkeypatch.setenv("AZURE_STORAGE_CONNECTION_STRING", text)
        _found_and_read("az://logs", store)


def _found_and_read(folder: str, store: Path) -> None:
    """Both logs are found; the large one is read by ranges, the short one fetched."""
    assert remote_logs(folder) == [f"{folder}/night.mcap", f"{folder}/short.csv"]
    assert remote_logs(f"{folder}/*.mcap") == [f"{folder}/night.mcap"]
    with local_copy(f"{folder}/night.mcap") as copy:
        assert _middle(copy) == _middle(store / "logs" / "night.mcap")
        assert fetched_of(copy).fetched_bytes < 1_000_000
    with local_copy(f"{folder}/short.csv") as copy:
        assert copy.read_bytes() == (store / "logs" / "short.csv").read_bytes()
    with pytest.raises(ConfigError, match="no log"):
        remote_logs(f"{folder}/*.bag")


def test_a_server_without_ranges_and_one_who_asks_for_all_of_it(store: Path) -> None:
    log = store / "logs" / "night.mcap"
    for server, how in ((FolderServer(store, ranges=False), "ranges"), (FolderServer(store), "whole")):
        with served(server):
            assert remote_logs(f"{server.url}/logs/") == [
                f"{server.url}/logs/night.mcap",
                f"{server.url}/logs/short.csv",
            ]
            with local_copy(f"{server.url}/logs/night.mcap", how) as copy:
                assert fetched_of(copy) == (log.stat().st_size, log.stat().st_size, "file")
                assert _sha256(copy) == _sha256(log)


def test_a_log_without_an_index_is_fetched_whole(arm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from collaudit.core.logs.mcap.mcap_file import McapFile

    monkeypatch.setattr(remote, "_BY_RANGES_FROM", 1 << 20)
    log = tmp_path / "log.mcap"
    write_camera_log(log, arm.clean, images=2, summary=False)
    with served(FolderServer(tmp_path)) as server, local_copy(f"{server.url}/log.mcap") as copy:
        McapFile(copy).close()
        assert fetched_of(copy).hash_of == "file" and copy.read_bytes() == log.read_bytes()


def test_a_log_that_is_replaced_while_it_is_read_is_not_judged(store: Path) -> None:
    log = store / "logs" / "night.mcap"
    with (
        served(FolderServer(store)) as server,
        pytest.raises(NotJudgedError, match="replaced"),
        local_copy(f"{server.url}/logs/night.mcap"),
    ):
        os.utime(log, ns=(1, 1))


def test_a_summary_that_is_wrong_about_a_chunk_is_damage(arm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A contact in a chunk that the summary hides would be a wrong all clear."""
    from collaudit.core.logs.mcap.mcap_file import McapFile

    monkeypatch.setattr(remote, "_BY_RANGES_FROM", 1 << 20)
    log = tmp_path / "log.mcap"
    write_camera_log(log, arm.clean, images=20)
    data = bytearray(log.read_bytes())
    at = _chunk_index(data)
    data[at : at + 2] = (2).to_bytes(2, "little")  # the first chunk holds the camera's messages, it says
    log.write_bytes(data)
    with served(FolderServer(tmp_path)) as server, local_copy(f"{server.url}/log.mcap") as copy:
        reader = McapFile(copy)
        joints = {channel.key for channel in reader.channels if channel.topic == "/joint_states"}
        list(reader.batches(frozenset(joints)))
        reader.close()
        assert any(item.lost for item in reader.damage), "messages that were not met are not missed"


def _chunk_index(data: bytes) -> int:
    """Where the first chunk's index record names its first channel."""
    from collaudit.core.logs.mcap.mcap_records import CHUNK_INDEX, record_places

    summary = int.from_bytes(data[-28:-20], "little")
    return next(summary + at + 9 + 36 for op, at, _ in record_places(bytes(data[summary:])) if op == CHUNK_INDEX)


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
