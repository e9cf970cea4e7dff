"""The page's scripts and their hashes, which alone its content security policy lets run.

uPlot is read as it stands in the package ``uplot-python``; that package is never imported, since importing it would
import IPython.
"""

from __future__ import annotations

import re
import zlib
from base64 import b64encode
from dataclasses import dataclass, field
from functools import cache
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path

from markupsafe import Markup

from collaudit.core.errors import CollauditError

_ASSETS = Path(__file__).resolve().parent / "assets"
_END = re.compile(r"</(?=script|style)", re.IGNORECASE)
_INDENT = re.compile(r"^[ \t]+", re.MULTILINE)
_COMMENT_LINE = re.compile(r"^//[^\n]*\n", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Script:
    """A script, the source expression of its hash, and whether it stands in the page deflated and as base64.

    The page's own script unpacks such a library and inserts it; the policy lets it run by the hash of its text. One
    with ``src`` lies beside the page, and a hash is of no use: browsers compare none of files that no server sends.
    """

    text: Markup = field(default_factory=Markup)
    hash: str = "'self'"
    packed: bool = False
    src: str = ""


@cache
def page_scripts() -> tuple[Script, ...]:
    """uPlot and the page's own script.

    Raises:
        CollauditError: uPlot's files are missing.
    """
    library = script_texts()[0][1].encode()
    packed = Markup(b64encode(zlib.compress(library, 9)).decode("ascii"))
    return Script(packed, _hash(library), packed=True), own_script("signal_plots.js")


def script_texts() -> tuple[tuple[str, str], tuple[str, str]]:
    """Name and text of uPlot and of the page's own script, as files of their own.

    Raises:
        CollauditError: uPlot's files are missing.
    """
    own = (_ASSETS / "signal_plots.js").read_text(encoding="utf-8")
    return ("uplot", _shortened(_plot_file("uPlot.iife.js"))), ("signal-plots", own)


@cache
def own_script(name: str) -> Script:
    """One of the page's own scripts."""
    return _script((_ASSETS / name).read_text(encoding="utf-8"))


@cache
def page_style() -> Markup:
    """uPlot's style."""
    return _safe(_plot_file("uPlot.min.css"))


def _plot_file(name: str) -> str:
    spec = find_spec("uplot")
    for folder in [] if spec is None else spec.submodule_search_locations or []:
        path = Path(folder) / "static" / name
        if path.is_file():
            return path.read_text(encoding="utf-8")
    raise CollauditError(
        "the plots' library is missing",
        where=f"uplot/static/{name}",
        expected="the package uplot-python",
        hint="python -m pip install uplot-python",
    )


def _shortened(text: str) -> str:
    """Without indentation and lines that are only a comment; its head, with name and licence, stays."""
    return _COMMENT_LINE.sub("", _INDENT.sub("", text))


def _script(text: str) -> Script:
    safe = _safe(text)
    return Script(safe, _hash(safe.encode()))


def _hash(text: bytes) -> str:
    return f"'sha256-{b64encode(sha256(text).digest()).decode()}'"


def _safe(text: str) -> Markup:
    """Text that cannot end the element it stands in."""
    return Markup(_END.sub(r"<\\/", text))
