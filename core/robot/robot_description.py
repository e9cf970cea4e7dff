"""What a robot description says before any dynamics: joints, kinds, limits. Text only, no Pinocchio."""

from __future__ import annotations

import hashlib
import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from collaudit.core.config.schema import DhRow, RobotConfig
from collaudit.core.errors import ConfigError, RobotError, did_you_mean
from collaudit.core.robot.urdf_file import JointFacts, check_rows, expanded, read_urdf
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
            hint="check --urdf, or [robot] urdf, whose relative paths start at the configuration's folder",
        ) from error
    return description_of(expanded(data, path, where), where)


@lru_cache(maxsize=8)  # the logs of a night share their robots
def description_of(data: bytes, where: str) -> Description:
    """The robot of a URDF's bytes; ``where`` is what messages call it.

    Raises:
        RobotError: it is none.
    """
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


def joint_order(
    count: int, key: str, config: RobotConfig, joints: Sequence[str], movable: Sequence[str]
) -> Sequence[str]:
    """The joints that a list of values of ``[robot]`` is for: those stated, else the robot's, else the log's.

    Raises:
        ConfigError: it has another length than any of them.
    """
    orders = [config.joints] if config.joints else [movable, joints]
    for order in orders:
        if len(order) == count:
            return order
    expected = orders[0] or orders[-1]
    raise ConfigError(
        "the list does not fit the joints",
        where=f"[robot] {key}",
        found=f"{count} values",
        expected=f"{len(expected)}, in the order {', '.join(expected)}",
        hint=f"a table by joint name is safer: {key} = {{ {expected[0]} = … }}",
    )


def joint_values(
    given: Sequence[float] | Mapping[str, float],
    key: str,
    config: RobotConfig,
    joints: Sequence[str],
    movable: Sequence[str],
    default: float | None,
) -> list[float]:
    """Values of the log's joints, by a list or a table of ``[robot]``.

    Args:
        given: the list or table; key: its name.
        config: states the order of a list, or leaves that to the robot and the log.
        joints: of the log, in its order.
        movable: the robot's joints in model order; empty without a description.
        default: for a joint that a table leaves out, None to refuse that.

    Raises:
        ConfigError: the list does not fit the joints, or the table names others or lacks some.
    """
    if not isinstance(given, Mapping):
        given = dict(zip(joint_order(len(given), key, config, joints, movable), given, strict=True))
    unknown = [name for name in given if name not in joints and name not in movable]
    missing = [name for name in joints if name not in given] if default is None else []
    if unknown or missing:
        raise ConfigError(
            f"{key} names joints that neither the log nor the robot has"
            if unknown
            else f"{key} lacks joints of the log",
            where=f"[robot] {key}",
            found=", ".join(unknown or missing),
            expected=f"a value for each of {', '.join(joints)}",
        )
    return [given.get(name, default or 0.0) for name in joints]
