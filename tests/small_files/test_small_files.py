"""What is read whole beside a log is a regular file of a sensible size."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from collaudit.core.config import load_config
from collaudit.core.config.schema import RobotConfig
from collaudit.core.errors import CollauditError
from collaudit.core.robot.robot_description import describe_robot
from collaudit.core.scoring.detection_score import read_truth
from collaudit.core.small_files import file_sha256, read_small
from collaudit.reports.files.run_files import read_friction
from collaudit.reports.sections.body_region_sections import read_limits

READERS: tuple[Callable[[Path], object], ...] = (
    load_config,
    lambda path: describe_robot(RobotConfig(urdf=path), Path()),
    read_truth,
    read_limits,
    read_friction,
    file_sha256,
)


def held(read: Callable[[Path], object], path: Path) -> None:
    """Refused within a second, whatever would have come out of it."""
    failed: list[BaseException] = []

    def run() -> None:
        try:
            read(path)
        except CollauditError as error:
            failed.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(5)
    assert not thread.is_alive() and len(failed) == 1, path


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no such device here")
@pytest.mark.parametrize("read", READERS)
def test_devices_and_pipes_are_not_read(read: Callable[[Path], object], tmp_path: Path) -> None:
    link = tmp_path / "arm.urdf"
    link.symlink_to("/dev/zero")
    held(read, link)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    held(read, pipe)


@pytest.mark.parametrize("read", READERS[:-2])
def test_huge_files_are_not_read(read: Callable[[Path], object], tmp_path: Path) -> None:
    huge = tmp_path / "huge"
    with huge.open("wb") as file:
        file.truncate(1 << 40)
    held(read, huge)


def test_a_file_may_be_as_long_as_allowed(tmp_path: Path) -> None:
    path = tmp_path / "some"
    path.write_bytes(b"x" * 100)
    assert read_small(path, 100) == b"x" * 100
    with pytest.raises(OSError, match="longer"):
        read_small(path, 99)
