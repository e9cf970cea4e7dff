"""One writer of JSON: no result can hold NaN, whichever command prints it."""

from __future__ import annotations

import ast
import json
import math
from pathlib import Path

import numpy as np
import pytest

from collaudit.reports.files.written_files import json_text

PROJECT = Path(__file__).resolve().parents[2]
#: Who else may call json.dumps, since what they write is no result; all refuse NaN.
OTHERS = {
    "cli/main.py": "what went wrong, for scripts",
    "fixtures/truth.py": "known truth",
    "reports/files/signals_file.py": "metadata inside Parquet",
    "reports/page/html.py": "curves inside the page, on one line",
}


def _dumps_calls(path: Path) -> list[ast.Call]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    calls = [(node, ast.unparse(node.func)) for node in ast.walk(tree) if isinstance(node, ast.Call)]
    own = ("json.dumps", "json.dump", "dumps", "dump")
    return [call for call, name in calls if name in own or name.endswith((".dump_json", ".model_dump_json"))]


def test_nobody_else_writes_json() -> None:
    found = {}
    for part in ("cli", "reports", "fixtures"):
        for path in (PROJECT / part).rglob("*.py"):
            if calls := _dumps_calls(path):
                found[path.relative_to(PROJECT).as_posix()] = calls
    assert found.keys() == {"reports/files/written_files.py", *OTHERS}
    for calls in found.values():
        for call in calls:
            assert any(k.arg == "allow_nan" and ast.unparse(k.value) == "False" for k in call.keywords)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, np.float64("nan")])
def test_what_is_not_finite_is_null(value: float) -> None:
    assert json.loads(json_text({"a": [value, 1.5]}, indent=2)) == {"a": [None, 1.5]}


def test_small_numbers_keep_the_bytes_of_files_that_are_out() -> None:
    assert json_text([1e-05, 0.1, 1e22, 3]) == "[\n 1e-05,\n 0.1,\n 1e+22,\n 3\n]\n"


def test_a_file_name_that_is_no_text_is_written_visibly() -> None:
    assert json_text("a\udcff", indent=2) == '"a\\\\udcff"\n'
