"""docs/api.md: the public calls of ``core/api.py`` and the types that they return, from signatures and docstrings."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import fields, is_dataclass

from docstring_parser import DocstringStyle, parse

from collaudit.core import api
from collaudit.core.data.audit_result import Audit, AuditResult, FrictionFile, RecommendedRule
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.signals import Signals

#: Types that a caller reads, in the order in which a script meets them.
RETURNED = (JointLog, FrictionFile, Audit, AuditResult, Signals, RecommendedRule)


def api_page() -> str:
    """One line a call and one a field."""
    lines = [
        "# Python API",
        "",
        "The calls of `collaudit.core.api`, by their first sentence, and what they return.",
        "[Python](python.md) shows them in use; `help(api.audit)` has the arguments.",
        "Types of result files are in [`schemas/`](schemas/).",
        "",
        "_Generated from signatures and docstrings by `make docs`._",
        "",
    ]
    calls = [getattr(api, name) for name in api.__all__]
    lines += [_call_row(call) for call in calls if inspect.isfunction(call)]
    for kind in RETURNED:
        lines += ["", f"## {kind.__name__}", "", _first(kind), "", *_field_rows(kind)]
    return "\n".join(lines) + "\n"


def _call_row(call: Callable[..., object]) -> str:
    signature = inspect.signature(call)
    shown = [name if one.default is one.empty else f"{name}=…" for name, one in signature.parameters.items()]
    returned = str(signature.return_annotation)
    return f"- `{call.__name__}({', '.join(shown)})` → `{returned}`: {_first(call)}"


def _first(thing: object) -> str:
    """The first sentence of a docstring."""
    return _plain((inspect.getdoc(thing) or "").partition("\n\n")[0])


def _field_rows(kind: type) -> list[str]:
    """What the docstring says of each field; the others by their names."""
    assert is_dataclass(kind)
    told: dict[str, str] = {}
    for one in parse(inspect.getdoc(kind) or "", style=DocstringStyle.GOOGLE).params:
        told |= dict.fromkeys(one.arg_name.split(", "), _plain(one.description or ""))
    names = [one.name for one in fields(kind) if not one.name.startswith("_")]
    rest = ", ".join(f"`{name}`" for name in names if not told.get(name))
    rows = [f"- `{name}`: {told[name]}" for name in names if told.get(name)]
    return [*rows, *([f"- {rest}: as the name says."] if rest else [])]


def _plain(text: str) -> str:
    """On one line of Markdown, without roles and without numbers of equations, which are those of another page."""
    text = re.sub(r",? eq\. \(\d+\)", "", " ".join(text.split()))
    return re.sub(r":\w+:`([^`]*)`", r"`\1`", text).replace("``", "`")
