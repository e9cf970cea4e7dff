"""Packages of the npm registry that tests read with: unpacked one by one, or installed with what they need."""

from __future__ import annotations

import shutil
import subprocess
import tarfile
from pathlib import Path

import pytest


def unpacked(name: str, folder: Path) -> Path:
    """The files of one package, in ``folder``; skips where npm or its registry is out of reach."""
    done = _npm(["pack", name, "--silent"], folder)
    archive = folder / done.stdout.strip().splitlines()[-1]
    unpack(archive, folder)
    return folder / "package"


def installed(names: list[str], folder: Path) -> None:
    """Packages that node finds from ``folder``; skips where npm or its registry is out of reach."""
    if shutil.which("node") is None:
        pytest.skip("no node on this machine")
    _npm(["install", "--silent", "--no-audit", "--no-fund", "--ignore-scripts", *names], folder)


def _npm(arguments: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip("no npm on this machine")
    done = subprocess.run([npm, *arguments], cwd=folder, capture_output=True, text=True, timeout=180)
    if done.returncode != 0:
        pytest.skip(f"npm's registry is out of reach: {done.stderr[-200:]}")
    return done


def unpack(archive: Path, folder: Path) -> None:
    """Unpack a package; without links out of the folder where Python knows how, from 3.11.4 on."""
    if hasattr(tarfile, "data_filter"):
        shutil.unpack_archive(archive, folder, filter="data")
    else:
        shutil.unpack_archive(archive, folder)
