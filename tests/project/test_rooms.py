"""The floor plan holds: rooms in order, no circles, libraries only where they belong, names that say which."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from functools import cache
from pathlib import Path

from sources import parsed
from user_guide.pages import with_picture
from user_guide.room_picture import ROOMS, module_imports, picture, room_imports, room_of

TOP = Path(__file__).resolve().parents[2]
PACKAGES = ("core", "reports", "fixtures", "cli")
#: Which packages a package may import.
ALLOWED = {
    "core": {"core"},
    "reports": {"core", "reports"},
    "fixtures": {"core", "fixtures"},
    "cli": {"core", "reports", "fixtures", "cli"},
}
#: Libraries that are imported only below these folders.
BELONGS = {
    "pinocchio": ("core/robot/pinocchio_model.py", "core/robot/arm_shapes.py"),
    "coal": ("core/robot/arm_shapes.py",),
    "ruckig": ("core/plan/moves.py",),
    "mcap": ("core/logs/messages/mcap_file.py", "fixtures/", "reports/formats/ros_mcap.py"),
    "mcap_ros1": (),
    "mcap_ros2": (),
    "rosbags": ("core/logs/messages/", "fixtures/", "reports/formats/ros_mcap.py"),
    "sqlite3": ("core/logs/messages/ros2_bag.py",),
    "lz4": ("core/logs/storage/",),
    "zstandard": ("core/logs/storage/",),
    "pyarrow": ("core/logs/storage/readers.py", "core/logs/tables/", "reports/", "fixtures/"),
    "pandas": ("core/api.py",),
    "h5py": ("core/logs/tables/array_files.py",),
    "tsdownsample": ("reports/plots/",),
    "click": ("cli/",),
    "jinja2": ("reports/",),
}


def sources() -> list[Path]:
    return [path for package in PACKAGES for path in sorted((TOP / package).rglob("*.py"))]


@cache
def everything() -> dict[str, set[str]]:
    out: dict[str, set[str]] = {}
    for package in PACKAGES:
        out |= module_imports(TOP / package, f"collaudit.{package}")
    return {name: {other for other in found if other in out} - {name} for name, found in out.items()}


@cache
def rooms() -> dict[str, set[str]]:
    return room_imports(TOP / "core")


def test_every_folder_of_core_is_a_room() -> None:
    found = {p.stem for p in (TOP / "core").iterdir() if p.suffix == ".py" and p.stem != "__init__"}
    found |= {p.name for p in (TOP / "core").iterdir() if (p / "__init__.py").exists()}
    assert found == set(ROOMS)


def test_rooms_import_only_rooms_before_them() -> None:
    wrong = [
        f"{room} imports {other}"
        for room, found in rooms().items()
        for other in found
        if ROOMS.index(other) > ROOMS.index(room)
    ]
    assert not wrong


def test_packages_import_one_way() -> None:
    wrong = [
        f"{module} imports {other}"
        for module, found in everything().items()
        for other in found
        if other.split(".")[1] not in ALLOWED[module.split(".")[1]]
    ]
    assert not wrong


def circles(imports: dict[str, set[str]]) -> list[list[str]]:
    """Groups of names that reach each other (Tarjan's strongly connected components of more than one)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    out: list[list[str]] = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in imports.get(name, ()):
            if other not in index:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], index[other])
        if low[name] == index[name]:
            group = stack[stack.index(name) :]
            del stack[stack.index(name) :]
            if len(group) > 1:
                out.append(sorted(group))

    for name in imports:
        if name not in index:
            visit(name)
    return out


def test_a_circle_is_seen() -> None:
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == [["a", "b", "c"]]


def test_no_modules_import_each_other() -> None:
    """A package's ``__init__`` hands on names of its modules: importing it is not importing them in a circle."""
    imports = everything()
    packages = {module for module in imports if any(other.startswith(f"{module}.") for other in imports)}
    assert not circles({m: {o for o in found if o not in packages} for m, found in imports.items()})


def test_rooms_make_no_circles() -> None:
    assert not circles(rooms())


def test_folders_of_logs_make_no_circles() -> None:
    """Below core/logs, folders are rooms as well."""
    rooms: dict[str, set[str]] = defaultdict(set)
    for module, found in everything().items():
        if room_of(module) == "logs":
            own = ".".join(module.split(".")[:4])
            rooms[own] |= {".".join(other.split(".")[:4]) for other in found if room_of(other) == "logs"} - {own}
    rooms.pop("collaudit.core.logs", None)
    assert not circles(dict(rooms))


def test_libraries_are_imported_where_they_belong() -> None:
    wrong = []
    for path in sources():
        place = path.relative_to(TOP).as_posix()
        for node in ast.walk(parsed(path)):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
                names = [node.module]
            for library in (name.partition(".")[0] for name in names):
                if library in BELONGS and not place.startswith(BELONGS[library] or ("-",)):
                    wrong.append(f"{place} imports {library}")
    assert not wrong


def test_no_hall_has_more_than_twenty_modules() -> None:
    count: dict[str, int] = defaultdict(int)
    for path in sources():
        if path.name != "__init__.py":
            count[path.parent.relative_to(TOP).as_posix()] += 1
    assert not {folder: number for folder, number in count.items() if number > 20}


def test_no_two_modules_share_a_name() -> None:
    """Commands are named as they are typed and lie in a folder that says so."""
    places: dict[str, list[str]] = defaultdict(list)
    for path in sources():
        if path.name != "__init__.py" and path.parent != TOP / "cli" / "commands":
            places[path.stem].append(path.relative_to(TOP).as_posix())
    assert not {name: found for name, found in places.items() if len(found) > 1}


def test_every_room_says_what_it_is_for() -> None:
    """Three lines: what it is, what comes in and goes out, what belongs elsewhere."""
    silent = []
    for path in sources():
        if path.name == "__init__.py" and path.parent.parent != TOP:
            text = ast.get_docstring(parsed(path)) or ""
            if not {"In:", "Out:", "Elsewhere:"} <= set(text.split()):
                silent.append(path.parent.relative_to(TOP).as_posix())
    assert not silent


def test_tests_mirror_the_rooms() -> None:
    folders = {p.name for p in (TOP / "tests").iterdir() if p.is_dir()}
    without = {"errors", "findings", "data", "api"}  # types; tested by what makes and shows them
    assert set(ROOMS) - without <= folders


def test_the_picture_is_that_of_the_code() -> None:
    page = (TOP / "docs" / "architecture.md").read_text(encoding="utf-8")
    assert f"```mermaid\n{picture(TOP / 'core')}```" in page, "run: make docs"
    assert with_picture(page) == page, "run: make docs"


def test_the_ten_types_of_the_way_exist() -> None:
    page = (TOP / "docs" / "architecture.md").read_text(encoding="utf-8")
    figure = page.partition("%% ten types")[2].partition("```")[0]
    named = set(re.findall(r"\b[A-Z][a-z]+[A-Z]\w+\b|\bPrepared\b|\bResidual\b", figure))
    code = "\n".join(path.read_text(encoding="utf-8") for path in (TOP / "core").rglob("*.py"))
    assert len(named) == 10
    assert [name for name in named if not re.search(rf"^class {name}\b", code, re.MULTILINE)] == []
