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
[log]
joint_states = {topic}
effort_kind = "motor-torque"
[robot]
joints = [{joints}]
dh_convention = "standard"
dh = [{rows}]
[detect]
gamma_nm = 4.0
persistence_ms = 25
"""


_ROW = "{ name = NAME, a = 0.3, mass_kg = 1.0, com_m = [-0.15, 0, 0], inertia_kg_m2 = [0.1, 0.1, 0.1, 0, 0, 0] }"
#: Written for programs: what is in them is data, and no terminal sees it.
_BINARY = (".parquet", ".mcap")
_ANNOTATION = re.compile(r"::(error|warning|notice) ")


def _steers(line: str) -> bool:
    """Whether a character of it controls a terminal, hides, or ends a line; none that is printable does."""
    return not line.isprintable() and any(unicodedata.category(c) in ("Cc", "Cf", "Zl", "Zp") for c in line)


def _harmful(text: str, annotations: bool = False) -> list[str]:
    """Lines that a terminal or a CI system would obey.

    Args:
        text: what was written.
        annotations: whether lines that are annotations of ours may stand in it; each is one line.
    """
    return [
        line
        for line in text.split("\n")
        if _steers(line) or (re.match(r"\s*(::|##\[)", line) and not (annotations and _ANNOTATION.match(line)))
    ]


def _is_harmless(text: str) -> bool:
    return not _harmful(text)


def _log(folder: Path, names: list[str], topic: str, stem: str) -> Path:
    safe = stem.replace("/", "_").replace("\x00", "")[:60]
    rng, joint = np.random.default_rng(0), np.arange(len(names))
    messages = [
        joint_state(
            names, np.sin(0.02 * k + joint), np.cos(0.02 * k + joint), rng.normal(0, 1, joint.size),
            stamp_ns=EPOCH + 4_000_000 * k, topic=topic,
        )
        for k in range(600)
    ]  # fmt: skip
    return write_mcap(folder / f"{safe}.mcap", messages)


@pytest.mark.parametrize("group", [0, *(pytest.param(k, marks=pytest.mark.bench) for k in (1, 2))])
def test_names_through_every_command(group: int, collaudit, tmp_path: Path) -> None:
    evil = [_EVIL[(17 * group + k) % len(_EVIL)] for k in range(19)]
    names, topic, stem = evil[:17], "/" + evil[17], evil[18] + evil[0]
    log = _log(tmp_path, names, topic, stem)
    config = tmp_path / "c.toml"
    quoted = [visible_json(json.dumps(name)) for name in names]
    rows = ", ".join(_ROW.replace("NAME", name) for name in quoted)
    config.write_text(
        _CONFIG.format(topic=visible_json(json.dumps(topic)), joints=", ".join(quoted), rows=rows), encoding="utf-8"
    )
    out, run, store = tmp_path / "out", tmp_path / "run", tmp_path / "store"
    friction = tmp_path / "friction.json"
    formats = "html,json,junit,sarif,markdown,github,text,slack-json,csv,mcap"
    judge = (log, "-c", config)
    known = (*judge, "--friction", friction)
    commands: list[tuple[object, ...]] = [
        ("inspect", log),
        ("inspect", log, "--json"),
        ("init", log, "-o", "-"),
        ("check", config),
        ("fit", *judge, "-o", friction),
        ("detect", *judge, "-v", "-o", run),
        ("recommend", run),
        ("report", run, "-o", tmp_path / "report.html", "--format", formats),
        ("report", run, "-o", "-", "--format", "markdown"),
        ("report", run, "-o", "-", "--format", "github"),
        ("audit", *known, "-o", out, "--store", store, "--robot", evil[0], "--format", "junit,markdown,sarif,github"),
        ("audit", log, tmp_path / "none.csv", "-c", config, "-o", out, "--baseline", out),
        ("trend", store, "-o", tmp_path / "trend.html"),
        ("query", store, "SELECT robot, joint FROM nights"),
    ]
    for command in commands:
        outcome = collaudit(*command)
        for stream in (outcome.out, outcome.err):
            bad = _harmful(stream, annotations="github" in command)
            assert not bad, (command[0], bad[:3])
        assert "Traceback" not in outcome.err and "this is a bug" not in outcome.err.lower(), outcome.err
    assert (run / "audit.json").exists() and (tmp_path / "trend.html").exists(), "the names were judged"
    # The plots' library and script in "assets" are the same whatever the names are.
    texts = [path for path in tmp_path.rglob("*") if path.suffix not in _BINARY and path.parent.name != "assets"]
    written = [path for path in texts if path.is_file() and path != config]
    assert len(written) > 10
    for path in written:
        text = path.read_text(encoding="utf-8")
        assert not _harmful(text, annotations=True), (path, _harmful(text, annotations=True)[:3])
        if path.suffix == ".html":
            assert "<script>alert(1)" not in text and "<img src=x" not in text, path


@pytest.mark.parametrize("text", _EVIL)
def test_one_function_makes_a_name_harmless(text: str) -> None:
    assert "\n" not in visible(text)
    assert _is_harmless(visible(text))
    assert visible(visible(text)) == visible(text)
    assert _is_harmless(visible_lines(text))


def test_every_line_goes_through_one_function() -> None:
    root = Path(__file__).parents[2] / "cli"
    users = {path.name for path in root.rglob("*.py") if "click.echo(" in path.read_text(encoding="utf-8")}
    assert users == {"console.py"}
