"""A cause of a residual that is off, as `audit.json` has it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Cause:
    """What would take the residual of a log away, had it been stated; it never changes a verdict.

    Attributes:
        code: friction, scale, zero, delay, swapped, mounting, tool, description, force (in base axes) or pull (in the
            tool's).
        joints: those that it is about; empty for the arm.
        text: in words.
        share: of what the residual has beyond that of the fitted motion, gone in blocks of time that the solve has
            not seen.
        value: parameters: factors less one (of a description one itself); N·m and drift in half the log; s; m/s² of
            gravity in base axes; kg and kg·m at the tool; N.
        ci95: their intervals.
        line: what to state, or to do; empty where nothing helps.
        speaks: it explains most, and enough.
    """

    code: str
    joints: tuple[str, ...]
    text: str
    share: float
    value: tuple[float, ...]
    ci95: tuple[tuple[float, float], ...]
    line: str
    speaks: bool
