"""What the reports of one audit share: the plots' library and the page's own script, once for all of them."""

from __future__ import annotations

from functools import cache
from hashlib import sha256
from pathlib import Path

from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.page.scripts import Script, script_texts

#: The folder in that of an audit.
ASSETS_FOLDER = "assets"


@cache
def shared_scripts(folder: str) -> tuple[Script, ...]:
    """Scripts of a page that lie in a folder, which its policy lets run as its own.

    Args:
        folder: as the page names it, relative to itself.
    """
    return tuple(Script(src=f"{folder}/{name}") for name, _ in _files())


def asset_names() -> list[str]:
    """Names of the files, in the folder of the audit."""
    return [f"{ASSETS_FOLDER}/{name}" for name, _ in _files()]


def write_assets(out: Path) -> None:
    """Write the files into the folder of an audit.

    Raises:
        CollauditError: one cannot be written.
    """
    for name, text in _files():
        atomic_write(out / ASSETS_FOLDER / name, text)


@cache
def _files() -> tuple[tuple[str, str], ...]:
    """Names and texts. The names tell the content: reports of another version keep theirs."""
    return tuple((f"{stem}-{sha256(text.encode()).hexdigest()[:12]}.js", text) for stem, text in script_texts())
