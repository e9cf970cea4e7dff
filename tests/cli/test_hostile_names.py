"""Names from logs, files and settings steer no terminal and no CI system, whatever command shows them."""

from __future__ import annotations

import json
import re
import unicodedata
from pathlib import Path

import numpy as np
import pytest
from log_writers import EPOCH, joint_state, write_mcap

from collaudit.reports.values.visible_text import visible, visible_json, visible_lines

_EVIL = (
    "\x1b[31mred",
    "\x1b]0;title\x07",
    "\x1b[2J",
    "\x9b31m",
    "\x07bell",
    "\x08\x08back",
    "\x7fdel",
    "a\rb",
    "a\nb",
    "a\n::error::x",
    "::error::forged",
    " ::warning file=a::x",
    "\t::set-output name=a::b",
    "##[error]forged",
    " ##[group]x",
    "::add-mask::a",
    "\n\n##[section]a",
    "::stop-commands::x",
    "a\u2028::error::b",
    "a\u2029b",
    "\u202eevil",
    "\u2066iso\u2069",
    "\u200bzero",
    "\u200dwide",
    "\u2060word",
    "\ufeffbom",
    "\u061cmark",
    "\u200ertl",
    "a\x00b",
    "a\x0bb",
    "a\x0cb",
    "a\x85b",
    "</script><script>alert(1)</script>",
    "<img src=x onerror=alert(1)>",
    "]]>",
    "&amp;&lt;",
    "'\"`$(id)",
    "`id`",
    "; rm -rf x",
    "|tee x",
    "%0A::error::x",
    "{{7*7}}",
    "{% raw %}",
    "${HOME}",
    "%s%n",
    "\\x1b[31m",
    "=cmd()",
    "[link](javascript:x)",
    "| a | b |",
    "ünïcödé 关节",
)
_CONFIG = """
[robot]
joints = [{joints}]
dh_convention = "standard"
dh = [{rows}]
[detect]
gamma_nm = 4.0
persistence_ms = 25
"""


def _is_harmless(text: str) -> bool:
    bad = [c for c in text if c != "\n" and unicodedata.category(c) in ("Cc", "Cf", "Zl", "Zp")]
    return not bad and not re.search(r"(?m)^\s*(::|##\[)", text)


def _log(folder: Path, names: list[str], topic: str, stem: str) -> Path:
    safe = stem.replace("/", "_").replace("\x00", "")[:60]
    rng = np.random.default_rng(0)
    messages = [
        joint_state(
            names, np.sin(0.02 * k + np.arange(6)), np.cos(0.02 * k + np.arange(6)), rng.normal(0, 1, 6),
            stamp_ns=EPOCH + 4_000_000 * k, topic=topic,
        )
        for k in range(600)
    ]  # fmt: skip
    return write_mcap(folder / f"{safe}.mcap", messages)


@pytest.mark.parametrize("group", range(7))
def test_names_through_every_command(group: int, collaudit, tmp_path: Path) -> None:
    evil = [_EVIL[(7 * group + k) % len(_EVIL)] for k in range(8)]
    names, topic, stem = evil[:6], "/" + evil[6], evil[7] + evil[0]
    log = _log(tmp_path, names, topic, stem)
    config = tmp_path / "c.toml"
    row = "{ a = 0.3, mass_kg = 1.0, com_m = [-0.15, 0, 0], inertia_kg_m2 = [0.1, 0.1, 0.1, 0, 0, 0] }"
    quoted = ", ".join(visible_json(json.dumps(name)) for name in names)
    config.write_text(_CONFIG.format(joints=quoted, rows=", ".join([row] * 6)), encoding="utf-8")
    out = tmp_path / "out"
    for command in (
        ("inspect", log),
        ("inspect", log, "--json"),
        ("init", log),
        ("fit", log, "-c", config),
        ("detect", log, "-c", config),
        ("detect", log, "-c", config, "-v"),
        ("audit", log, "-c", config, "-o", out, "--format", "junit,markdown,sarif"),
        ("audit", log, tmp_path / "none.csv", "-c", config, "-o", out),
    ):
        outcome = collaudit(*command)
        for stream in (outcome.out, outcome.err):
            assert _is_harmless(stream), (command[0], [line for line in stream.split("\n") if not _is_harmless(line)])
        assert "Traceback" not in outcome.err and "this is a bug" not in outcome.err.lower(), outcome.err
    for path in out.rglob("*"):
        if path.suffix in (".json", ".xml", ".md", ".sarif") and path.is_file():
            assert _is_harmless(path.read_text(encoding="utf-8")), path


@pytest.mark.parametrize("text", _EVIL)
def test_one_function_makes_a_name_harmless(text: str) -> None:
    assert "\n" not in visible(text)
    assert _is_harmless(visible(text))
    assert visible(visible(text)) == visible(text)
    assert _is_harmless(visible_lines(text))


def test_every_line_goes_through_one_function() -> None:
    root = Path(__file__).parents[2] / "cli"
    users = {path.name for path in root.rglob("*.py") if "click.echo(" in path.read_text(encoding="utf-8")}
    assert users <= {"console.py", "main.py"}
    assert (root / "main.py").read_text(encoding="utf-8").count("click.echo(") == 1, "the version's"
