"""The residual of a log of which each part is judged by a fit that has not seen it: row by row that of its part."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from collaudit.core.numeric.arrays import BoolArray
from collaudit.core.residual.friction_level import FrictionLevel
from collaudit.core.residual.residual import Residual
from collaudit.core.residual.torque_zero import TorqueZero

Levels = dict[str, FrictionLevel]
Zeros = dict[str, TorqueZero]


def joined_residual(parts: Iterable[tuple[BoolArray, Residual]]) -> Residual:
    """One residual; its levels and zeros of friction are those of the parts, too.

    Args:
        parts: rows (n,) of each part, which together are the log, and a residual of the whole log, which is written
            to. Of detectors that judge each joint.
    """
    remaining = iter(parts)
    rows, first = next(remaining)
    made = replace(first, effort_nm=None if first.effort_nm is None else first.effort_nm.copy(order="K"))
    levels, zeros = _levels_and_zeros(made, None, rows)
    for rows, part in remaining:
        for mine, its in zip(_arrays(made), _arrays(part), strict=True):
            mine[rows] = its[rows]
        levels, zeros = _levels_and_zeros(part, (levels, zeros), rows)
        for joint, amplitude in part.ripple_not_shown_nm.items():
            made.ripple_not_shown_nm[joint] = max(amplitude, made.ripple_not_shown_nm.get(joint, 0.0))
    return replace(made, levels=levels, zeros=zeros)


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


def _levels_and_zeros(part: Residual, made: tuple[Levels, Zeros] | None, rows: BoolArray) -> tuple[Levels, Zeros]:
    """Those of the part in its rows, of what was made before elsewhere; 0 where neither knows."""
    share, size = float(np.mean(rows)), rows.size
    before, known = made or ({}, {})
    none = FrictionLevel(np.zeros(size), np.zeros(size))
    levels = {}
    for joint in before.keys() | part.levels.keys():
        old, new = before.get(joint, none), part.levels.get(joint, none)
        levels[joint] = FrictionLevel(
            np.where(rows, new.deviation, old.deviation),
            np.where(rows, new.sd, old.sd),
            old.mean + share * new.mean,
        )
    zeros = {}
    for joint in known.keys() | part.zeros.keys():
        both = [zero for zero in (known.get(joint), part.zeros.get(joint)) if zero is not None]
        old_nm, new_nm = (0.0 if joint not in its else its[joint].offset_nm for its in (known, part.zeros))
        zeros[joint] = TorqueZero(
            np.where(rows, new_nm, old_nm),
            min(zero.lowest_nm for zero in both),
            max(zero.highest_nm for zero in both),
            max(zero.bound_nm for zero in both),
        )
    return levels, zeros
