"""Logs whose file names are no text, or hold what commands a terminal: read as any other, and shown escaped."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from collaudit.cli.main import run
from collaudit.core.config.schema import LogConfig
from collaudit.core.logs.log_reading import read_log

TIME_S = 0.002 * np.arange(300)
COLUMNS = {"time_s": TIME_S, "q1": np.sin(TIME_S), "tau1": np.cos(TIME_S)}
NAMES = (b"caf\xe9", b"new\nline", b"esc\x1b[31m", b"tab\tand\x7f", b"\xff\xfe")


def csv_text() -> bytes:
    rows = zip(*COLUMNS.values(), strict=True)
    return (",".join(COLUMNS) + "\n" + "".join(",".join(f"{x:.6f}" for x in row) + "\n" for row in rows)).encode()


def write(folder: Path, stem: bytes, kind: str) -> Path:
    path = folder / os.fsdecode(stem + b"." + kind.encode())
    if kind == "csv":
        path.write_bytes(csv_text())
    elif kind == "npz":
        with path.open("wb") as file:
            np.savez(file, **COLUMNS)
    else:
        with path.open("wb") as file:
            pq.write_table(pa.table(COLUMNS), file)
    return path


@pytest.mark.parametrize("kind", ["csv", "npz", "parquet"])
@pytest.mark.parametrize("stem", NAMES)
def test_a_log_of_any_name_is_read(stem: bytes, kind: str, tmp_path: Path) -> None:
    log = read_log((write(tmp_path, stem, kind),), LogConfig.of({"units": {"effort": "Nm"}}), robot_joints=None)
    np.testing.assert_allclose(log.time_s, TIME_S, atol=1e-6)


def test_names_are_printed_escaped(tmp_path: Path) -> None:
    paths = [write(tmp_path, stem, "csv") for stem in NAMES]
    command = [sys.executable, "-c", "from collaudit.cli.main import main; main()", "inspect", *map(os.fsencode, paths)]
    done = subprocess.run(command, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    shown = (done.stdout + done.stderr).decode()  # it is UTF-8
    assert not {"\x1b", "\t", "\x7f"} & set(shown)
    assert all(text in shown for text in ("caf\\udce9.csv", "new\\x0aline.csv", "esc\\x1b[31m.csv"))


@pytest.mark.parametrize("stem", NAMES)
def test_a_draft_of_a_configuration_is_toml(stem: bytes, tmp_path: Path) -> None:
    log, draft = write(tmp_path, stem, "csv"), tmp_path / "draft.toml"
    run(["init", str(log), "-o", str(draft)])  # a name as a program is given it: in the test above
    tomllib.loads(draft.read_text(encoding="utf-8"))
