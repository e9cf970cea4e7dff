"""A bar on stderr while something takes long: how far it is, and how long it will take."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

_STEPS = 1000
#: Clears a line; of a bar that has ended, which stands above the cursor.
_CLEAR, _CLEAR_ABOVE = "\r\x1b[K", "\x1b[1A\x1b[2K"

_active: list[object] = []


@contextmanager
def progress(label: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on stderr while it is a terminal; yields ``report(done, total)``."""
    if not sys.stderr.isatty():
        yield lambda _done, _total: None
        return
    with click.progressbar(length=_STEPS, label=label, file=sys.stderr) as bar:

        def report(done: int, total: int) -> None:
            if total > 0:
                bar.update(max(0, _STEPS * done // total - bar.pos))

        _active.append(bar)
        try:
            yield report
        finally:
            _active.remove(bar)
    sys.stderr.write(_CLEAR_ABOVE)


@contextmanager
def above_progress() -> Iterator[None]:
    """What is written inside stands in place of the bar, which is drawn again below it."""
    if _active:
        sys.stderr.write(_CLEAR)
    yield
