"""Values that are missing from a log: a row without the position of every joint is a lost row.

The model's torque of any joint takes the positions of all. Such a row tells nothing, and leaves the log as if it had
never been recorded. A missing velocity is derived (``velocity_choice.py``); a missing effort is its joint's alone.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import NotJudgedError
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray


def positions_known(log: JointLog) -> BoolArray:
    """(n,) rows with the position of every joint."""
    if np.isfinite(log.position_rad.sum()):
        return np.ones(log.time_s.size, dtype=np.bool_)
    return np.asarray(np.isfinite(log.position_rad).all(axis=1))


def with_positions(log: JointLog) -> JointLog:
    """The log without the rows that lack the position of a joint; unchanged where none does.

    Args:
        log: (n, j) signals.

    Raises:
        NotJudgedError: a joint has no position in any row.
    """
    known = positions_known(log)
    if known.all():
        return log
    if not known.any():
        never = [
            joint for joint, x in zip(log.joint_names, log.position_rad.T, strict=True) if not np.isfinite(x).any()
        ]
        named = ", ".join(f"'{joint}'" for joint in never)
        raise NotJudgedError(
            "no row of the log holds the positions of all joints",
            where=log.source.name,
            found=f"no position of {named} in any row" if named else "rows that each lack a joint's position",
            expected="the position of every joint of the model, in the same row",
            hint="check [log.csv] position or [log] joint_states: another column or topic may hold the positions",
        )
    return log.samples(known)


def lost_ends_s(log: JointLog) -> float:
    """Time before the first and after the last row that holds the position of every joint, s."""
    known = positions_known(log)
    stamped = np.isfinite(log.time_s)
    if known.all() or not (known & stamped).any():
        return 0.0
    whole, kept = log.time_s[stamped], log.time_s[known & stamped]
    return float(np.ptp(whole) - np.ptp(kept))


def missing_findings(log: JointLog) -> Iterator[Finding]:
    """How many positions and efforts of each joint are missing."""
    for name, values, so in (
        ("position", log.position_rad, "; rows without one count as lost"),
        ("effort", log.effort, ""),
    ):
        if values is None or np.isfinite(values.sum()):
            continue
        for joint, bad in zip(log.joint_names, np.count_nonzero(~np.isfinite(values), axis=0).tolist(), strict=True):
            if bad:
                text = f"{bad} of {len(values)} {name} values of joint '{joint}' are missing or not a number{so}."
                yield Finding("log-nan", "warning", text, joint=joint)
