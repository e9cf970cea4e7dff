"""Simulated logs that several tests share; each is made once a run, whichever process asks first."""

from __future__ import annotations

import hashlib
import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock

from collaudit.core import fitting
from collaudit.core.api import fit
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.fixtures.compare import audit_simulated, fit_simulated
from collaudit.fixtures.simulation import SimulatedFiles, simulate_to

ROBOTS = ("paper6", "seven")
FEWER_SPEEDS, TEN_SPEEDS = 14, 10
Maker = Callable[..., SimulatedFiles]
Once = Callable[[tuple[object, ...], Callable[[Path], Any]], Any]


@pytest.fixture(scope="session")
def once(tmp_path_factory: pytest.TempPathFactory) -> Once:
    """``once(key, make)`` is made once a test run: its processes share it on disk, others wait while one makes it.

    ``make`` gets a folder of its own.
    """
    base = tmp_path_factory.getbasetemp()  # pytest-xdist gives each process a folder inside the run's
    root = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "simulated"
    root.mkdir(exist_ok=True)

    def value_of(key: tuple[object, ...], make: Callable[[Path], Any]) -> Any:
        place = root / hashlib.sha256(repr(key).encode()).hexdigest()[:16]
        kept = place / "value.pickle"
        with FileLock(f"{place}.lock"):
            if not kept.exists():
                place.mkdir(exist_ok=True)
                part = kept.with_suffix(".part")
                part.write_bytes(pickle.dumps(make(place)))
                part.rename(kept)
            return pickle.loads(kept.read_bytes())

    return value_of


@pytest.fixture(scope="session")
def made(once: Once) -> Maker:
    """Simulates once for equal arguments, by default as CSV: MCAP takes longer to write than the motion to simulate."""

    def make(scenario: str, robot: str, seed: int = 1, fmt: str = "csv", **more: object) -> SimulatedFiles:
        def simulate(folder: Path) -> SimulatedFiles:
            return simulate_to(scenario, robot, seed, fmt, folder / f"{robot}-{scenario}", **more)  # type: ignore[arg-type]

        files: SimulatedFiles = once((scenario, robot, seed, fmt, *sorted(more.items())), simulate)
        return files

    return make


@pytest.fixture(scope="session")
def friction_of(made: Maker, once: Once) -> Callable[[str], FrictionFile]:
    """Friction identified from a robot's shorter identification run."""

    def fit(robot: str) -> FrictionFile:
        files = made("friction", robot, speeds=FEWER_SPEEDS)
        fitted: FrictionFile = once(("fitted", robot), lambda _: fit_simulated(files))
        return fitted

    return fit


@pytest.fixture(scope="session")
def audit_of(
    made: Maker, friction_of: Callable[[str], FrictionFile], once: Once
) -> Callable[..., tuple[SimulatedFiles, Audit]]:
    """A scenario's log and its audit with :func:`friction_of`, made once for equal arguments; all have copies."""

    def audited(scenario: str, robot: str, **more: object) -> tuple[SimulatedFiles, Audit]:
        files = made(scenario, robot, **more)
        friction = friction_of(robot)
        key = ("audited", scenario, robot, *sorted(more.items()))
        found: Audit = once(key, lambda _: audit_simulated(files, friction))
        return files, found

    return audited


@pytest.fixture(scope="session")
def own_fit(made: Maker, once: Once) -> Callable[..., FrictionFile]:
    """What ``fit`` says of a scenario's log, made once for equal arguments."""

    def fitted(scenario: str, robot: str, **more: object) -> FrictionFile:
        files = made(scenario, robot, **more)
        found: FrictionFile = once(
            ("own fit", scenario, robot, *sorted(more.items())),
            lambda _: fit([files.log], load_config(files.config)),
        )
        return found

    return fitted


@pytest.fixture(params=ROBOTS)
def robot(request: pytest.FixtureRequest) -> str:
    """Each simulated robot."""
    return str(request.param)


def without_thresholds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let fits of this test end at the laws: their held-out residual, which nobody asks for, takes half of the time."""
    monkeypatch.setattr(fitting, "held_out_residuals", lambda *_: [])


def fit_without_folds(files: SimulatedFiles) -> FrictionFile:
    """Friction of one simulated log with every correction that was found, and without thresholds.

    Which corrections help is told by fits without each fold in turn: half of a fit's time. Of identification runs
    with 14 and 30 speeds every correction did, on both robots and five seeds.
    """
    with pytest.MonkeyPatch.context() as patch:
        without_thresholds(patch)
        return fit_simulated(files)


def truth_path(files: SimulatedFiles) -> Path:
    """Where the truth of a simulated log is."""
    return files.truth


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for what a process makes of the shared logs."""
    return tmp_path_factory.mktemp("logs")


@pytest.fixture(scope="session")
def friction(made: Maker, once: Once) -> FrictionFile:
    """Friction of the paper's arm from ten speeds: enough to judge with."""
    files = made("friction", "paper6", speeds=TEN_SPEEDS)
    fitted: FrictionFile = once(("fitted", "paper6", TEN_SPEEDS), lambda _: fit_simulated(files))
    return fitted


@pytest.fixture(scope="session")
def hits(made: Maker) -> Path:
    """Graded pushes in fast motion."""
    return made("free-hits", "paper6", 2, "mcap").log[0]


@pytest.fixture(scope="session")
def polishing(made: Maker) -> Path:
    """Run B with its two pushes."""
    return made("polish-sine", "paper6", 2).log[0]
