"""What a reader gets of a result: files, pages, tables, formats for CI.

In: results of ``core``, frozen. Out: text and files, the same bytes for the same result.
Elsewhere: what is computed (``core``), which command writes what and its exit code (``cli``).
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collaudit.reports.files.run_files import read_friction, read_run, write_friction, write_run
    from collaudit.reports.formats.registry import write_report

__all__ = ["read_friction", "read_run", "write_friction", "write_report", "write_run"]

_HOMES = dict.fromkeys(__all__, "collaudit.reports.files.run_files") | {
    "write_report": "collaudit.reports.formats.registry"
}


def __getattr__(name: str) -> Any:
    """Names are handed on when they are asked for: the help of a command imports nothing that computes."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
