"""Tasks on a cluster of Dask, done by the same processes as on one machine.

Each Dask worker only watches over a process of its own, which does the task: a task that dies, hangs or runs out of
memory costs itself and is named with its cause; a Dask worker or machine that is lost costs nothing, for the scheduler
gives its task to another.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from functools import partial
from importlib import import_module
from typing import Any

from collaudit.cli.batch.child_processes import Lost, results_of
from collaudit.core.errors import CollauditError

_CONNECT_S = "10s"
_GONE = "it was lost with its worker, again and again"
_SILENT = logging.CRITICAL + 1  # what a reader of the audit's stderr needs is said by the audit


def results_on_dask(
    function: Callable[..., Any],
    items: Sequence[tuple[Any, ...]],
    prepare: Callable[[], None],
    timeout_s: float | None,
    scheduler: str,
) -> Generator[tuple[int, Any], None, None]:
    """Place and result, or :class:`Lost`, of each item as they come; what still runs is ended when this is closed.

    Args:
        function: called with the items' arguments in processes of the workers; to be imported by name, also there.
        items: arguments.
        prepare: called in each new process before; pickled for the workers.
        timeout_s: longest time for one item.
        scheduler: address of the cluster's scheduler.

    Raises:
        CollauditError: the scheduler cannot be reached, or Dask is not installed.
    """
    logging.getLogger("distributed").setLevel(_SILENT)
    as_completed = _dask().as_completed
    with closing(_client(scheduler)) as client:
        run = partial(_run, function, prepare, timeout_s)
        futures = {client.submit(run, item, pure=False): index for index, item in enumerate(items)}
        try:
            for future in as_completed(list(futures), loop=client.loop):
                index = futures.pop(future)
                done = future.status == "finished"
                yield index, future.result() if done else Lost(f"{_GONE} ({type(future.exception()).__name__})")
                future.release()
        finally:
            client.cancel([future for future in futures if future.status == "pending"], force=True)


def _dask() -> Any:
    """The library, which is imported late and types only a part of itself."""
    return import_module("distributed")


def _client(scheduler: str) -> Any:
    try:
        return _dask().Client(scheduler, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise CollauditError(
            "the scheduler cannot be reached",
            where="--scheduler",
            found=f"{scheduler}: {error}",
            expected="the address of a running one, such as tcp://host:8786",
            hint="dask scheduler; and on each machine: dask worker ADDRESS --nthreads 1 --no-nanny",
        ) from error


def _run(
    function: Callable[..., Any],
    prepare: Callable[[], None],
    timeout_s: float | None,
    arguments: tuple[Any, ...],
) -> Any:
    """One task, in the thread of a Dask worker."""
    worker, key = _dask().get_worker(), import_module("distributed.worker").thread_state.key

    def cancelled() -> bool:
        task = worker.state.tasks.get(key)
        return task is None or task.state in ("cancelled", "released", "forgotten")

    try:
        with closing(results_of(function, [arguments], 1, prepare, timeout_s, cancelled)) as results:
            return next(results)[1]
    except AssertionError as error:  # of multiprocessing: a daemon may not start processes
        hint = "start workers with --no-nanny, or with DASK_DISTRIBUTED__WORKER__DAEMON=False"
        return Lost(f"no process could be started to judge it ({error}; {hint})")
