"""The frame of every page: the template engine, which escapes everything, and scripts, which alone its policy lets run.

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

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from collaudit.core.errors import CollauditError
from collaudit.core.findings import CODES
from collaudit.reports.files.written_files import atomic_write
from collaudit.reports.sections.event_sections import delay_text, near_levels
from collaudit.reports.values.numbers import duration, percent, significant, stated
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import (
    STATEMENT,
    VERDICT_SENTENCE,
    VERDICT_WORD,
    clock_text,
    counted,
    law_text,
    rule_text,
)

_FOLDER = Path(__file__).resolve().parent / "templates"
_INDENT = re.compile(r"^[ \t]+", re.MULTILINE)
_MINUS = re.compile(r"(?<![\w.)])-(?=\d)")


@cache
def environment() -> Environment:
    """The engine with collaudit's filters; built once."""
    made = Environment(
        loader=FileSystemLoader(_FOLDER),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=_shown,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters.update(
        duration=duration,
        percent=percent,
        significant=significant,
        stated=stated,
        minus=_minus,
        share=_share,
        counted=counted,
        css_text=_css_text,
        rule=rule_text,
        near_levels=near_levels,
        law=law_text,
        clock=clock_text,
        delay=delay_text,
    )
    made.globals.update(
        statement=STATEMENT,
        verdict_word=VERDICT_WORD,
        verdict_sentence=VERDICT_SENTENCE,
        codes=CODES,
        scripts=(),
        running_head="",
        style=Markup(_INDENT.sub("", (_FOLDER / "style.css").read_text(encoding="utf-8"))),
    )
    return made


def _shown(value: object) -> object:
    """What the page shows of a value: text without hidden characters; markup is the engine's own."""
    if isinstance(value, Markup) or not isinstance(value, str):
        return value
    return visible(value)


def _share(value: float) -> str:
    """A share somebody chose, as per cent."""
    return f"{stated(100 * value)} %"


def _css_text(text: str) -> Markup:
    """A CSS string; all but letters, digits and a few harmless marks are escapes."""
    shown = visible(text)[:120]
    inside = "".join(c if c.isascii() and (c.isalnum() or c in " .,:-_()") else f"\\{ord(c):06x}" for c in shown)
    return Markup(f'"{inside}"')


def _minus(text: str) -> str:
    """With a true minus before numbers."""
    return _MINUS.sub("−", text)


_ASSETS = Path(__file__).resolve().parent / "assets"
_END = re.compile(r"</(?=script|style)", re.IGNORECASE)
_COMMENT_LINE = re.compile(r"^//[^\n]*\n", re.MULTILINE)
#: The folder in that of an audit.
ASSETS_FOLDER = "assets"


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
    return Script(packed, _hash(library), packed=True), _script(script_texts()[1][1])


def script_texts() -> tuple[tuple[str, str], tuple[str, str]]:
    """Name and text of uPlot with the drawing of the arm, and of the page's own script, as files of their own.

    Raises:
        CollauditError: uPlot's files are missing.
    """
    player, own = ((_ASSETS / name).read_text(encoding="utf-8") for name in ("arm_player.js", "signal_plots.js"))
    library = _plot_file("uPlot.iife.js") + player
    return ("uplot", _shortened(library)), ("signal-plots", _shortened(own))


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
