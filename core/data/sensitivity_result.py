"""Result types of sensitivity over time: how small a torque or force would have alarmed, for how much of the time."""

from collaudit.core.dataclass import dataclass


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
class TimeShares:
    """Some time of a joint, divided by what would have alarmed in it.

    Attributes:
        time_s: all of it; the sum of the others.
        detectable_s: in which a torque of ``observable_nm`` would have alarmed.
        hidden_s: in which friction hides that size, and a larger torque would have alarmed.
        not_judged_s: in which nothing can be told.
    """

    time_s: float
    detectable_s: float
    hidden_s: float
    not_judged_s: float


@dataclass(frozen=True, slots=True)
class JointSensitivity:
    """The smallest external torque of one joint that would have alarmed, over the time in which it was to be judged.

    A torque counts that outlasts filter and persistence, whatever its sign and wherever in its interval friction was.

    Attributes:
        observable_nm: the torque that is asked to be noticeable.
        observable_stated: whether the configuration states it; else it follows from the threshold.
        all: the time to judge: of the log with its gaps, less that in which the joint was not watched.
        motion: the part of it in which the joint moved, or may have moved in a gap.
        longest_hidden_s: the longest stretch without a moment in which ``observable_nm`` would have alarmed.
        largest_nm: the torque that would have alarmed whenever anything could be told; None: never.
        levels: the distribution over the time to judge, by rising share.
    """

    observable_nm: float
    observable_stated: bool
    all: TimeShares
    motion: TimeShares
    longest_hidden_s: float
    largest_nm: float | None
    levels: tuple[TorqueLevel, ...]


@dataclass(frozen=True, slots=True)
class ForceLevel:
    """A force that would have alarmed in a share of the time.

    Attributes:
        share: of the arm's recorded time, 0 to 1.
        force_n: a force of this size would have alarmed, from 95 % of all directions; None: no force would.
        typical_n: the same from half of all directions.
    """

    share: float
    force_n: float | None
    typical_n: float | None


@dataclass(frozen=True, slots=True)
class ForceSensitivity:
    """The smallest pure force at a place on the arm that would have alarmed, over the recorded time.

    Attributes:
        place: words for the place, such as ``tool`` or ``outer end of link upper_arm``.
        frame: frame at whose origin the force acts.
        joints: joints between the base and the place: the only ones that feel it.
        moments: evenly spread moments of the log that were computed.
        levels: the distribution over them, by rising share.
    """

    place: str
    frame: str
    joints: tuple[str, ...]
    moments: int
    levels: tuple[ForceLevel, ...]


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """How little would have alarmed: by joint, and for the arm from its links to the tool.

    Attributes:
        joints: of the watched joints.
        arm: of the links and the tool; empty without a kinematic model, or for a detector that does not isolate.
    """

    joints: dict[str, JointSensitivity]
    arm: tuple[ForceSensitivity, ...] = ()
