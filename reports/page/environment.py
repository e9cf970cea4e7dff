"""The template engine: everything is escaped, nothing undefined is skipped."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from collaudit.core.findings import CODES
from collaudit.reports.sections.event_sections import delay_text, near_levels, shortest_push_text
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
_INDENT = re.compile(r"^ +", re.MULTILINE)
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
    made.filters.update(duration=duration, percent=percent, significant=significant, stated=stated)
    made.filters.update(minus=_minus, share=_share, counted=counted, css_text=_css_text)
    made.filters.update(
        rule=rule_text,
        near_levels=near_levels,
        law=law_text,
        clock=clock_text,
        delay=delay_text,
        shortest_push=shortest_push_text,
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
