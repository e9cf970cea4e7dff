"""The residual of a log of which each part is judged by a fit that has not seen it: row by row that of its part."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from collaudit.core.numeric.arrays import BoolArray
from collaudit.core.residual.followed_offsets import FrictionLevel, TorqueZero
from collaudit.core.residual.residual import Residual


def joined_residual(parts: Iterable[tuple[BoolArray, Residual]]) -> Residual:
    """One residual; its levels and zeros of friction are those of the parts, too.

    Args:
        parts: rows (n,) of each part, which together are the log, and a residual of the whole log, which is written
            to. Of detectors that judge each joint.
    """
    remaining = iter(parts)
    rows, first = next(remaining)
    share = float(np.mean(rows))
    levels = {joint: replace(level, mean=share * level.mean) for joint, level in first.levels.items()}
    effort = None if first.effort_nm is None else first.effort_nm.copy(order="K")
    made = replace(first, effort_nm=effort, levels=levels, zeros=dict(first.zeros))
    for rows, part in remaining:
        for mine, its in zip(_arrays(made), _arrays(part), strict=True):
            mine[rows] = its[rows]
        _take_offsets(made, part, rows)
        for joint, amplitude in part.ripple_not_shown_nm.items():
            made.ripple_not_shown_nm[joint] = max(amplitude, made.ripple_not_shown_nm.get(joint, 0.0))
    return made


def _arrays(residual: Residual) -> list[NDArray[Any]]:
    """Those of one row a sample, of both residuals of one log alike."""
    span = residual.span_nm or (None, None)
    every = (
        residual.torque_nm,
        residual.effort_nm,
        residual.state,
        residual.uncertainty_nm,
        residual.hidden_nm,
        residual.balance.total_nm,
        *span,
    )
    return [array for array in every if array is not None]


def _take_offsets(made: Residual, part: Residual, rows: BoolArray) -> None:
    """Levels of friction and zeros of a part, in its rows."""
    share, none = float(np.mean(rows)), np.zeros(rows.size)
    for joint, level in part.levels.items():
        own = made.levels.get(joint, FrictionLevel(none.copy(), none.copy()))
        own.deviation[rows], own.sd[rows] = level.deviation[rows], level.sd[rows]
        made.levels[joint] = replace(own, mean=own.mean + share * level.mean)
    for joint, zero in part.zeros.items():
        found = made.zeros.get(joint, TorqueZero(none.copy(), np.inf, -np.inf, 0.0))
        found.offset_nm[rows] = zero.offset_nm[rows]
        lowest, highest = min(found.lowest_nm, zero.lowest_nm), max(found.highest_nm, zero.highest_nm)
        made.zeros[joint] = TorqueZero(found.offset_nm, lowest, highest, max(found.bound_nm, zero.bound_nm))
