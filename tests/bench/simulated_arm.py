"""The fixtures' arms as a user has them: simulated logs, and settings that `init` writes from robot and units alone."""

from __future__ import annotations

from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

from collaudit.cli.main import run
from collaudit.core.config import LoadedConfig, load_config
from collaudit.fixtures import simulation

ARMS = ("paper6", "seven")


def simulated(
    folder: Path,
    scenario: str,
    seed: int,
    imperfections: tuple[str, ...] = (),
    robot: str = "paper6",
    seconds: float | None = None,
) -> Path:
    """A simulated log, made unless it is there."""
    prefix = "" if robot == "paper6" else f"{robot}-"
    length = "" if seconds is None else f"-{seconds:g}s"
    log = folder / f"{prefix}{'-'.join((scenario, str(seed), *imperfections))}{length}.mcap"
    if not log.with_suffix(".truth.json").exists():
        folder.mkdir(parents=True, exist_ok=True)
        simulation.simulate_to(scenario, robot, seed, "mcap", log, duration_s=seconds, imperfections=imperfections)
    return log


def robot_of(log: Path) -> Path:
    """The simulation's configuration without anything but robot, names and units."""
    kept, keep = [], True
    for line in log.with_suffix(".toml").read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            keep = line.startswith(("[robot", "[[robot", "[log.units", "[log.joint_names"))
        if keep:
            kept.append(line)
    path = log.with_suffix(".robot.toml")
    path.write_text("\n".join(kept) + "\n", encoding="utf-8")
    return path


def settings_of(log: Path, overrides: dict[str, object] | None = None) -> LoadedConfig:
    """What `init` writes for a log, read."""
    out, said = log.with_suffix(".init.toml"), StringIO()
    if not out.exists():
        with redirect_stdout(said), redirect_stderr(said):
            run(["init", str(log), "-c", str(robot_of(log)), "-o", str(out)])
        if not out.exists():
            raise SystemExit(f"init of {log} wrote nothing:\n{said.getvalue()}")
    return load_config(out, overrides)


def forget(log: Path) -> None:
    """Remove a log and what was written beside it."""
    for path in log.parent.glob(f"{log.stem}.*"):
        path.unlink()
