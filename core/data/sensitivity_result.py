"""Result types of sensitivity over time: how small a torque or force would have alarmed, for how much of the time.

Below them what would have been noticed in words: the one sentence that headlines, verdicts and reports say of it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

#: Names of the places that a force is asked for at by default; other places go by the link that ends there.
TOOL, FOREARM = "tool", "forearm"


def kind_of_place(place: str) -> str:
    """``tool`` or ``forearm`` of whichever arm, or the link."""
    return place.partition(" of ")[0]


#: Who asks for a force: the configuration, the program, or the same with half of what the arm can exert there.
AskedBy = Literal["stated", "default", "arm-limits"]


@dataclass(frozen=True, slots=True)
class TorqueLevel:
    """A torque that would have alarmed in a share of the time.

    Attributes:
        share: of the time to judge, 0 to 1.
        torque_nm: a torque of this size would have alarmed in at least that share; None: no torque would.
    """

    share: float
    torque_nm: float | None


@dataclass(frozen=True, slots=True)
class AskedTorque:
    """A torque that the configuration asks to alarm on a joint, and for how much of the time it would have.

    Attributes:
        torque_nm: its size.
        share: of the joint's motion, gaps included, in which it would have alarmed, 0 to 1.
        noticed_s, unnoticed_s: of all time in which the joint was watched, that in which it would have alarmed, and
            that in which only a larger torque would have.
        longest_unnoticed_s: the longest stretch without a moment in which it would have alarmed.
    """

    torque_nm: float
    share: float
    noticed_s: float
    unnoticed_s: float
    longest_unnoticed_s: float


@dataclass(frozen=True, slots=True)
class JointSensitivity:
    """The smallest external torque of one joint that would have alarmed, over the time in which it was watched.

    A push of the duration asked for counts, whatever its sign, on top of the log's own residual, and wherever in its
    range friction was.

    Attributes:
        levels: the distribution over the time in which the joint was watched, gaps included, by rising share.
        largest_nm: the torque that would have alarmed whenever anything could be told; None: never.
        motion_s: time in which the joint moved, or may have moved in a gap.
        told_s: the part of it in which some torque would have alarmed.
        asked: what the configuration asks of the joint; None where it asks nothing.
    """

    levels: tuple[TorqueLevel, ...]
    largest_nm: float | None
    motion_s: float = 0.0
    told_s: float = 0.0
    asked: AskedTorque | None = None


@dataclass(frozen=True, slots=True)
class ForceLevel:
    """A force that would have alarmed in a share of the time.

    Attributes:
        share: of the time, 0 to 1.
        force_n: a force of this size would have alarmed, from 80 % of the directions that load a watched joint; None:
            no force would.
    """

    share: float
    force_n: float | None


@dataclass(frozen=True, slots=True)
class AskedForce:
    """A force that must alarm, and for how much of the time it would have.

    Attributes:
        force_n: its size.
        by: who asks for it.
        share: of the time that counts (:class:`ForceTime`) in which it would have alarmed, 0 to 1.
        noticed_s, unnoticed_s: of all time, gaps included, that in which it would have alarmed, and that in which not.
        longest_unnoticed_s: the longest stretch of that.
        limited_by: the joint that a larger force would have alarmed first where this one did not alarm; None where
            it always did, or no force would.
        directions: share of all directions, over the time that counts, from which it would have alarmed; 0 to 1.
    """

    force_n: float
    by: AskedBy
    share: float
    noticed_s: float
    unnoticed_s: float
    longest_unnoticed_s: float
    limited_by: str | None
    directions: float = 1.0


@dataclass(frozen=True, slots=True)
class NoticedForce:
    """The smallest pure force at a place on the arm that would have alarmed.

    Attributes:
        place: ``tool``, ``forearm``, or the link at whose outer end it acts; of a robot with several arms ``tool of``
            and ``forearm of`` the last joint of one.
        link: that ends there.
        frame: frame at whose origin the force acts.
        joints: watched joints between the base and the place: the only ones that feel it.
        levels: the distribution over the time that counts, by rising share.
        unfelt: share of the directions, over that time, from which a force there loads no watched joint; 0 to 1.
        asked: the force that must alarm there; None where none is asked for.
        before_sensor: the force acts before a wrist sensor, whose reading is taken off: what acts beyond is not told.
    """

    place: str
    link: str
    frame: str
    joints: tuple[str, ...]
    levels: tuple[ForceLevel, ...]
    unfelt: float
    asked: AskedForce | None = None
    before_sensor: bool = False

    @property
    def kind(self) -> str:
        """``tool``, ``forearm``, or the link."""
        return kind_of_place(self.place)

    def at(self, share: float) -> float | None:
        """The force of that level, N; None where there is none."""
        return next((level.force_n for level in self.levels if level.share == share), None)


@dataclass(frozen=True, slots=True)
class ForceTime:
    """What the forces were looked at for.

    Attributes:
        push_s: duration of the push.
        share: of the time in which the force asked for must have alarmed.
        moving: the time is that in which a watched joint moved, gaps included; else all time, of an arm that rested.
        time_s: that time.
    """

    push_s: float
    share: float
    moving: bool
    time_s: float


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """How little would have alarmed: by joint, and for the arm from its links to the tool.

    Attributes:
        joints: of the watched joints.
        forces: at the links' ends and the tool, base to tip; empty without a kinematic model.
        time: what ``forces`` were looked at for; None where there are none.
        push_alarms: whether a push of the duration asked for can alarm at all: by filter, persistence, the log's rate.
    """

    joints: dict[str, JointSensitivity]
    forces: tuple[NoticedForce, ...] = ()
    time: ForceTime | None = None
    push_alarms: bool = True


def force_text(force_n: float | None) -> str:
    """A force that would have alarmed; rounded up, since a smaller one would not."""
    if force_n is None:
        return "no force"
    return f"{math.ceil(force_n):d} N" if force_n > 10.0 else f"{math.ceil(10.0 * force_n) / 10.0:g} N"


def place_text(force: NoticedForce, *, brief: bool = False) -> str:
    """Where a force acts; in brief without the note on a force sensor."""
    if force.kind == TOOL and force.before_sensor and not brief:
        return f"the {force.place} (on the arm's side of its force sensor)"
    return f"the {force.place}" if force.kind in (TOOL, FOREARM) else f"the end of {force.link}"


def time_text(time: ForceTime) -> str:
    """For how much of which time."""
    return f"in {100 * time.share:.3g} % of the {'moving ' if time.moving else ''}time"


def headline_forces(sensitivity: Sensitivity | None) -> Sequence[NoticedForce]:
    """The places that a headline speaks of, tool first: those that a force is asked for at, else tool and forearm."""
    if sensitivity is None:
        return []
    asked = [force for force, _ in asked_places(sensitivity)]
    return asked or [f for f in reversed(sensitivity.forces) if f.kind in (TOOL, FOREARM) and f.unfelt < 1.0]


def asked_places(sensitivity: Sensitivity) -> list[tuple[NoticedForce, AskedForce]]:
    """Places at which a force is asked for, the tool first."""
    return [(force, force.asked) for force in reversed(sensitivity.forces) if force.asked is not None]


def too_insensitive(sensitivity: Sensitivity) -> list[tuple[NoticedForce, AskedForce]]:
    """Places at which it takes a larger force than is asked for, the tool first."""
    share = 0.0 if sensitivity.time is None else sensitivity.time.share
    return [(force, need) for force, need in asked_places(sensitivity) if need.force_n < (force.at(share) or 0.0)]


def noticed_sentence(sensitivity: Sensitivity) -> str | None:
    """What a pass says it would have noticed; None where nothing is told."""
    forces, time = headline_forces(sensitivity), sensitivity.time
    if time is not None and forces:
        level = [(force.at(time.share), place_text(force)) for force in forces]
        noticed = [f"{force_text(force_n)} at {place}" for force_n, place in level if force_n is not None]
        never = [place for force_n, place in level if force_n is None]
        push, of_time = f"push ({1e3 * time.push_s:.4g} ms)", time_text(time)
        said = [f"Would have noticed a {push} of {listed(noticed)}, {of_time}."] if noticed else []
        said += [f"No {push} at {listed(never)}, however hard, would have been noticed {of_time}."] if never else []
        return " ".join(said)
    shares = [s.asked.share for s in sensitivity.joints.values() if s.asked is not None and s.motion_s > 0]
    if not shares:
        return None
    return f"The torque asked for would have alarmed in {100 * min(shares):.0f} % or more of each joint's motion."


def listed(parts: Sequence[str]) -> str:
    """``a, b and c``."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
