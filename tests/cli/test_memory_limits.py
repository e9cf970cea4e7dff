"""A limit of memory, a second Ctrl-C, a file that ends too early, a reader that left: the right code, and no hang."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from collaudit.cli import main as entry

MAIN = "from collaudit.cli.main import main; main()"


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux counts what RLIMIT_DATA limits")
@pytest.mark.parametrize("megabytes", [90, 160, 240, 280])
def test_a_limit_of_memory_ends_a_command_with_its_verdict_or_with_not_judged(
    arm: Any, tmp_path: Path, megabytes: int
) -> None:
    import resource

    limit = megabytes << 20
    done = subprocess.run(
        [sys.executable, "-c", MAIN, "detect", arm.pushed, "-c", arm.config, "-o", tmp_path / "run"],
        capture_output=True,
        text=True,
        timeout=20,  # no library asks for ever
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (limit, limit)),
    )
    if (tmp_path / "run").exists():
        assert done.returncode == 1 and sorted(path.name for path in (tmp_path / "run").iterdir())[0] == "audit.json"
    elif done.returncode not in (-signal.SIGABRT, -signal.SIGSEGV):  # Arrow's, within some 10 MB of what is enough
        assert done.returncode == 3, done.stderr
        assert "not enough memory" in done.stderr or "no thread could be started" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of address space differ elsewhere")
@pytest.mark.parametrize("megabytes", [60, 300, 460, 560])
def test_a_limit_of_address_space_never_ends_in_a_broken_policy(arm: Any, tmp_path: Path, megabytes: int) -> None:
    import resource

    limit = megabytes << 20
    done = subprocess.run(
        [sys.executable, "-c", MAIN, "detect", arm.clean, "-c", arm.config, "-o", tmp_path / "run"],
        capture_output=True,
        text=True,
        timeout=30,  # no thread is waited for that had no memory to start in
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)),
    )
    assert done.returncode in (0, 3, -signal.SIGABRT, -signal.SIGSEGV), done.stderr
    if done.returncode == 0:
        assert (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("raised", "code"), [("MemoryError", 3), ("ImportError", 3), ("SystemError", 3), ("KeyboardInterrupt", 130)]
)
def test_an_error_for_which_no_words_can_be_found_is_no_verdict(raised: str, code: int) -> None:
    broken = f"import collaudit.cli.main as m\ndef note(text): raise {raised}\nm.note = note\nm.main()"
    done = subprocess.run(
        [sys.executable, "-c", broken, "inspect", "none.csv"], capture_output=True, text=True, timeout=20, check=False
    )
    assert done.returncode == code
    assert "Traceback" not in done.stderr and ("nothing was judged" in done.stderr) == (code == 3)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux counts what RLIMIT_DATA limits")
def test_what_crashes_at_the_end_for_want_of_memory_changes_no_exit_code(arm: Any, tmp_path: Path) -> None:
    import resource

    crash = "import atexit, os; atexit.register(os.abort); "
    done = subprocess.run(
        [sys.executable, "-c", crash + MAIN, "detect", arm.pushed, "-c", arm.config, "-o", tmp_path / "run"],
        stderr=subprocess.PIPE,
        text=True,
        timeout=20,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (160 << 20, 160 << 20)),
    )
    assert done.returncode == 3 and "not enough memory" in done.stderr


def test_a_second_interrupt_does_not_stop_the_clearing_up() -> None:
    before = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, entry._interrupt)
    try:
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGINT)  # would be raised here
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (SystemError("error return without exception set"), 3, "as where memory is short: nothing was judged"),
        (EOFError("Ran out of input"), 2, "a file ended too early: Ran out of input"),
        (RuntimeError("can't start new thread"), 3, "no thread could be started"),
    ],
)
def test_what_a_file_that_ends_too_early_or_no_thread_says(
    error: Exception, code: int, said: str, collaudit: Callable[..., Any], arm: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr("collaudit.core.logs.log_description.describe", refused)
    done = collaudit("inspect", arm.pushed)
    assert done.code == code and said in done.err
    assert "interrupted" not in done.err


@pytest.mark.parametrize("json", [(), ("--json",)])
@pytest.mark.parametrize("closed", [("stdout",), ("stderr",), ("stdout", "stderr")])
def test_an_error_that_nobody_reads_keeps_its_code(closed: tuple[str, ...], json: tuple[str, ...]) -> None:
    """Not 1, which would say that a policy is broken."""
    unread, written = os.pipe()
    os.close(unread)
    streams: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | dict.fromkeys(closed, written)
    try:
        done = subprocess.run(
            [sys.executable, "-c", MAIN, "inspect", "none.csv", *json], **streams, text=True, timeout=20, check=False
        )
    finally:
        os.close(written)
    assert done.returncode == 2
    assert done.stderr is None or ("Traceback" not in done.stderr and "no such file" in done.stderr)
    assert not json or done.stdout is None or '"exit_code": 2' in done.stdout
