"""A run's folder whose signals are written while the log is still judged: the same files, or none."""

import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import samples

from collaudit.core.errors import CollauditError
from collaudit.core.numeric import parallel
from collaudit.reports.files.run_files import RunFolder, read_run, write_run


@pytest.fixture(autouse=True)
def two_threads() -> Iterator[None]:
    before = parallel.threads()
    parallel.use_threads(2)
    yield
    parallel.use_threads(before)


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_signals_that_are_written_early_make_the_same_files(tmp_path: Path) -> None:
    audit = samples.failed(3000)
    write_run(tmp_path / "after", audit, None)
    with RunFolder(tmp_path / "beside") as run:
        run.take_signals(audit.signals, audit.result.log.sha256)
        assert not (tmp_path / "beside" / "signals.parquet").exists(), "nothing appears before the verdict"
        run.write(audit, None)
    assert files(tmp_path / "beside") == files(tmp_path / "after")


def test_a_log_that_fails_later_leaves_nothing(tmp_path: Path) -> None:
    audit = samples.failed(3000)
    with pytest.raises(ZeroDivisionError), RunFolder(tmp_path / "run") as run:
        run.take_signals(audit.signals, audit.result.log.sha256)
        raise ZeroDivisionError
    assert not (tmp_path / "run").exists()


def test_a_log_that_fails_later_leaves_an_earlier_run_as_it_was(tmp_path: Path) -> None:
    audit = samples.failed(3000)
    write_run(tmp_path, audit, None)
    before = files(tmp_path)
    with pytest.raises(ZeroDivisionError), RunFolder(tmp_path) as run:
        run.take_signals(replace(audit.signals, gamma_nm=np.ones(6)), audit.result.log.sha256)
        raise ZeroDivisionError
    assert files(tmp_path) == before
    assert read_run(tmp_path).result == audit.result


def test_what_fails_while_the_signals_are_written_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("collaudit.reports.files.signals_file.write_signals", full)
    audit = samples.failed(3000)
    with pytest.raises(CollauditError, match="No space left"), RunFolder(tmp_path / "run") as run:
        run.take_signals(audit.signals, audit.result.log.sha256)
        run.write(audit, None)
    assert not any((tmp_path / "run").iterdir())


@pytest.mark.parametrize("refused", ["two threads", "another thread"])
def test_without_a_further_thread_they_are_written_at_the_end(
    refused: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def start(self: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    if refused == "two threads":
        parallel.use_threads(1)
    else:
        monkeypatch.setattr(threading.Thread, "start", start)
    audit = samples.failed(3000)
    with RunFolder(tmp_path / "run") as run:
        run.take_signals(audit.signals, audit.result.log.sha256)
        assert not (tmp_path / "run").exists()
        run.write(audit, None)
    assert read_run(tmp_path / "run").result == audit.result
    assert len(files(tmp_path / "run")) == 2
