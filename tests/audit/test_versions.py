"""Versions in a result are those of what is installed, though they are read from names of folders."""

from __future__ import annotations

import importlib.metadata
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from collaudit.core import provenance
from collaudit.core.provenance import installed_version, versions


@pytest.fixture
def fresh() -> Iterator[None]:
    """Nothing is remembered from before, and nothing afterwards."""
    remembered = (provenance.installed_version, provenance._named_folders)
    for function in remembered:
        function.cache_clear()
    yield
    for function in remembered:
        function.cache_clear()


def test_every_installed_distribution_has_the_version_of_its_metadata() -> None:
    installed = {found.name for found in importlib.metadata.distributions()}
    assert len(installed) > 50
    differ = {name for name in installed if installed_version(name) != importlib.metadata.version(name)}
    assert differ == set()
    assert {"numpy", "scipy", "pin", "pyarrow"} <= versions().keys()


@pytest.mark.usefixtures("fresh")
def test_folders_that_do_not_say_it_plainly_are_asked_in_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    described = {
        "plain_one-1.2.dist-info": ("METADATA", "plain-one", "1.2"),
        "odd-1.0_rc.dist-info": ("METADATA", "odd", "1.0rc"),
        "older.egg-info": ("PKG-INFO", "older", "3.1"),
        "numpy-0.1.dist-info": ("METADATA", "numpy", "0.1"),
    }
    for folder, (file, name, version) in described.items():
        (tmp_path / folder).mkdir()
        (tmp_path / folder / file).write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    monkeypatch.setattr(sys, "path", [str(tmp_path), "nowhere.zip", *sys.path])
    for _, name, version in described.values():
        assert installed_version(name) == version == importlib.metadata.version(name)
    assert versions()["numpy"] == "0.1", "the first on the path is the one that is imported"


def test_what_is_not_installed_is_an_error() -> None:
    with pytest.raises(importlib.metadata.PackageNotFoundError):
        installed_version("collaudit-of-tomorrow")
