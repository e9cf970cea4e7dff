"""MATLAB files as tables: version 5 by SciPy, version 7.3 (HDF5) by h5py.

SciPy reads beyond the end of files of version 5 that do not keep their own rules: their elements are walked first.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.file_content import head_of
from collaudit.core.logs.storage.reading_bounds import plausible_table
from collaudit.core.logs.table_files.hdf5_file import hdf5_arrays
from collaudit.core.logs.table_files.named_columns import NamedColumns, columns_of, read_as

_HDF5 = b"MATLAB 7.3"
_HINT = (
    "tables, timetables and time series are objects that only MATLAB reads: write them as CSV there "
    "(writetable(T, 'log.csv')), or as plain arrays (S = table2struct(T, 'ToScalar', true); save('log.mat', '-struct', "
    "'S'))"
)
_OLDER = "; or save the file in MATLAB with save(…, '-v7')"
_HEADER = 128
#: Bytes of a number by the type of its element; 14 is an array of elements, 15 a compressed element.
_WIDTH = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
_ARRAY, _COMPRESSED = 14, 15
_NUMERIC = range(6, 16)
#: An object that only MATLAB reads: it has no dimensions.
_OPAQUE = 17
_DEPTH = 16


def open_mat(path: Path, settings: object) -> NamedColumns:
    """Open a MATLAB file; the fields of a struct ``log`` become ``log.field``.

    Raises:
        LogError: it cannot be read, holds no columns, or needs a package that is not installed.
    """
    modern = head_of(path, len(_HDF5)) == _HDF5
    arrays = hdf5_arrays(path, "a MATLAB 7.3 file", _OLDER) if modern else dict(_from_version_5(path))
    try:
        columns, left_out = columns_of(arrays, path)
    except LogError as error:
        raise LogError(error.message, where=str(path), found=error.found, hint=_HINT) from error
    version = "7.3" if modern else "5"
    return NamedColumns(path, f"mat-{version}", f"MATLAB {version}", columns, left_out=left_out)


def _from_version_5(path: Path) -> Iterator[tuple[str, Any]]:
    from scipy.io import loadmat

    check_elements(path)
    with read_as("a MATLAB file", path):
        held = loadmat(path, squeeze_me=True, struct_as_record=False)
    for name, value in held.items():
        if not name.startswith("__"):
            yield from _fields(name, value)


def _fields(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    names = getattr(value, "_fieldnames", None)
    if names is not None:
        for field in names:
            yield from _fields(f"{name}.{field}", getattr(value, field))
    elif isinstance(value, np.ndarray) and value.dtype.names is None:
        yield name, value


def check_elements(path: Path) -> None:
    """Walk through all elements of a file.

    Raises:
        LogError: one has an unknown type, does not fit where it lies, or holds fewer numbers than it claims.
    """
    data = path.read_bytes()
    order = {b"IM": "<", b"MI": ">"}.get(data[126:_HEADER])
    if order is None:
        raise _broken(path, "its byte order is not marked")
    _walk(memoryview(data)[_HEADER:], order, path, 0)


def _broken(path: Path, why: str) -> LogError:
    return LogError(f"cannot be read as a MATLAB file: {why}", where=str(path))


def _walk(data: memoryview, order: str, path: Path, depth: int) -> list[tuple[int, memoryview]]:
    """The elements in some bytes; arrays among them are walked too."""
    if depth > _DEPTH:
        raise _broken(path, "its arrays are nested too deeply")
    found: list[tuple[int, memoryview]] = []
    at = 0
    while at < len(data):
        kind, body, at = _element(data, at, order, path)
        if kind == _COMPRESSED:
            _walk(memoryview(_inflated(body, path)), order, path, depth + 1)
        elif kind == _ARRAY:
            _check_array(_walk(body, order, path, depth + 1), order, path)
        elif kind not in _WIDTH or len(body) % _WIDTH[kind]:
            raise _broken(path, f"an element of type {kind} with {len(body)} bytes")
        found.append((kind, body))
    return found


def _element(data: memoryview, at: int, order: str, path: Path) -> tuple[int, memoryview, int]:
    """Type, bytes and end of the element at a place."""
    if at + 8 > len(data):
        raise _broken(path, "it ends inside an element")
    first, size = struct.unpack_from(f"{order}II", data, at)
    if first >> 16:
        if first >> 16 > 4:
            raise _broken(path, "a small element is too long")
        return first & 0xFFFF, data[at + 4 : at + 4 + (first >> 16)], at + 8
    stop = at + 8 + size
    if stop > len(data):
        raise _broken(path, "it ends inside an element")
    return first, data[at + 8 : stop], stop if first == _COMPRESSED else min(stop + -size % 8, len(data))


def _inflated(body: memoryview, path: Path) -> bytes:
    stream = zlib.decompressobj()
    parts: list[bytes] = []
    have = 0
    try:
        while piece := stream.decompress(stream.unconsumed_tail or (b"" if parts else body), 1 << 20):
            parts.append(piece)
            have += len(piece)
            if not plausible_table(len(body), have):
                raise _broken(path, "an element decompresses into more than its size allows")
    except zlib.error as error:
        raise _broken(path, str(error)) from error
    if not stream.eof:
        raise _broken(path, "a compressed element is cut")
    return b"".join(parts)


def _check_array(parts: list[tuple[int, memoryview]], order: str, path: Path) -> None:
    """Flags, dimensions, name and, of numbers, as many as the dimensions say."""
    if not parts or (len(parts[0][1]) == 8 and struct.unpack_from(f"{order}I", parts[0][1])[0] & 0xFF == _OPAQUE):
        return
    if (
        len(parts) < 3
        or parts[0][0] != 6
        or len(parts[0][1]) != 8
        or parts[1][0] not in (5, 6)
        or parts[2][0] not in (1, 2, 16)
    ):
        raise _broken(path, "an array without flags, dimensions or name")
    (flags,) = struct.unpack_from(f"{order}I", parts[0][1])
    sizes = struct.unpack(f"{order}{len(parts[1][1]) // 4}i", parts[1][1])
    if len(sizes) < 2 or min(sizes) < 0 or not 1 <= flags & 0xFF <= 18:
        raise _broken(path, f"an array of class {flags & 0xFF} with dimensions {sizes}")
    if flags & 0xFF in _NUMERIC:
        wanted = 2 if flags & 0x800 else 1
        if len(parts) != 3 + wanted or any(k not in _WIDTH for k, _ in parts[3:]):
            raise _broken(path, "an array of numbers without its numbers")
        if any(len(body) // _WIDTH[k] != math.prod(sizes) for k, body in parts[3:]):
            raise _broken(path, f"an array that does not hold the numbers of its dimensions {sizes}")
