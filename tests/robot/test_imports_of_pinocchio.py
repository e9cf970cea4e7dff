"""Pinocchio stays behind one file, and what needs no model torque does not load it."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
LIBRARY = {"pinocchio", "pin"}


def imports(path: Path) -> set[str]:
    """First parts of the names of every module that a file imports, at its top or inside functions."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None and node.level == 0:
            found.add(node.module.split(".")[0])
    return found


def test_two_files_import_it() -> None:
    parts = ("cli", "core", "reports", "fixtures")
    files = [path for part in parts for path in (PROJECT / part).rglob("*.py")]
    users = [path.relative_to(PROJECT).as_posix() for path in files if imports(path) & LIBRARY]
    assert users == ["core/robot/arm_shapes.py", "core/robot/pinocchio_model.py"], "shapes need Pinocchio's placements"


def test_numeric_imports_no_other_room() -> None:
    for path in (PROJECT / "core" / "numeric").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("collaudit"):
                assert (node.module or "").startswith("collaudit.core.numeric"), path.name


def test_the_names_of_joints_are_read_without_it() -> None:
    """``inspect`` and ``init`` ask for them, and loading the library takes longer than they do."""
    code = (
        "import sys\n"
        "from collaudit.core.robot.robot_description import describe_robot\n"
        "sys.exit('pinocchio' in sys.modules)\n"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
