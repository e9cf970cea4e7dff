"""Which files belong to the trace of a KUKA controller: a header ``NAME#1.dat`` and values ``NAME#1.r64`` an axis."""

from __future__ import annotations

import re
from pathlib import Path, PureWindowsPath

#: The first bytes of a header.
TRACE = b"DIAEXTENDED"
#: A trace of one axis: the name of the recording, and the axis.
AXIS = re.compile(r"(.+)#(\d+)")
#: Endings of what lies beside a header, and is of no use without it.
_PARTS = (".r64", ".trc")
#: The line of a header that names a file of values.
_NAMED = re.compile(r"^\s*211,(.*?)\s*$", re.MULTILINE)


def is_trace(path: Path) -> bool:
    """Whether a file is the header of a trace."""
    if path.suffix.lower() != ".dat" or not path.is_file():
        return False
    with path.open("rb") as stream:
        return stream.read(len(TRACE)) == TRACE


def trace_values(path: Path) -> tuple[Path, ...]:
    """The files of values of a header, those that are there; none of another file."""
    if not is_trace(path):
        return ()
    found = {values_beside(path, name) for name in _NAMED.findall(path.read_bytes().decode("latin-1"))}
    return tuple(sorted(values for values in found if values is not None))


def values_beside(header: Path, named: str) -> Path | None:
    """The file of values that a header names, else the one of its own name; None where neither lies beside it."""
    wanted = (PureWindowsPath(named).name.lower(), f"{header.stem}.r64".lower())
    inside = {path.name.lower(): path for path in header.parent.iterdir() if path.name.lower() in wanted}
    return next((inside[name] for name in wanted if name in inside), None)


def is_part_of_trace(path: Path) -> bool:
    """Whether a file belongs to the header of its name that lies beside it."""
    return path.suffix.lower() in _PARTS and any(path.with_suffix(end).is_file() for end in (".dat", ".DAT"))
