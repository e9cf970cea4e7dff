"""The evidence behind an audit, sample by sample: what was measured, modelled, left over, and judged.

Of a program that repeats also what a sample is beside other cycles, what an audit says of them, and what a store keeps;
and of the arm its kinematics, as far as a drawing of it at a sample needs them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data import Showing, Shown
from collaudit.core.numeric.arrays import BoolArray, FloatArray


class State(IntEnum):
    """Why a sample of a joint was judged, or not; the larger number wins where several apply.

    TOO_BRIEF is given last, to what is left: stretches in which the rule cannot fire. UNUSABLE is every recorded sample
    of a joint that a finding forbids judging.
    """

    JUDGED = 0
    FRICTION_INTERVAL = 1
    TOO_FAST = 2
    NOT_WATCHED = 3
    EDGE = 4
    NO_FRICTION = 5
    NO_MODEL = 6
    SATURATED = 7
    NOT_A_NUMBER = 8
    GAP = 9
    TOO_BRIEF = 10
    UNUSABLE = 11
    NOT_DRIVEN = 12

    @property
    def code(self) -> str:
        """The state as a stable, kebab-case reason."""
        return self.name.lower().replace("_", "-")

    @classmethod
    def of(cls, reason: str) -> State | None:
        """The state of a reason of :attr:`code`; None for one that this version does not know."""
        return cls.__members__.get(reason.replace("-", "_").upper())

    @property
    def text(self) -> str:
        """The state in words for a reader."""
        return _TEXT[self]


_TEXT = {
    State.JUDGED: "judged",
    State.FRICTION_INTERVAL: "at rest, in slow motion or just after a reversal: friction is known only as a range",
    State.TOO_FAST: "faster than friction was measured",
    State.NOT_WATCHED: "not watched: not named, or force-controlled in this phase",
    State.EDGE: "filters settling at a gap or end of the log",
    State.NO_FRICTION: "no friction model",
    State.NO_MODEL: "no model torque, or effort not in N·m",
    State.SATURATED: "effort saturated",
    State.NOT_A_NUMBER: "missing or not a number",
    State.GAP: "gap in the log",
    State.TOO_BRIEF: "between unjudged samples, for fewer than n in a row: the rule cannot fire there",
    State.UNUSABLE: "a finding forbids judging this joint",
    State.NOT_DRIVEN: "drives off, braking, stopped by the controller, or guided by hand",
}


def reason_text(code: str) -> str:
    """A reason of :attr:`State.code` in words; one that this version does not know stands as it is."""
    state = State.of(code)
    return code if state is None else state.text


@dataclass(frozen=True, slots=True, eq=False)
class CycleSignals:
    """What a log is beside the same place of other cycles.

    Attributes:
        number: (n,) of the cycle, from 0 on; -1 outside of cycles.
        place: (n,) on the path, from 0 to 1; NaN outside of cycles, at rest and off the path.
        torque_nm: (n, j) residual less that of the same place; NaN where there is no reference.
        gamma_nm: (n, j) float32 threshold of that in force, NaN where there is none.
    """

    number: NDArray[np.int32]
    place: NDArray[np.float32]
    torque_nm: FloatArray
    gamma_nm: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Signals(Showing):
    """Time series of one audit, on the uniform time base.

    Attributes:
        time_s: (n,) seconds from the log's first sample.
        joint_names: j judged joints.
        position_rad, velocity_rad_s: (n, j).
        measured_nm: (n, j) measured torque.
        model_nm: (n, j) rigid-body torque + friction + J^T F.
        residual_nm: (n, j) estimate of external joint torque, eq. (5); in state FRICTION_INTERVAL only the
            part that no friction within its interval explains. NaN where unknown.
        state: (n, j) codes of :class:`State`.
        gamma_nm: (n, j) float32 threshold in force, NaN of a joint without one.
        near_below_nm: (j,) how far below it a near miss begins; NaN of a joint without one.
        least_nm, most_nm: (n, j) float32 range of the residual that friction within its interval allows, NaN outside
            state FRICTION_INTERVAL; None where the detector does not tell.
        wrench: (n, 6) force in N and torque in N·m as the wrist sensor reads them; None where there is none.
        cycles: the comparison of cycles; None where nothing repeats.
    """

    time_s: FloatArray
    joint_names: tuple[str, ...]
    position_rad: FloatArray
    velocity_rad_s: FloatArray
    measured_nm: FloatArray
    model_nm: FloatArray
    residual_nm: FloatArray
    state: NDArray[np.int8]
    gamma_nm: NDArray[np.float32]
    near_below_nm: FloatArray
    least_nm: NDArray[np.floating] | None = None
    most_nm: NDArray[np.floating] | None = None
    wrench: FloatArray | None = None
    cycles: CycleSignals | None = None

    def inside(self, times: Sequence[tuple[float, float]]) -> BoolArray:
        """(n,) samples inside any of these stretches of time, s."""
        out = np.zeros(self.time_s.size, dtype=np.bool_)
        for start, end in times:
            a, b = np.searchsorted(self.time_s, [start, end])
            out[a:b] = True
        return out

    def outline(self) -> Shown:
        """Each joint's judged share."""
        shares = np.mean(self.state == State.JUDGED, axis=0)
        rows = [(name, f"judged {100 * s:.3g} %") for name, s in zip(self.joint_names, shares, strict=True)]
        return f"Signals of {len(self.joint_names)} joints, {len(self.time_s)} samples", rows


@dataclass(frozen=True, slots=True, eq=False)
class CycleReference:
    """The residual of one night over the path of its program: what a store keeps.

    Attributes:
        version: of the residual: joints, model, friction and detector; empty until the audit is whole.
        night, log: ISO date, and the first digits of the log's hash; empty until a store has them.
        position_rad: (p, j) path, of all judged joints.
        share: (p,) of its length gone.
        speed: (p,) of the cycles, places a second.
        median_nm, spread_nm: (p, j) over the cycles, robust; NaN where too few were judged.
    """

    version: str
    night: str
    log: str
    position_rad: FloatArray
    share: FloatArray
    speed: FloatArray
    median_nm: FloatArray
    spread_nm: FloatArray


@dataclass(frozen=True, slots=True)
class CycleFacts:
    """The cycles of a log as its audit judged them.

    Attributes:
        stated: whether the configuration or the log states them; else they were found by the measured path.
        starts_s: of whole cycles, s from the log's first sample.
        duration_s: shortest, median and longest, s.
        path_rad: length of the path, rad over all joints (m of prismatic ones).
        compared: cycles with a reference.
        least: other cycles that a reference needs at each place.
        nights: passed nights of the store that the reference rests on; 0: on the other cycles of this log.
        gamma_nm: by joint, threshold of the difference to the reference in its usual spread; joints without are
            judged by the ordinary residual alone.
        spread_share: by joint, spread of the difference over that of the residual itself.
        judged_s: by joint, time in which the difference was judged.
        unseen: what the comparison cannot see, in sentences.
    """

    stated: bool
    starts_s: tuple[float, ...]
    duration_s: tuple[float, float, float]
    path_rad: float
    compared: int
    least: int
    nights: int
    gamma_nm: dict[str, float] = field(default_factory=dict)
    spread_share: dict[str, float] = field(default_factory=dict)
    judged_s: dict[str, float] = field(default_factory=dict)
    unseen: tuple[str, ...] = ()


ChangedQuantity = Literal["path", "speed", "load", "friction", "residual"]
#: A change is worth a word from here on: mm of the tool, shares, kg, and a share of a joint's threshold.
LEAST_CHANGE: dict[ChangedQuantity, float] = {
    "path": 1.0,
    "speed": 0.01,
    "load": 0.1,
    "friction": 0.03,
    "residual": 0.25,
}


@dataclass(frozen=True, slots=True)
class ProgramChange:
    """One quantity of a program before and after.

    Attributes:
        quantity: path (of the tool, mm), speed (share), load (kg at the tool), friction (share), residual (N·m or N).
        joint: that it is about; None for the arm.
        value: after less before.
        ci95: its interval, over the cycles.
        least: a change below this is not worth a word, in the unit of the value.
        changed: whether the whole interval lies beyond that.
        share: where on the path it is largest; None where it is of the whole.
        text: in words.
    """

    quantity: ChangedQuantity
    joint: str | None
    value: float
    ci95: tuple[float, float]
    least: float
    changed: bool
    share: float | None
    text: str


@dataclass(frozen=True, slots=True)
class ProgramComparison:
    """The same program in two logs, as ``changes`` of ``summary.json`` has it.

    Attributes:
        log, against: names of the later and of the earlier log.
        cycles: compared of each, the earlier first.
        changes: every quantity, changed or not; none where nothing could be compared.
        reason: why nothing could be compared; empty where it was.
    """

    log: str
    against: str
    cycles: tuple[int, int]
    changes: tuple[ProgramChange, ...] = ()
    reason: str = ""


@dataclass(frozen=True, slots=True)
class ArmLink:
    """One joint of the model, which turns about the z of its own axes or slides along it.

    Attributes:
        joint: whose position moves it; None for one that is held.
        parent: number of the joint that moves this one, -1 for the base.
        prismatic: whether it slides.
        rotation: its axes at position zero in its parent's: a rotation matrix, row by row.
        translation_m: its origin there.
        factor, offset: its position is ``factor`` times that of ``joint``, plus ``offset``, rad or m.
    """

    joint: str | None
    parent: int
    prismatic: bool
    rotation: tuple[float, ...]
    translation_m: tuple[float, float, float]
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class ArmGeometry:
    """All joints, parents before children, and the tool: the joint that moves it (-1: none) and its place there, m."""

    links: tuple[ArmLink, ...]
    tool_link: int
    tool_m: tuple[float, float, float]


def arm_at(arm: ArmGeometry, position: Mapping[str, float]) -> tuple[FloatArray, FloatArray]:
    """Where the joints and the tool are: the product of one rotation and one translation a joint.

    Args:
        arm: its kinematics.
        position: of each joint, rad or m.

    Returns:
        (k + 1, 3) origins of the k joints and of the tool in the base, m; (k, 3) directions of the joints' axes.
    """
    turns, origins = [np.eye(3)], [np.zeros(3)]  # the base first
    for link in arm.links:
        q = link.offset + (0.0 if link.joint is None else link.factor * position[link.joint])
        turn = turns[link.parent + 1] @ np.reshape(link.rotation, (3, 3))
        origin = origins[link.parent + 1] + turns[link.parent + 1] @ link.translation_m
        c, s = (1.0, 0.0) if link.prismatic else (np.cos(q), np.sin(q))
        origins.append(origin + (q * turn[:, 2] if link.prismatic else 0.0))
        turns.append(turn @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))
    tool = origins[arm.tool_link + 1] + turns[arm.tool_link + 1] @ arm.tool_m
    return np.array([*origins[1:], tool]), np.array([turn[:, 2] for turn in turns[1:]])
