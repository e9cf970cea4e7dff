"""A line on stderr while something takes longer than a second: how far it is, and how long it will take."""

from __future__ import annotations

import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

#: Nothing is shown of what takes no longer; with the start of the process, a terminal moves within two seconds.
PATIENCE_S = 1.0
_REDRAW_S = 0.5
_BAR = 24
_CLEAR = "\r\x1b[K"

_active: list[ProgressLine] = []


class ProgressLine:
    """One line that is drawn over itself.

    Args:
        label: what is done.
        write: puts text on the terminal.
        clock: seconds that only grow.
        width: columns of the terminal.
    """

    def __init__(
        self,
        label: str,
        write: Callable[[str], object],
        clock: Callable[[], float] = time.monotonic,
        width: int = 80,
    ) -> None:
        self._label, self._write, self._clock, self._width = label, write, clock, width
        self._began = clock()
        self._done, self._total = 0, 0
        self._shown = False
        self._lock = threading.RLock()

    def report(self, done: int, total: int) -> None:
        """So much of the whole is done."""
        with self._lock:
            forward = done > self._done or total != self._total
            self._done, self._total = done, total
        if forward:
            self.draw()

    def text(self) -> str:
        """The line as it is now; empty in the first second."""
        elapsed = self._clock() - self._began
        if elapsed < PATIENCE_S:
            return ""
        if not 0 < self._done < self._total:
            return f"{self._label} … {_time(elapsed)}"[: self._width - 1]
        share = self._done / self._total
        filled = int(_BAR * share)
        bar = "#" * filled + "-" * (_BAR - filled)
        left = _time(max(1.0, elapsed * (1 - share) / share))
        return f"{self._label} [{bar}] {100 * share:3.0f} %, about {left} left"[: self._width - 1]

    def draw(self) -> None:
        """Draw the line over what stands there."""
        with self._lock:
            text = self.text()
            if text:
                self._write(_CLEAR + text)
                self._shown = True

    def clear(self) -> None:
        """Take the line away."""
        with self._lock:
            if self._shown:
                self._write(_CLEAR)
                self._shown = False


@contextmanager
def progress(label: str) -> Iterator[Callable[[int, int], None]]:
    """A line on stderr while it is a terminal; yields ``report(done, total)``.

    It shows the share that is done and the time left as far as ``report`` is called, else the time that has passed.
    """
    if not sys.stderr.isatty():
        yield lambda _done, _total: None
        return
    line = ProgressLine(label, _to_stderr, width=shutil.get_terminal_size().columns)
    over = threading.Event()
    painter = threading.Thread(target=_paint, args=(line, over), daemon=True)
    _active.append(line)
    painter.start()
    try:
        yield line.report
    finally:
        over.set()
        painter.join()
        _active.remove(line)
        line.clear()


@contextmanager
def above_progress() -> Iterator[None]:
    """What is written inside stands above the line, which moves down."""
    line = _active[-1] if _active else None
    if line is None:
        yield
        return
    with line._lock:
        line.clear()
        yield
        line.draw()


def _paint(line: ProgressLine, over: threading.Event) -> None:
    while not over.wait(_REDRAW_S):
        line.draw()


def _to_stderr(text: str) -> None:
    sys.stderr.write(text)
    sys.stderr.flush()


def _time(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole} s" if whole < 120 else f"{whole // 60} min {whole % 60:02d} s"
