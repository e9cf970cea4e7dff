"""Many logs, some at a time: names, run folders, worker processes, outcomes in the order of the logs."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from collaudit.cli.audit_one import Outcome, audit_one
from collaudit.core.api import LogFiles, Progress, log_name

if TYPE_CHECKING:
    from collaudit.core.config import LoadedConfig

_LONGEST_NAME = 80


def log_names(logs: Sequence[LogFiles]) -> list[str]:
    """A name for every log: that of its file, with its folder where two files are called the same."""
    names = [log_name(files) for files in logs]
    count = Counter(names)
    return [name if count[name] == 1 else str(files[0].parent / name) for files, name in zip(logs, names, strict=True)]


def run_folders(logs: Sequence[LogFiles]) -> list[str]:
    """A folder name for every log: its file's stem, numbered where two logs share one."""
    taken: set[str] = set()
    names = []
    for files in logs:
        joined = "+".join(path.stem if path.is_file() else path.name for path in files)
        stem = re.sub(r"[^\w.+-]+", "_", joined).strip("._")[:_LONGEST_NAME] or "log"
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
    done: Callable[[Outcome], None],
) -> list[Outcome]:
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

    Raises:
        CollauditError: an output cannot be written.
    """
    work = list(zip(logs, log_names(logs), run_folders(logs), strict=True))
    if jobs == 1 or len(logs) == 1:
        outcomes = []
        for files, name, folder in work:
            outcomes.append(audit_one(files, name, folder, loaded, out, progress if len(logs) == 1 else None))
            done(outcomes[-1])
            if len(logs) > 1:
                progress(len(outcomes), len(logs))
        return outcomes
    return _in_processes(work, loaded, out, min(jobs, len(logs)), progress, done)


def _in_processes(
    work: Sequence[tuple[LogFiles, str, str]],
    loaded: LoadedConfig,
    out: Path,
    workers: int,
    progress: Progress,
    done: Callable[[Outcome], None],
) -> list[Outcome]:
    from concurrent.futures import ProcessPoolExecutor, as_completed
    from multiprocessing import get_context

    outcomes: dict[int, Outcome] = {}
    # Fresh processes: a forked copy of one that has run numerical threads may hang.
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_one_thread_each) as pool:
        futures = {pool.submit(audit_one, *item, loaded, out, None): index for index, item in enumerate(work)}
        try:
            for future in as_completed(futures):
                outcomes[futures[future]] = future.result()
                done(outcomes[futures[future]])
                progress(len(outcomes), len(work))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [outcomes[index] for index in range(len(work))]


def _one_thread_each() -> None:
    """More threads in a worker would only fight with the other workers."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
