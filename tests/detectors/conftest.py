"""Simulated logs that the tests of detectors share."""

from __future__ import annotations

from pathlib import Path

import pytest

from collaudit.cli.chain import prepare_log
from collaudit.core.audit import fit_logs
from collaudit.core.config import load_config
from collaudit.core.result import FrictionFile, Provenance
from collaudit.fixtures.simulate import Reduction, simulate_to


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("logs")


@pytest.fixture(scope="session")
def friction(folder: Path) -> FrictionFile:
    files = simulate_to("friction", "paper6", 1, "mcap", folder / "friction.mcap", reduction=Reduction(speeds=10))
    loaded = load_config(files.config)
    return fit_logs([prepare_log(files.log, loaded)], loaded.config, Provenance("test", {}))


@pytest.fixture(scope="session")
def hits(folder: Path) -> Path:
    return simulate_to("free-hits", "paper6", 2, "mcap", folder / "hits.mcap").log[0]


@pytest.fixture(scope="session")
def polishing(folder: Path) -> Path:
    return simulate_to("polish-sine", "paper6", 2, "mcap", folder / "polishing.mcap").log[0]
