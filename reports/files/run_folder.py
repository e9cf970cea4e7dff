"""A run's folder while it is written: whole or not at all."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, suppress
from pathlib import Path

from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.signals import Signals
from collaudit.core.numeric.parallel import threads
from collaudit.reports.files.atomic import refuse_link, staged, write_synced
from collaudit.reports.files.run_files import (
    AUDIT_NAME,
    FRICTION_NAME,
    SIGNALS_NAME,
    STUDY_NAME,
    friction_json,
    result_json,
)


def write_run(run_dir: Path, audit: Audit, friction: FrictionFile | None) -> None:
    """Write a run's folder: all files are complete before the first one appears, ``audit.json`` last.

    Args:
        run_dir: folder, made when missing; the files of an earlier run in it are replaced.
        audit: the result and its signals.
        friction: what the run was judged with; without it an earlier ``friction.json`` is removed, as is an earlier
            study of the rule.

    Raises:
        CollauditError: a file cannot be written.
    """
    with RunFolder(run_dir) as run:
        run.write(audit, friction)


class RunFolder:
    """A run's folder that is being filled: its signals may be written while the log is still judged.

    Nothing appears in it before :meth:`write`; what was begun is removed when the block ends without that.
    """

    def __init__(self, run_dir: Path) -> None:
        """Of a folder, which is made when it is missing.

        Raises:
            CollauditError: it is a symbolic link.
        """
        refuse_link(run_dir)
        self._dir = run_dir
        self._new = not run_dir.exists()
        self._begun: tuple[ExitStack, Future[None]] | None = None

    def __enter__(self) -> RunFolder:
        """Begin."""
        return self

    def __exit__(self, *_: object) -> None:
        """Remove what was begun and not finished."""
        if self._begun is None:
            return
        unfinished, written = self._begun
        wait([written])
        with suppress(_AbandonedError), unfinished:
            raise _AbandonedError
        if self._new:
            with suppress(OSError):  # others have put something there
                self._dir.rmdir()

    def take_signals(self, signals: Signals, log_sha256: str) -> None:
        """Begin to write the signals in a thread of their own, where more than one is taken.

        Args:
            signals: those of the audit that :meth:`write` will be given.
            log_sha256: hash of the log they are from.

        Raises:
            CollauditError: the folder cannot be written to.
        """
        if threads() == 1:
            return
        from collaudit.reports.files.signals_file import write_signals

        writer = ThreadPoolExecutor(1)
        try:
            wait([writer.submit(int)])
        except RuntimeError:  # no thread can be started, for want of memory say: they are written with the rest
            return
        unfinished = ExitStack()
        path = unfinished.enter_context(staged(self._dir / SIGNALS_NAME))
        self._begun = unfinished, writer.submit(write_signals, path, signals, log_sha256)
        writer.shutdown(wait=False)

    def write(self, audit: Audit, friction: FrictionFile | None) -> None:
        """Write what is left, and put all files in their places; arguments and errors as of :func:`write_run`."""
        from collaudit.reports.files.signals_file import write_signals

        texts = {
            AUDIT_NAME: result_json(audit.result),
            FRICTION_NAME: None if friction is None else friction_json(friction),
            STUDY_NAME: None if audit.study is None else result_json(audit.study),
        }
        with ExitStack() as stack:  # renames run in reverse order of entering
            for name, text in texts.items():
                if text is not None:
                    write_synced(stack.enter_context(staged(self._dir / name)), text.encode())
            if self._begun is None:
                path = stack.enter_context(staged(self._dir / SIGNALS_NAME))
                write_signals(path, audit.signals, audit.result.log.sha256)
            else:
                (unfinished, written), self._begun = self._begun, None
                with unfinished:
                    written.result()
            for name, text in texts.items():
                if text is None:
                    (self._dir / name).unlink(missing_ok=True)


class _AbandonedError(Exception):
    """The run was not written."""
