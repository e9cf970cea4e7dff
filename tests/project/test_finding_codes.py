"""Codes of findings are for readers: no code looks for them, and they come with the severities of the table."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from sources import parsed

from collaudit.core.findings.finding_kinds import KINDS

PROJECT = Path(__file__).resolve().parents[2]
FOLDERS = ("core", "cli", "reports", "fixtures")
TABLE = set((PROJECT / "core" / "findings").glob("*.py"))
SOURCES = sorted(p for folder in FOLDERS for p in (PROJECT / folder).rglob("*.py"))


def steering(tree: ast.AST) -> Iterator[ast.AST]:
    """Places that compare a code, match its prefix, look it up, or collect codes to look them up in."""
    yield from (node for node in ast.walk(tree) if steers(node))


def steers(node: ast.AST) -> bool:
    match node:
        case ast.Compare(left=left, comparators=others):
            sides = [left, *others]
            number = any(is_number(side) for side in sides)
            return any(is_finding_code(side) or (is_code_field(side) and not number) for side in sides)
        case ast.Call(func=ast.Attribute(value=text, attr="startswith" | "endswith")):
            return is_code_field(text)
        case ast.Call(func=ast.Attribute(attr="get" | "index" | "count"), args=arguments):
            return any(is_code_field(argument) for argument in arguments)
        case ast.Subscript(slice=key):
            return is_code_field(key)
        case ast.MatchValue(value=value):
            return is_finding_code(value)
        case ast.Dict(keys=items) | ast.Set(elts=items):
            return any(item is not None and is_finding_code(item) for item in items)
    return False


def is_finding_code(node: ast.AST) -> bool:
    if isinstance(node, ast.Tuple | ast.List | ast.Set):
        return any(is_finding_code(item) for item in node.elts)
    return isinstance(node, ast.Constant) and node.value in KINDS


def is_code_field(node: ast.AST) -> bool:
    return isinstance(node, ast.Attribute) and node.attr == "code"


def is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int)


def test_no_module_steers_by_the_code_of_a_finding() -> None:
    found = [
        f"{path.relative_to(PROJECT)}:{node.lineno}"  # type: ignore[attr-defined]
        for path in SOURCES
        if path not in TABLE
        for node in steering(parsed(path))
    ]
    assert not found, "read finding.effect, or make the fact a field"


@pytest.mark.parametrize(
    "line",
    [
        'f.code == "time-gap"',
        'f.code in ("time-gap", "log-nan")',
        "f.code == wanted",
        'wanted in {"time-gap": 1}',
        'f.code.startswith("effort-")',
        '_FORBID = frozenset({"time-gap"})',
        '_PLACE = {"effort-gain": "log.units"}',
        "_PLACE[f.code]",
        '_PLACE.get(f.code, "")',
    ],
)
def test_every_way_of_steering_is_seen(line: str) -> None:
    assert list(steering(ast.parse(line)))


def test_findings_are_made_with_severities_of_the_table() -> None:
    made = set()
    for path in SOURCES:
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Finding":
                code, severity = node.args[:2] if len(node.args) > 1 else (None, None)
                if isinstance(code, ast.Constant):
                    made.add(code.value)
                    for part in ast.walk(severity):
                        if isinstance(part, ast.Constant) and part.value in ("info", "warning", "error"):
                            assert part.value in KINDS[code.value].effects, f"{path.name}: {code.value}"
    assert len(made) > 40


def test_codes_that_change_a_verdict_are_named_in_a_test() -> None:
    texts = "".join(path.read_text(encoding="utf-8") for path in (PROJECT / "tests").rglob("*.py"))
    effective = [code for code, kind in KINDS.items() if set(kind.effects.values()) - {"none"}]
    assert len(effective) > 20
    assert [code for code in effective if f'"{code}"' not in texts] == []
