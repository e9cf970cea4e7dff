"""Places on an arm at which a force is looked at, and the contact forces that must have alarmed there to judge a log.

Places are the outer ends of the links, among them the forearm, and the tool. The default forces are round numbers, of
the size of the weight of 10 and 15 kg, which is a hard push by hand; the forearm's is larger since fewer joints feel a
force there, on shorter levers. They are no limits of body regions. They depend on the arm alone, not on thresholds, fit
or noise: by a yardstick made of those any log would pass.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from collaudit.core.config.schema import PolicyConfig
from collaudit.core.data.sensitivity_result import FOREARM, TOOL, AskedBy, kind_of_place
from collaudit.core.errors import refuse_unknown
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import median_of
from collaudit.core.robot.pinocchio_model import PinocchioModel
from collaudit.core.robot.robot_model import RobotModel

#: A link at least this share as long as the longest carries the hand to its place; shorter ones turn it there: the
#: wrist. Of the arms at hand (UR3, UR3e, UR10, Panda, FR3, LBR Med 7, TX40, KR 300 and the two simulated ones) wrist
#: links have at most 0.55 of the longest, forearms at least 0.75.
_LONG = 0.6
#: So many joints place the hand in space; an arm with no more has no wrist, and its forearm ends at the tool.
_PLACING = 3
_DIRECTIONS = 120


@dataclass(frozen=True, slots=True)
class Place:
    """A frame of the arm.

    Attributes:
        name: ``tool``, ``forearm``, or the link that ends there: its key in ``[policy] observable_n``. Of a robot with
            several arms ``tool of`` and ``forearm of`` the arm's last joint.
        link: that ends there; of the tool the last one.
        frame: at whose origin a force acts.
        columns: of the joints between it and the base in those of the robot; only they feel it.
    """

    name: str
    link: str
    frame: str
    columns: tuple[int, ...]

    @property
    def kind(self) -> str:
        """``tool``, ``forearm``, or the link."""
        return kind_of_place(self.name)

    @property
    def words(self) -> str:
        """As tables name it."""
        return self.name if self.kind == TOOL else f"end of {self.link}"


def arm_places(robot: RobotModel, judged: Collection[str], tool: str | None) -> tuple[Place, ...]:
    """The outer ends of the links, where the next joint is, and the tool, base to tip; none without a kinematic model.

    Args:
        robot: the arm, or several on one base.
        judged: its judged joints; arms without any are left out.
        tool: frame of the tool; None: the frame of the last link that is furthest out.
    """
    if robot.bodies is None:
        return ()
    chains, found = _chains(robot, robot.bodies, judged), dict[str, Place]()
    for chain in chains:
        arm = f" of {chain[-1]}" if len(chains) > 1 else ""
        for place in _chain_places(robot, robot.bodies, chain, tool, arm):
            found.setdefault(place.name, place)  # a link that carries several arms is one place
    return tuple(found.values())


def _chains(robot: RobotModel, bodies: PinocchioModel, judged: Collection[str]) -> list[list[str]]:
    """The joints from the base to each tip, of the arms that have judged joints which no other arm has too."""
    paths = [[name for name in robot.joint_names if name in bodies.path(tip)] for tip in robot.joint_names]
    whole = [path for path in paths if not any(set(path) < set(other) for other in paths)]
    watched = [set(path) & set(judged) for path in whole]
    return [path for path, own in zip(whole, watched, strict=True) if own and not any(own < other for other in watched)]


def _chain_places(
    robot: RobotModel, bodies: PinocchioModel, names: Sequence[str], tool: str | None, arm: str
) -> Iterator[Place]:
    """Places of one arm by its joints; ``arm`` ends their names."""
    columns = tuple(map(robot.joint_names.index, names))
    ends = [robot.frame_at(following) for following in names[1:]]
    forearm = _forearm(robot, bodies, names, ends)
    for k, frame in enumerate(ends):
        link = robot.link_of(names[k]) or names[k]
        if frame is not None:
            yield Place(FOREARM + arm if k == forearm else link, link, frame, columns[: k + 1])
    mounted = tool in bodies.frame_names and (not arm or bodies.frame_joint(tool) in names)
    outer = tool if mounted else robot.outer_frame(names[-1])
    if outer is not None:
        yield Place(TOOL + arm, robot.link_of(names[-1]) or names[-1], outer, columns)


def _forearm(robot: RobotModel, bodies: PinocchioModel, names: Sequence[str], ends: Sequence[str | None]) -> int | None:
    """Number of the last long link before the wrist, by where the links end; None for an arm without a wrist."""
    frames = [names[0], *ends]
    if len(names) <= _PLACING or any(f not in bodies.frame_names for f in frames):
        return None
    origins = robot.frame_positions(np.zeros(len(robot.joint_names)), [f for f in frames if f is not None])
    length = [float(np.linalg.norm(b - a)) for a, b in pairwise(origins)]
    kinds = [robot.joint_types[robot.joint_names.index(name)] for name in names]
    turned = [0.0 if kind == "prismatic" else m for kind, m in zip(kinds, length, strict=False)]
    long = [k for k, m in enumerate(turned) if m > 0.0 and m >= _LONG * max(turned)]
    return long[-1] if long else None


@cache
def directions() -> FloatArray:
    """(3, m) unit vectors, evenly spread (golden-angle spiral) over half a sphere: an opposite force feels alike."""
    z = (np.arange(_DIRECTIONS) + 0.5) / _DIRECTIONS
    angle = np.arange(_DIRECTIONS) * np.pi * (3.0 - np.sqrt(5.0))
    across = np.sqrt(1.0 - z**2)
    return np.stack([across * np.cos(angle), across * np.sin(angle), z])


DEFAULT_N: Mapping[str, float] = {TOOL: 100.0, FOREARM: 150.0}
#: A default is at most this share of what the arm can exert: a contact that takes more than that stops a small arm.
_OF_STRENGTH = 0.5
#: What the arm can exert: from so many of the directions, in the middle of its poses.
_MOST_DIRECTIONS = 0.8


@dataclass(frozen=True, slots=True)
class RequiredForce:
    """A force that must have alarmed, N, and who asks for it."""

    force_n: float
    by: AskedBy


def asked_forces(
    policy: PolicyConfig, robot: RobotModel, places: Sequence[Place], position_rad: FloatArray, limit_nm: FloatArray
) -> dict[str, RequiredForce]:
    """The forces asked for, by place.

    Args:
        policy: what is stated.
        robot: the arm.
        places: on it.
        position_rad: (k, j) poses of the log.
        limit_nm: (j,) the joints' torque limits, N·m (N); NaN where none is known.

    Raises:
        ConfigError: a force is stated for a place that the arm does not have.
    """
    names = list(dict.fromkeys([*(place.name for place in places), *(place.kind for place in places)]))
    if names:
        problem = "a force is asked for at a place that this arm does not have"
        refuse_unknown(policy.observable_n, names, problem, "[policy] observable_n")
    out = {}
    for place in places:
        strength = exerted_force(robot, place, position_rad, limit_nm) if place.kind in DEFAULT_N else None
        needed = required_force(policy, place.name, strength)
        if needed is not None:
            out[place.name] = needed
    return out


def required_force(policy: PolicyConfig, place: str, exerted_n: float | None) -> RequiredForce | None:
    """The force asked for at one place; None where none is.

    Args:
        policy: what is stated.
        place: its name.
        exerted_n: of :func:`exerted_force`.
    """
    kind = kind_of_place(place)
    stated = policy.observable_n.get(place, policy.observable_n.get(kind))
    if stated is not None:
        return RequiredForce(stated, "stated")
    usual = DEFAULT_N.get(kind)
    if usual is None:
        return None
    if exerted_n is None or _OF_STRENGTH * exerted_n >= usual:
        return RequiredForce(usual, "default")
    return RequiredForce(_rounded_down(_OF_STRENGTH * exerted_n), "arm-limits")


def exerted_force(robot: RobotModel, place: Place, position_rad: FloatArray, limit_nm: FloatArray) -> float | None:
    """The force, N, that the joints' limits let an arm exert at a place from most directions, in its median pose.

    Without its weight: f = min_j limit_j / |J_v,j · d|. None where a joint before the place has no known limit.
    """
    columns = list(place.columns)
    limits = limit_nm[columns]
    if not np.isfinite(limits).all() or not len(position_rad):
        return None
    arm = np.abs(robot.torque_per_newton(position_rad, place.frame)[:, columns] @ directions())
    with np.errstate(divide="ignore"):
        force = np.sort((limits[:, None] / arm).min(axis=1), axis=1)
    strength = median_of(force[:, int((1.0 - _MOST_DIRECTIONS) * force.shape[1])])
    return strength if np.isfinite(strength) else None


def _rounded_down(force_n: float) -> float:
    """To two digits."""
    step = 10.0 ** (math.floor(math.log10(force_n)) - 1)
    return step * math.floor(force_n / step + 1e-9)
