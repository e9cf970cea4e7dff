"""Where a path that a configuration names lies: the one place that resolves relative ones."""

from __future__ import annotations

from pathlib import Path

from collaudit.core.config.schema_fleet import FleetConfig, FleetRobot


def located(path: Path, base_dir: Path) -> Path:
    """The path as it is found from the working folder.

    Args:
        path: as the configuration gives it.
        base_dir: folder of the configuration file, from which relative paths start.
    """
    return base_dir / path


def located_fleet(fleet: FleetConfig, base_dir: Path) -> FleetConfig:
    """The fleet with its files as they are found from the working folder; arguments as of :func:`located`."""
    file = None if fleet.file is None else located(fleet.file, base_dir)
    robots = {name: located_robot(robot, base_dir) for name, robot in fleet.robots.items()}
    return fleet.changed({"file": file, "robots": robots})


def located_robot(robot: FleetRobot, base_dir: Path) -> FleetRobot:
    """A robot of the fleet with its files as they are found from the working folder."""
    names = {"config": robot.config, "urdf": robot.urdf, "friction": robot.friction}
    return robot.changed({name: located(p, base_dir) for name, p in names.items() if p is not None})
