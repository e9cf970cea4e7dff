"""A simulated arm, written as each kind of table and compressed, gives the same audit."""

from __future__ import annotations

import gzip
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.csv
import pyarrow.parquet as pq
import pytest
from pyarrow import feather
from same_audit import alike
from scipy.io import savemat


def arrays(table: Any) -> dict[str, Any]:
    return {name: table.column(name).to_numpy() for name in table.column_names}


def npz(path: Path, table: Any) -> None:
    with path.open("wb") as stream:
        np.savez(stream, **arrays(table))


def packed(path: Path, table: Any) -> None:
    pq.write_table(table, path.with_name("inner"))
    path.write_bytes(gzip.compress(path.with_name("inner").read_bytes()))


def zipped(path: Path, table: Any) -> None:
    with zipfile.ZipFile(path, "w") as archive, archive.open("run.csv", "w") as stream:
        pyarrow.csv.write_csv(table, stream)


WRITERS: dict[str, Callable[[Path, Any], None]] = {
    "run.parquet": lambda path, table: pq.write_table(table, path),
    "run.feather": lambda path, table: feather.write_feather(table, path),
    "run.npz": npz,
    "run.mat": lambda path, table: savemat(path, arrays(table), appendmat=False),
    "run.parquet.gz": packed,
    "run.zip": zipped,
}


def audit(collaudit: Any, log: Path, out: str) -> Any:
    code = collaudit("detect", log, "-c", "run.toml", "-o", out).code
    told = json.loads(Path(out, "audit.json").read_text(encoding="utf-8"))
    for key in ("name", "sha256", "format"):
        told["log"].pop(key)
    told.pop("provenance")
    told["code"] = code
    return json.loads(json.dumps(told).replace(log.name, "LOG"))


def test_every_table_gives_the_same_audit(collaudit: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert collaudit("simulate", "stop-go", "--duration", "20", "--format", "csv", "-o", "run.csv").code == 0
    expected = audit(collaudit, Path("run.csv"), "csv")
    assert expected["residual"]
    table = pyarrow.csv.read_csv("run.csv")
    for name, write in WRITERS.items():
        write(Path(name), table)
        alike(audit(collaudit, Path(name), f"out-{name}"), expected)
