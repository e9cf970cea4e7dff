"""What is shipped is what is tested: package list, disk and installed files agree."""

import configparser
import importlib.metadata
import os
import zipfile
from pathlib import Path

import pytest

import collaudit.core

PROJECT = Path(__file__).resolve().parents[2]
PARTS = ("cli", "core", "reports", "fixtures")


def _setup() -> configparser.ConfigParser:
    parser = configparser.ConfigParser()
    parser.read(PROJECT / "setup.cfg", encoding="utf-8")
    return parser


def _packages_on_disk() -> set[str]:
    files = [path for part in PARTS for path in (PROJECT / part).rglob("*.py") if "__pycache__" not in path.parts]
    return {"collaudit." + ".".join(path.parent.relative_to(PROJECT).parts) for path in files}


def test_every_package_on_disk_is_listed_and_mapped() -> None:
    options = _setup()["options"]
    listed = options["packages"].split()
    mapped = dict(row.split(" = ") for row in options["package_dir"].strip().splitlines())
    assert sorted(listed) == sorted(_packages_on_disk())
    assert mapped == {name: name.removeprefix("collaudit.").replace(".", "/") for name in listed}


def test_every_package_has_an_init() -> None:
    for name in _packages_on_disk():
        folder = PROJECT / name.removeprefix("collaudit.").replace(".", "/")
        assert (folder / "__init__.py").is_file(), folder


def test_nothing_is_named_like_a_module_of_the_standard_library() -> None:
    for part in PARTS:
        for name in ("types.py", "csv.py", "json.py"):
            assert not list((PROJECT / part).rglob(name))


def test_collaudit_itself_is_a_namespace() -> None:
    assert not (PROJECT / "collaudit").exists()
    import collaudit

    assert getattr(collaudit, "__file__", None) is None


def _in_test_environment() -> bool:
    """Whether these tests run in the environment of ``make test``, on the wheel."""
    return bool(os.environ.get("COLLAUDIT_TEST_WHEEL"))


@pytest.mark.skipif(not _in_test_environment(), reason="only make test runs on the wheel")
def test_the_tested_package_is_the_installed_wheel() -> None:
    path = Path(collaudit.core.__file__)
    assert "site-packages" in path.parts
    assert not path.is_relative_to(PROJECT / "core")


@pytest.mark.skipif(not _in_test_environment(), reason="only make test builds the wheel")
def test_the_wheel_holds_every_source_file() -> None:
    with zipfile.ZipFile(os.environ["COLLAUDIT_TEST_WHEEL"]) as wheel:
        inside = {name for name in wheel.namelist() if name.startswith("collaudit/")}
    expected = {
        "collaudit/" + path.relative_to(PROJECT).as_posix()
        for part in PARTS
        for path in (PROJECT / part).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert inside == expected


def test_version_and_entry_point() -> None:
    assert importlib.metadata.version("collaudit") == _setup()["metadata"]["version"]
    scripts = importlib.metadata.entry_points(group="console_scripts", name="collaudit")
    assert {script.value for script in scripts} == {"collaudit.cli.main:main"}


def test_dependencies_have_lower_bounds_only_and_a_line_on_why() -> None:
    page = (PROJECT / "docs" / "install.md").read_text(encoding="utf-8")
    setup = _setup()
    groups = [setup["options"]["install_requires"], *setup["options.extras_require"].values()]
    for row in filter(None, "\n".join(groups).splitlines()):
        name, *bound = row.split()
        if name.startswith("collaudit["):
            continue
        assert bound[:1] == [">="], row
        assert len(bound) == 2, row
        assert name in page, f"docs/install.md does not mention {name}"
