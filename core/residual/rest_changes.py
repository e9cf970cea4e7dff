"""The residual of an arm that never moves and whose friction is not known: the change of its torque."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.signals import State
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.prepare.quiet_level import QuietLevel
from collaudit.core.residual.balance import Balance


def fill_changes(
    prepared: Prepared,
    balance: Balance,
    levels: Mapping[str, QuietLevel],
    columns: Sequence[int],
    torque_nm: FloatArray,
    state: NDArray[np.int8],
) -> None:
    """Fill the columns of still joints without a friction law.

    Behind the gear every change of torque shows: those samples are judged. Before it friction holds what it can: a
    change is evidence of contact, no change is not evidence of absence.

    Args:
        prepared: the log.
        balance: torque before friction, through the detector's kernel.
        levels: of the still joints.
        columns: those without a law.
        torque_nm, state: (n, j) to be filled.
    """
    series = prepared.judged_series
    assert balance.total_nm is not None
    for j in columns:
        quiet = levels.get(series.joint_names[j])
        if quiet is None:
            continue
        level = balance.kernel.apply(quiet.level_nm[:, None], series.segments, series.period_s)[:, 0]
        torque_nm[:, j] = balance.total_nm[:, j] - level
        state[:, j] = State.JUDGED if prepared.effort_source == "joint" else State.FRICTION_INTERVAL
