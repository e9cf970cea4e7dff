"""What a fit left out of a log, and why."""

from dataclasses import dataclass
from typing import Literal

#: ``found`` in the residual, by the ``labels`` of the log or a truth file, or none because the log was ``stated`` free.
LeftOutBy = Literal["found", "labels", "stated"]


@dataclass(frozen=True, slots=True)
class LeftOutSpan:
    """A stretch in which the arm does not behave as in the rest of its log; it is left out in all joints.

    Attributes:
        start_s, end_s: margins included, seconds from the log's first sample.
        joints: those that show it, the clearest first; empty where it was left out by a label.
        peak: the largest residual in it, in robust standard deviations of its joint; None by a label.
    """

    start_s: float
    end_s: float
    joints: tuple[str, ...]
    peak: float | None


@dataclass(frozen=True, slots=True)
class LeftOut:
    """What one log's fit did without.

    Attributes:
        by: how the stretches were chosen.
        spans: in time order; where ``by`` is ``stated``, those that look like contact and were used all the same.
        seconds: their length.
        share: of the time in which the arm moved, margins included.
        share_seen: the same without margins, of the motion of the joint that has the least left.
        refused: whether so much of the log looks like contact that nothing was fitted on it.
    """

    by: LeftOutBy
    spans: tuple[LeftOutSpan, ...]
    seconds: float
    share: float
    share_seen: float
    refused: bool
