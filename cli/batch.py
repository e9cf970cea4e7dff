"""Many logs, some at a time: run folders, worker processes, outcomes in the order of the logs."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from collaudit.cli.audit_one import LogOutcome, audit_one
from collaudit.cli.chain import LogFiles, Progress

if TYPE_CHECKING:
    from collaudit.core.config import LoadedConfig

#: Threads of one numerical library in a worker: more would only fight with the other workers.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def run_folders(logs: Sequence[LogFiles]) -> list[str]:
    """A folder name for every log: its file's stem, numbered where two logs share one."""
    taken: set[str] = set()
    names = []
    for files in logs:
        stem = re.sub(r"[^\w.+-]+", "_", "+".join(path.stem for path in files)).strip("._")[:80] or "log"
        name, count = stem, 1
        while name.lower() in taken:
            count += 1
            name = f"{stem}-{count}"
        taken.add(name.lower())
        names.append(name)
    return names


def audit_logs(
    logs: Sequence[LogFiles],
    loaded: LoadedConfig,
    out: Path,
    jobs: int,
    progress: Progress,
    done: Callable[[LogOutcome], None],
) -> list[LogOutcome]:
    """Judge every log, at most ``jobs`` at a time.

    Args:
        logs: the files of each log.
        loaded: effective configuration.
        out: folder that gets one run folder a log.
        jobs: processes.
        progress: called with (finished, total); of a single log, with its reader's progress.
        done: called with each outcome as it comes.

    Returns:
        Outcomes in the order of ``logs``.
    """
    folders = run_folders(logs)
    if jobs == 1 or len(logs) == 1:
        return _one_by_one(logs, folders, loaded, out, progress, done)
    from concurrent.futures import ProcessPoolExecutor, as_completed
    from multiprocessing import get_context

    outcomes: dict[int, LogOutcome] = {}
    workers = min(jobs, len(logs))
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_one_thread_each) as pool:
        futures = {
            pool.submit(audit_one, files, folder, loaded, out, None): index
            for index, (files, folder) in enumerate(zip(logs, folders, strict=True))
        }
        try:
            for future in as_completed(futures):
                outcome = outcomes[futures[future]] = future.result()
                done(outcome)
                progress(len(outcomes), len(logs))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [outcomes[index] for index in range(len(logs))]


def _one_by_one(
    logs: Sequence[LogFiles],
    folders: Sequence[str],
    loaded: LoadedConfig,
    out: Path,
    progress: Progress,
    done: Callable[[LogOutcome], None],
) -> list[LogOutcome]:
    outcomes = []
    for files, folder in zip(logs, folders, strict=True):
        outcome = audit_one(files, folder, loaded, out, progress if len(logs) == 1 else None)
        outcomes.append(outcome)
        done(outcome)
        if len(logs) > 1:
            progress(len(outcomes), len(logs))
    return outcomes


def _one_thread_each() -> None:
    for name in _THREADS:
        os.environ.setdefault(name, "1")
