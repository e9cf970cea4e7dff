"""One table in every format that tables are read from."""

from __future__ import annotations

import bz2
import gzip
import lzma
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from pyarrow import csv, feather
from scipy.io import savemat

Columns = dict[str, Any]


def text(path: Path, columns: Columns, delimiter: str = ",", decimal: str = ".") -> None:
    """Shortest decimals that give the same float64."""
    options = csv.WriteOptions(delimiter=delimiter, quoting_style="none")
    stream = pa.BufferOutputStream()
    csv.write_csv(pa.table({f"c{k}": values for k, values in enumerate(columns.values())}), stream, options)
    body = stream.getvalue().to_pybytes().partition(b"\n")[2].replace(b".", decimal.encode())
    path.write_bytes(delimiter.join(columns).encode() + b"\n" + body)


def packed(pack: Callable[[bytes], bytes], write: Callable[[Path, Columns], None] = text) -> Any:
    def write_packed(path: Path, columns: Columns) -> None:
        inner = path.with_name("inner")
        write(inner, columns)
        path.write_bytes(pack(inner.read_bytes()))

    return write_packed


def zipped(path: Path, columns: Columns) -> None:
    text(path.with_name("inner"), columns)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(path.with_name("inner"), "run.csv")


def npz(path: Path, columns: Columns) -> None:
    with path.open("wb") as stream:
        np.savez(stream, **columns)


def matlab_name(name: str) -> str:
    """As ``readtable`` of MATLAB renames a column: letters, digits and underscores."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return plain if plain[0].isalpha() else "x" + plain


def mat(path: Path, columns: Columns) -> None:
    named = {matlab_name(name): values for name, values in columns.items()}
    savemat(path, named, appendmat=False, long_field_names=True)


def mat_73(path: Path, columns: Columns) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in columns.items():
            file.create_dataset(matlab_name(name), data=values[None, :])
    head = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as stream:
        stream.write(head)


def parquet(path: Path, columns: Columns) -> None:
    pq.write_table(pa.table(columns), path)


FORMATS: dict[str, Callable[[Path, Columns], None]] = {
    "run.csv": text,
    "semicolon.csv": lambda path, columns: text(path, columns, ";", ","),
    "blanks.csv": lambda path, columns: text(path, columns, " "),
    "run.csv.gz": packed(gzip.compress),
    "run.csv.bz2": packed(lambda data: bz2.compress(data, 1)),
    "run.csv.xz": packed(lambda data: lzma.compress(data, preset=0)),
    "run.csv.zst": packed(lambda data: pa.Codec("zstd").compress(data, asbytes=True)),
    "run.zip": zipped,
    "run.parquet": parquet,
    "run.parquet.gz": packed(lambda data: gzip.compress(data, 1), parquet),
    "run.feather": lambda path, columns: feather.write_feather(pa.table(columns), path),
    "run.npz": npz,
    "run.mat": mat,
    "run73.mat": mat_73,
}
