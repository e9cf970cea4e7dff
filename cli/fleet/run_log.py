"""``--log-json``: what an audit does, as it does it, one JSON object a line."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import TextIO

from collaudit.cli.batch.log_jobs import Outcome
from collaudit.core.errors import CollauditError

SCHEMA = "collaudit/run-log/1"


class RunLog:
    """Events of one audit. Times are of the run, not of the logs; nothing of it is in the results."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._started = time.monotonic()

    def event(self, name: str, **facts: object) -> None:
        """Write one event, at once: a run that is killed leaves what it did."""
        head = {"time": datetime.now(UTC).isoformat(timespec="milliseconds"), "event": name}
        line = {**head, "elapsed_s": round(time.monotonic() - self._started, 3), **facts}
        print(json.dumps(line, allow_nan=False), file=self._stream, flush=True)

    def judged(self, outcome: Outcome) -> None:
        """One log has come out, with the verdict on it alone."""
        entry = outcome.entry
        self.event(
            "log",
            log=entry.name,
            robot=entry.robot,
            verdict=entry.verdict,
            reasons=list(entry.reasons),
            contacts=entry.contacts,
            near_misses=entry.near_misses,
        )


@contextmanager
def run_log(path: Path | None) -> Iterator[RunLog]:
    """The log of a run; its last event tells how it ended.

    Args:
        path: file to write, which is replaced; None for no log.

    Raises:
        CollauditError: it cannot be written.
    """
    try:
        stream = (path or Path(os.devnull)).open("w", encoding="utf-8")
    except OSError as error:
        raise CollauditError(f"cannot be written: {error.strerror}", where=str(path)) from error
    with stream:
        log = RunLog(stream)
        try:
            yield log
        except BaseException as error:
            log.event("ended", error=type(error).__name__, text=str(error))
            raise
