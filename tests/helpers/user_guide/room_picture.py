"""The rooms of core and the imports between them, read from the code: the picture of docs/architecture.md."""

from __future__ import annotations

import ast
from collections import defaultdict
from functools import cache
from pathlib import Path

#: The rooms in the order in which data flows: a room imports rooms before it, never after.
ROOMS = (
    "errors",
    "small_files",
    "findings",
    "numeric",
    "vendors",
    "friction_laws",
    "data",
    "config",
    "robot",
    "logs",
    "conditioning",
    "torque_table",
    "arm_states",
    "prepare",
    "identification",
    "friction",
    "residual",
    "cycles",
    "detection",
    "contacts",
    "scoring",
    "recommend",
    "verdict",
    "causes",
    "history",
    "fitting",
    "plan",
    "audit",
    "api",
)
#: Rooms that every other one may use; arrows to them would hide the others.
_EVERYWHERE = frozenset({"errors", "small_files", "findings", "numeric", "vendors", "data", "config"})


@cache
def module_imports(top: Path, package: str) -> dict[str, set[str]]:
    """Modules below a folder to the modules of collaudit that they import, anywhere in their code.

    Args:
        top: folder of the package's sources.
        package: its name, such as ``collaudit.core``.
    """
    out = {}
    for path in sorted(top.rglob("*.py")):
        parts = path.relative_to(top).with_suffix("").parts
        name = ".".join((package, *(parts[:-1] if parts[-1] == "__init__" else parts)))
        found: set[str] = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("collaudit."):
                found.add(node.module)
                found.update(f"{node.module}.{alias.name}" for alias in node.names)
            elif isinstance(node, ast.Import):
                found.update(alias.name for alias in node.names if alias.name.startswith("collaudit."))
        out[name] = found
    return out


def room_of(module: str) -> str | None:
    """The room of core that a module lies in; None outside core."""
    parts = module.split(".")
    return parts[2] if parts[:2] == ["collaudit", "core"] and len(parts) > 2 else None


def room_imports(core: Path) -> dict[str, set[str]]:
    """Rooms to the other rooms they import."""
    out: dict[str, set[str]] = defaultdict(set)
    for module, found in module_imports(core, "collaudit.core").items():
        room = room_of(module)
        if room is not None:
            out[room] |= {other for name in found if (other := room_of(name)) is not None and other != room}
    return dict(out)


def picture(core: Path) -> str:
    """The rooms as a Mermaid flow chart: an arrow from each room to those that use it, save those used everywhere.

    An arrow is left out where a longer way says the same.
    """
    imports = {room: found - _EVERYWHERE for room, found in room_imports(core).items() if room not in _EVERYWHERE}
    beyond: dict[str, set[str]] = {}
    for room in (r for r in ROOMS if r in imports):
        beyond[room] = set().union(*({other} | beyond.get(other, set()) for other in imports[room]))
    lines = ["flowchart LR"]
    for room in (r for r in ROOMS if r in imports):
        indirect = set().union(*(beyond.get(other, set()) for other in imports[room]))
        lines += [f"    {other} --> {room}" for other in ROOMS if other in imports[room] - indirect]
    return "\n".join(lines) + "\n"
