"""Files of named arrays as tables: of NumPy (.npz, .npy), HDF5 by h5py, MATLAB by SciPy (version 7.3 is HDF5).

SciPy reads beyond the end of MATLAB files of version 5 that do not keep their own rules: their elements are walked
first.
"""

from __future__ import annotations

import math
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.bounded_reading import plausible_table
from collaudit.core.logs.storage.file_content import head_of, python_line, quoted
from collaudit.core.logs.storage.readers import arrow_of
from collaudit.core.logs.tables.named_columns import NamedColumns, columns_of, read_as

_ARCHIVE = b"PK"
#: An array below a group that is one recording of several, such as ``demo_3`` or ``episode_000012``.
_IN_EPISODE = re.compile(
    r"(?:(?P<above>.*?)\.)?(?P<group>(?:demo|episode|ep|traj|trajectory|rollout|run|trial|session|recording|experiment)"
    r"[_-]?(?P<number>\d+))\.(?P<array>.+)",
    re.IGNORECASE,
)
#: The column that numbers the recordings of one file.
_RUN = "episode"
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


def open_numpy(path: Path, settings: object) -> NamedColumns:
    """Open an archive of arrays, or one array: records, or a matrix whose columns are numbered from 1.

    Of a matrix the rows are numbered where there are fewer of these. Pickled objects are never loaded.

    Raises:
        LogError: it cannot be read, decompresses into more than its size allows, or holds no columns.
    """
    kind, title = ("npz", "NumPy archive") if head_of(path, len(_ARCHIVE)) == _ARCHIVE else ("npy", "NumPy array")
    with read_as(f"a {title}", path):  # mapped: a header may claim more than there is
        arrays = _archived(path) if kind == "npz" else fields_of("", np.load(path, mmap_mode="r", allow_pickle=False))
    columns, left_out = columns_of(arrays, path)
    return NamedColumns(path, kind, title, columns, left_out=left_out, named="" not in arrays)


def _archived(path: Path) -> dict[str, Any]:
    with zipfile.ZipFile(path) as archive:
        claimed = sum(item.file_size for item in archive.infolist())
    if not plausible_table(path.stat().st_size, claimed):
        raise LogError("decompresses into more than its size allows", where=str(path), found=f"{claimed} bytes")
    arrays: dict[str, Any] = {}
    with np.load(path, allow_pickle=False) as loaded:
        for name in loaded.files:
            with suppress(ValueError):  # objects: loading them may run any code
                arrays |= fields_of(name, loaded[name])
    return arrays


def fields_of(name: str, array: Any) -> dict[str, Any]:
    """An array, or the arrays of its fields."""
    if array.dtype.names is None:
        return {name: array}
    return {f"{name}.{field}".lstrip("."): array[field] for field in array.dtype.names}


def open_hdf5(path: Path, settings: object) -> NamedColumns:
    """Open an HDF5 file: the array ``q`` of a group ``obs`` is called ``obs.q``.

    Recordings in groups of their own (``demo_0``, ``demo_1`` …) follow one another, numbered by a column ``episode``.

    Raises:
        LogError: it cannot be read, holds no columns, or needs a package that is not installed.
    """
    arrays: dict[str, Any] = {}
    for name, values in hdf5_arrays(path, "an HDF5 file").items():
        arrays |= fields_of(name, values)
    columns, left_out = _one_after_the_other(arrays, path) or columns_of(arrays, path)
    return NamedColumns(path, "hdf5", "HDF5", columns, left_out=left_out)


def hdf5_arrays(path: Path, title: str, hint: str = "") -> dict[str, Any]:
    """The arrays of an HDF5 file that may be columns: at most two dimensions longer than 1, of numbers or texts.

    Args:
        path: the file.
        title: of its format with its article, for messages.
        hint: what can be done besides where the package is missing.

    Returns:
        Names, with dots between groups, to arrays.

    Raises:
        LogError: it cannot be read, claims more than its size allows, keeps numbers elsewhere, or h5py is missing.
    """
    try:
        import h5py
    except ImportError as error:
        raise LogError(
            f"is {title}, which needs the package h5py",
            where=str(path),
            hint=f"install it: pip install 'collaudit[hdf5]'{hint}",
        ) from error
    found: dict[str, Any] = {}

    def visit(name: str, item: Any) -> None:
        if "pandas_type" in item.attrs:
            new = quoted(path.with_suffix(".csv"))
            code = f'import pandas; pandas.read_hdf({quoted(path)}, "{name}").to_csv({new})'
            text = "holds a table of pandas, which only pandas reads"
            raise LogError(text, where=str(path), found=name, hint=f"with pandas and tables: {python_line(code)}")
        if not isinstance(item, h5py.Dataset) or name.startswith("#") or sum(n > 1 for n in item.shape) > 2:
            return
        words = h5py.check_string_dtype(item.dtype) is not None
        if not (words or item.dtype.kind in "fiubV") or item.attrs.get("MATLAB_class") == b"char":
            return
        if item.is_virtual or item.external:
            raise LogError("keeps its numbers in other files, which are not read", where=str(path), found=name)
        if not plausible_table(path.stat().st_size, item.nbytes + sum(array.nbytes for array in found.values())):
            raise LogError("claims more rows than its size allows", where=str(path), found=f"{name} {item.shape}")
        dotted = name.replace("/", ".")
        if dotted in found:
            raise LogError("two arrays have the same name", where=str(path), found=dotted)
        found[dotted] = np.asarray(item.asstr()[()]).astype(str) if words else item[()]

    with read_as(title, path), h5py.File(path, "r") as file:
        file.visititems(visit)
    return found


def _one_after_the_other(arrays: Mapping[str, Any], path: Path) -> tuple[dict[str, Any], tuple[str, ...]] | None:
    """Columns of all recordings, by the names that they have within each; None where there are no recordings.

    What only some of them have is missing in the others.

    Returns:
        The columns, and what is left out: recordings without rows, and arrays of no recording.

    Raises:
        LogError: no recording has rows.
    """
    recordings: dict[tuple[str, int, str], dict[str, Any]] = {}
    left_out: list[str] = []
    for name, values in arrays.items():
        found = _IN_EPISODE.fullmatch(name)
        if found is None:
            left_out.append(f"{name} {values.shape}")
            continue
        recording = found["above"] or "", int(found["number"]), found["group"]
        recordings.setdefault(recording, {})[found["array"]] = values
    if not recordings:
        return None
    tables: list[Any] = []
    for (above, _, group), held in sorted(recordings.items()):
        try:
            columns, other = columns_of(held, path)
        except LogError as error:
            left_out.append(f"{above}.{group} (no rows)".lstrip("."))
            failure = error
            continue
        left_out += [f"{group}.{array}" for array in other]
        rows = len(next(iter(columns.values())))
        tables.append(pa.table({**columns, _RUN: arrow_of(np.full(rows, len(tables)))}))
    if not tables:
        raise failure
    with read_as("runs of one table", path):
        joined = pa.concat_tables(tables, promote_options="permissive")
    return dict(zip(joined.column_names, joined.columns, strict=True)), tuple(left_out)


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
