"""Where the logs and results of tests come from: nowhere in particular."""

from __future__ import annotations

from collaudit.core.data.audit_result import Provenance
from collaudit.core.data.joint_log import LogSource

NOBODY = Provenance("test", {})


def log_source(name: str = "synthetic") -> LogSource:
    """The source of a log that was never a file."""
    return LogSource(name, "0" * 64, "test", None, "column", "/t")
