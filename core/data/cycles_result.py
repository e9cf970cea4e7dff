"""What an audit says of the cycles of a log, and what a store keeps of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from collaudit.core.numeric.arrays import FloatArray


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
