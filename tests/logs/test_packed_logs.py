"""Logs compressed as a whole: the log within is read, whatever its format, and nothing is left behind."""

from __future__ import annotations

import bz2
import gc
import gzip
import io
import lzma
import tempfile
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import log_writers as w
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import zstandard

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.inputs import expand_inputs, group_inputs
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log

COUNT = 200
COLUMNS = {"t": 0.01 * np.arange(COUNT), "q1": np.arange(COUNT) * 0.1, "q2": np.arange(COUNT) * 0.2}


def zipped(data: bytes, *more: str) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("run 1/", b"")
        archive.writestr("run 1/log", data)
        archive.writestr("__MACOSX/run 1/._log", b"x")
        for name in more:
            archive.writestr(name, data)
    return out.getvalue()


PACKERS: dict[str, Callable[[bytes], bytes]] = {
    ".gz": gzip.compress,
    ".zst": zstandard.ZstdCompressor().compress,
    ".xz": lambda data: lzma.compress(data, preset=0),
    ".bz2": bz2.compress,
    ".zip": zipped,
}
KINDS = ("mcap", "bag", "db3", "parquet", "npz", "csv")


def write(path: Path, kind: str) -> Path:
    if kind == "mcap":
        return w.write_mcap(path, w.motion(COUNT))
    if kind == "bag":
        return w.write_bag(path, w.motion(COUNT, encoding="ros1"))
    if kind == "db3":
        return w.storage_file(w.write_folder(path.with_name("folder"), w.motion(COUNT))).rename(path)
    if kind == "parquet":
        pq.write_table(pa.table(COLUMNS), path)
    elif kind == "npz":
        np.savez(path, **COLUMNS)
    else:
        rows = zip(*(values.tolist() for values in COLUMNS.values()), strict=True)
        path.write_text("t,q1,q2\n" + "".join(f"{a},{b},{c}\n" for a, b, c in rows))
    return path


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.mark.parametrize("suffix", PACKERS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_compressed_log_is_the_log_within(kind: str, suffix: str, tmp_path: Path, temporary: Path) -> None:
    plain = write(tmp_path / f"log.{kind}", kind)
    packed = tmp_path / f"packed.{kind}{suffix}"
    packed.write_bytes(PACKERS[suffix](plain.read_bytes()))
    expected, log = (read_log((path,), LogConfig(), robot_joints=None) for path in (plain, packed))
    np.testing.assert_array_equal(log.time_s, expected.time_s)
    np.testing.assert_array_equal(log.position_rad, expected.position_rad)
    assert log.source.format == expected.source.format
    assert (log.source.name, log.source.sha256 != expected.source.sha256) == (packed.name, True)
    assert describe((packed,)).topics[0].count == describe((plain,)).topics[0].count
    assert packed in expand_inputs([tmp_path])
    gc.collect()
    assert list(temporary.iterdir()) == []


def test_compressed_tables_that_belong_together(tmp_path: Path) -> None:
    names = (("q1", "q2"), ("tau1", "tau2"))
    paths = []
    for k, (first, second) in enumerate(names):
        pq.write_table(pa.table({"t": COLUMNS["t"], first: COLUMNS["q1"], second: COLUMNS["q2"]}), tmp_path / "plain")
        paths.append(tmp_path / f"{k}.parquet.gz")
        paths[-1].write_bytes(gzip.compress((tmp_path / "plain").read_bytes()))
    assert group_inputs(paths, LogConfig()) == [tuple(paths)]
    log = read_log(tuple(paths), LogConfig.of({"units": {"effort": "Nm"}}), robot_joints=None)
    np.testing.assert_array_equal(log.effort, log.position_rad)


def test_an_archive_of_several_files_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "logs.zip"
    path.write_bytes(zipped(b"t,q1\n0,1\n1,2\n", "other.csv"))
    with pytest.raises(LogError, match="exactly one log") as refused:
        read_log((path,), LogConfig(), robot_joints=None)
    assert "other.csv" in str(refused.value.found)


@pytest.fixture(scope="module")
def long_log(once: Callable[..., bytes]) -> bytes:
    """The bytes of a log of 8,000 samples."""
    return once(("8,000 samples",), lambda path: w.write_mcap(path / "log.mcap", w.motion(8000)).read_bytes())


@pytest.mark.parametrize("suffix", [".gz", ".xz", ".zst"])
def test_what_comes_before_damage_is_read_and_said(suffix: str, long_log: bytes, tmp_path: Path) -> None:
    data = PACKERS[suffix](long_log)
    packed = tmp_path / f"log.mcap{suffix}"
    packed.write_bytes(data[: len(data) * 3 // 4])
    log = read_log((packed,), LogConfig(), robot_joints=None)
    assert 0 < log.time_s.shape[0] < 8000
    texts = [finding.text for finding in log.findings if finding.code == "log-partial"]
    assert any("cannot be decompressed beyond" in text for text in texts)


def test_a_bomb_is_refused_and_other_content_named(tmp_path: Path, temporary: Path) -> None:
    path = tmp_path / "log.mcap.xz"
    path.write_bytes(lzma.compress(b"\x89MCAP0\r\n" + bytes(80 << 20), preset=0))
    with pytest.raises(LogError, match="more than its size allows"):
        read_log((path,), LogConfig(), robot_joints=None)
    assert list(temporary.iterdir()) == []
    path.write_bytes(gzip.compress(b"\x7fELF\x00\x01\x02" * 100))
    with pytest.raises(LogError, match="known format") as refused:
        read_log((path,), LogConfig(), robot_joints=None)
    assert "compressed (gzip)" in str(refused.value.found)


def test_a_packed_line_without_end_is_refused_before_it_is_collected(tmp_path: Path) -> None:
    log = tmp_path / "endless.csv.gz"
    with gzip.open(log, "wb", 1) as file:
        for _ in range(40):
            file.write(b"0" * 5_000_000)
    start = time.process_time()
    with pytest.raises(LogError, match="more than its size allows"):
        read_log((log,), LogConfig(), robot_joints=None)
    assert time.process_time() - start < 2.0
