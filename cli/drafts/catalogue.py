"""Descriptions of arms on this machine, and which of them a log may be of: by names, number and limits of its joints.

The files are those of example-robot-data, whose wheel brings them, and what robot_descriptions has fetched. One is
proposed, never taken: arms of one family may differ in nothing that a log shows.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import numpy as np

from collaudit.cli.drafts.draft import Draft
from collaudit.cli.drafts.trial import Trial
from collaudit.core.config.schema import RobotConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import CollauditError
from collaudit.core.logs.signals.joint_naming import guess_joints
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.robot_description import Description, describe_robot
from collaudit.core.robot.urdf_file import JointFacts
from collaudit.core.small_files import read_small

MOST = 3
#: Joints that a description may have beyond the log's where no name is shared.
_GRIPPER = 3
_MOVES = re.compile(rb'type="(?:revolute|continuous|prismatic)"')
_IN_WHEEL = "cmeel.prefix/share/example-robot-data/robots"
#: rad or m beyond a position limit, and share beyond one of speed or effort, that a log of the arm may show.
_BEYOND, _BEYOND_SHARE = 0.05, 0.05


@dataclass(frozen=True, slots=True)
class Proposal:
    """A description that a log may be of.

    Attributes:
        path: of the URDF.
        sha256: of its bytes.
        named: how many of the log's joints it has by name.
        joints: how many of the log's joints it has, by name or by number and order.
        outside: how many of its limits of position, speed and effort the log exceeds.
    """

    path: Path
    sha256: str
    named: int
    joints: int
    outside: int


def add_proposals(draft: Draft, trial: Trial) -> list[str]:
    """Lines of the descriptions that a log may be of, behind ``#``, and what is said of them.

    Args:
        draft: without a robot; its ``[robot]`` gets the lines.
        trial: of it on the log.
    """
    if trial.log is None or np.isnan(trial.log.position_rad).all(axis=0).any():
        return []
    folders = catalogue_folders()
    if not folders:
        return ["descriptions to propose: python -m pip install 'collaudit[catalogue]' brings those of many arms"]
    found = proposals(folders, trial.log)
    if not found:
        return ["a description in the catalogue on this machine fits none of the log's joints"]
    robot, said = draft.sections["robot"], []
    robot.remarks.append("QUESTION: which arm is it? Uncomment one line if it is this one; none is used unasked:")
    count = len(trial.log.joint_names)
    for one in found:
        named = f"{one.named} of {count} joints by name" if one.named else f"{one.joints} joints, none by name"
        limits = "within its limits" if not one.outside else f"beyond {one.outside} of its limits"
        why = f"{named}, {limits}; sha256 {one.sha256}"
        robot.add("urdf", str(one.path), why, choice=True)
        said.append(f"perhaps --urdf {one.path} ({named}, {limits})")
    return said


def catalogue_folders() -> list[Path]:
    """Folders that hold descriptions; empty where nothing is installed."""
    fetched = os.environ.get("ROBOT_DESCRIPTIONS_CACHE") or "~/.cache/robot_descriptions"
    folders = [Path(fetched).expanduser()]
    with suppress(PackageNotFoundError):
        folders.append(Path(str(distribution("example-robot-data").locate_file(_IN_WHEEL))))
    return [folder for folder in folders if folder.is_dir()]


def proposals(folders: Sequence[Path], log: JointLog, most: int = MOST) -> list[Proposal]:
    """Descriptions that a log may be of, the likeliest first.

    Those that have more of the log's joints by name come first; then those of whose limits it exceeds fewer; then those
    with fewer joints that the log lacks; then those whose limits it comes closer to.

    Args:
        folders: with URDF files.
        log: read without a robot.
        most: of them.
    """
    extremes = _extremes(log)
    ranked = []
    for path, description in _described(folders, log.joint_names):
        movable = [joint for joint in description.joints if joint.leader is None]
        mapping = _mapping(log.joint_names, movable)
        if not mapping:
            continue
        named = sum(name == joint.name for name, joint in mapping.items())
        used = np.array([_used(joint, extremes[name]) for name, joint in mapping.items()])
        outside = int(np.count_nonzero(used > 1.0))
        lacking = sum(joint.kind == "revolute" for joint in movable) - len(mapping)
        known = used[np.isfinite(used)]
        close = float(known.mean()) if known.size else 0.0
        found = Proposal(path, description.content_sha256, named, len(mapping), outside)
        ranked.append(((-named, outside, max(lacking, 0), -close, path.name), found))
    return [found for _, found in sorted(ranked, key=lambda one: one[0])[:most]]


def _described(folders: Sequence[Path], names: Sequence[str]) -> Iterator[tuple[Path, Description]]:
    """Descriptions with any of the names, or with about as many moving joints; of equal files the first."""
    seen: set[str] = set()
    wanted = [f'"{name}"'.encode() for name in names]
    for path in sorted(path for folder in folders for path in folder.rglob("*.urdf")):
        try:
            text = read_small(path)
            if not any(name in text for name in wanted) and not 0 <= len(_MOVES.findall(text)) - len(names) <= _GRIPPER:
                continue
            description = describe_robot(RobotConfig(urdf=path), Path())
        except (CollauditError, OSError):
            continue
        if description is not None and description.content_sha256 not in seen:
            seen.add(description.content_sha256)
            yield path, description


def _mapping(names: Sequence[str], movable: Sequence[JointFacts]) -> dict[str, JointFacts]:
    """The log's joints as the description's: by name, else by number where there are as many."""
    by_name = {joint.name: joint for joint in movable}
    if common := {name: by_name[name] for name in names if name in by_name}:
        return common
    guess = guess_joints(names, list(by_name), [joint.name for joint in movable if joint.kind == "prismatic"])
    return {name: by_name[model] for name, model in guess.mapping.items()} if guess.mapping else {}


def _extremes(log: JointLog) -> Mapping[str, FloatArray]:
    """Joint to least and greatest position, greatest speed and effort; NaN where there is none."""

    def largest(values: FloatArray | None) -> FloatArray:
        if values is None:
            return np.full(len(log.joint_names), np.nan)
        return np.asarray(np.nanquantile(np.nan_to_num(np.abs(values)), 0.999, axis=0))

    low, high = np.nanmin(log.position_rad, axis=0), np.nanmax(log.position_rad, axis=0)
    rows = np.array([low, high, largest(log.velocity_rad_s), largest(log.effort)])
    return dict(zip(log.joint_names, rows.T, strict=True))


def _used(joint: JointFacts, seen: FloatArray) -> FloatArray:
    """(3,) shares of the joint's limits of position, speed and effort that the log uses; ∞ beyond them, NaN without."""
    low, high, speed, effort = seen
    share = np.array([high - low, speed, effort])
    with np.errstate(divide="ignore", invalid="ignore"):
        share /= np.array([joint.upper - joint.lower, joint.speed_limit, joint.effort_limit])
    beyond = np.array([low < joint.lower - _BEYOND or high > joint.upper + _BEYOND, *(share[1:] > 1.0 + _BEYOND_SHARE)])
    return np.where(beyond, np.inf, np.minimum(share, 1.0))
