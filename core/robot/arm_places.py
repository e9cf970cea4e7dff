"""Places on an arm at which a force is looked at, and the contact forces that must have alarmed there to judge a log.

Places are the outer ends of the links, among them the forearm, and the tool. The default forces are round numbers, of
the size of the weight of 10 and 15 kg, which is a hard push by hand; the forearm's is larger since fewer joints feel a
force there, on shorter levers. They are no limits of body regions. They depend on the arm alone, not on thresholds, fit
or noise: by a yardstick made of those any log would pass.

A pure force f·d at a place gives the joints the torques J_v^T f·d. From direction d it alarms at
f = min_j s_j / |J_v,j · d|, s_j what alarms on joint j. Whatever is beyond a place does not feel it.
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
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import median_of
from collaudit.core.robot.pinocchio_model import PinocchioModel
from collaudit.core.robot.robot_model import RobotModel

#: A force is noticed when it alarms from so many of the directions that load a watched joint. All of them would ask for
#: an infinite force: in any pose some direction nearly crosses every axis.
DIRECTIONS = 0.8
#: A direction loads a joint where a newton gives it at least this share of the arm's longest lever there.
_LOADED = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class AlarmingForces:
    """At one place, pose by pose.

    Attributes:
        felt: (k,) poses in which some direction loads a watched joint.
        force_n: (m,) in those the smallest force that alarms from :data:`DIRECTIONS` of such directions.
        first: (m,) joint that alarms first from the last of them.
        unfelt: share of all directions over all poses that load no watched joint.
        smallest_n: (k, d) that alarms by pose and direction; infinite where none does.
    """

    felt: BoolArray
    force_n: FloatArray
    first: IntArray
    unfelt: float
    smallest_n: FloatArray

    def noticed(self, force_n: float) -> float:
        """Share of all directions over all poses from which a force of this size alarms."""
        return float(np.mean(self.smallest_n <= force_n)) if self.smallest_n.size else 0.0


def alarming_forces(
    robot: RobotModel, place: Place, position_rad: FloatArray, torque_nm: FloatArray, watched: BoolArray
) -> AlarmingForces:
    """The smallest forces that alarm at a place.

    Args:
        robot: the arm.
        place: on it.
        position_rad: (k, j) of all joints of the model.
        torque_nm: (k, j) that alarms on each joint, N·m (N); infinite where none would.
        watched: (k, j) whether the joint is watched.
    """
    felt = list(place.columns)
    lever = robot.torque_per_newton(position_rad, place.frame)[:, felt]
    arm = np.abs(lever @ directions())  # (k, j, d)
    slides = np.array([kind == "prismatic" for kind in (robot.joint_types[k] for k in felt)])
    longest = np.linalg.norm(np.where(slides[:, None], 0.0, lever), axis=2).max(axis=1, initial=0.0)
    least = _LOADED * np.where(slides, 1.0, longest[:, None])  # a sliding joint takes up to a newton a newton
    loads = (arm > least[:, :, None]) & watched[:, felt, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        force = np.where(loads, torque_nm[:, felt, None] / arm, np.inf)
    any_joint: BoolArray = np.asarray(loads.any(axis=1))
    smallest = np.where(any_joint, force.min(axis=1), np.inf)
    here: BoolArray = np.asarray(any_joint.any(axis=1))
    order = np.argsort(smallest, axis=1)
    place_in = np.maximum(np.ceil(DIRECTIONS * any_joint.sum(axis=1) - 1e-9).astype(int), 1) - 1
    column = np.take_along_axis(order, place_in[:, None], axis=1)
    value = np.take_along_axis(smallest, column, axis=1)[:, 0]
    first = np.array(felt)[np.take_along_axis(force.argmin(axis=1), column, axis=1)[:, 0]]
    unfelt = float(1.0 - any_joint.mean()) if any_joint.size else 1.0
    return AlarmingForces(here, value[here], first[here], unfelt, smallest)


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
