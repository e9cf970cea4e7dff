"""What a robot description says before any dynamics: joints, kinds, limits. Text only, no Pinocchio."""

from __future__ import annotations

import hashlib
import json
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from collaudit.core.config.schema import DhRow, RobotConfig
from collaudit.core.errors import RobotError, did_you_mean
from collaudit.core.robot.urdf_file import JointFacts, expanded, read_urdf
from collaudit.core.robot.urdf_numbers import check_rows
from collaudit.core.small_files import read_small


@dataclass(frozen=True, slots=True)
class Description:
    """A robot as described by a URDF or by DH rows.

    Attributes:
        joints: every joint that can move, mimicking ones included, in model order.
        urdf_xml: normalised URDF for the rigid-body library, or None for a DH robot.
        rows: DH rows, empty for a URDF.
        convention: ``standard`` or ``modified`` for DH rows.
        content_sha256: hash of the URDF's bytes or of the DH rows.
        where: what messages call it.
    """

    joints: tuple[JointFacts, ...]
    urdf_xml: str | None
    rows: tuple[DhRow, ...]
    convention: str | None
    content_sha256: str
    where: str

    @property
    def movable(self) -> tuple[str, ...]:
        """Names of the joints that move on their own."""
        return tuple(joint.name for joint in self.joints if joint.leader is None)


def describe_robot(config: RobotConfig, base_dir: Path) -> Description | None:
    """Read the configured description; None when there is none.

    Raises:
        RobotError: it cannot be read.
    """
    if config.urdf is not None:
        return _describe_urdf(base_dir / config.urdf, str(config.urdf))
    if config.dh:
        return _describe_dh(config.dh, config.dh_convention or "standard")
    return None


def dh_names(rows: Sequence[DhRow]) -> tuple[str, ...]:
    """Joint names of DH rows; ``joint1`` … where a row has none."""
    return tuple(row.name or f"joint{i}" for i, row in enumerate(rows, 1))


def _describe_urdf(path: Path, where: str) -> Description:
    try:
        data = read_small(path)
    except OSError as error:
        raise RobotError(
            "the robot description cannot be read",
            where=where,
            found=error.strerror or type(error).__name__,
            expected="a URDF file",
            hint="check robot.urdf in the configuration; relative paths start at the configuration's folder",
        ) from error
    return _described(expanded(data, path, where), where)


@lru_cache(maxsize=8)  # the logs of a night share their robots
def _described(data: bytes, where: str) -> Description:
    joints, xml = read_urdf(data, where)
    return Description(joints, xml, (), None, hashlib.sha256(data).hexdigest(), where)


def _describe_dh(rows: Sequence[DhRow], convention: str) -> Description:
    check_rows(rows)
    names = dh_names(rows)
    twice = sorted(name for name, count in Counter(names).items() if count > 1)
    if twice:
        raise RobotError("two DH rows have the same name", where="robot.dh", found=", ".join(twice))
    joints = tuple(
        JointFacts(name, row.joint, f"link{i}", effort_limit=row.effort_limit_nm or math.nan)
        for i, (name, row) in enumerate(zip(names, rows, strict=True), 1)
    )
    content = json.dumps([convention, [row.plain() for row in rows]], sort_keys=True)
    digest = hashlib.sha256(content.encode()).hexdigest()
    return Description(joints, None, tuple(rows), convention, digest, "robot.dh")


def unknown_name(message: str, where: str, found: str, known: Sequence[str]) -> RobotError:
    """An error that lists the known names and suggests the closest."""
    return RobotError(
        message,
        where=where,
        found=repr(found),
        expected="one of " + ", ".join(known) if known else None,
        hint=did_you_mean(found, known),
    )
