"""Cells of a log turned to NaN, by chance, and the same log without the rows that then lack a measurement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from hypothesis import strategies as st

from collaudit.core.data.joint_log import JointLog

SIGNALS = ("position_rad", "velocity_rad_s", "effort")


@dataclass(frozen=True, slots=True)
class Hole:
    """Cells of some signals and joints: ``cells`` of every ``every`` rows in a stretch of the log, in shares of it."""

    signals: tuple[str, ...]
    joints: tuple[int, ...]
    start: float
    length: float
    every: int
    cells: int

    def rows(self, count: int) -> np.ndarray:
        """(m,) rows of a log of so many."""
        first = int(self.start * count)
        rows = np.arange(first, min(count, first + max(1, int(self.length * count))))
        return rows[(rows - first) % self.every < self.cells]


def holes(joints: int, longest: float = 0.3) -> st.SearchStrategy[list[Hole]]:
    """A few holes; short ones as often as long ones, cells in a row and here and there."""
    hole = st.builds(
        Hole,
        signals=st.lists(st.sampled_from(SIGNALS), min_size=1, unique=True).map(tuple),
        joints=st.one_of(
            st.lists(st.integers(0, joints - 1), min_size=1, max_size=joints, unique=True).map(tuple),
            st.just(tuple(range(joints))),
        ),
        start=st.floats(0.0, 1.0),
        length=st.floats(-7.0, 0.0).map(lambda x: longest * 2.0**x),
        every=st.sampled_from((1, 1, 2, 3, 10, 40)),
        cells=st.integers(1, 6),
    )
    return st.lists(hole, min_size=1, max_size=4)


def with_holes(log: JointLog, chosen: Sequence[Hole]) -> JointLog:
    """The log with these cells NaN."""
    values = {name: np.array(getattr(log, name)) for name in SIGNALS}
    for hole in chosen:
        for name in hole.signals:
            values[name][np.ix_(hole.rows(log.time_s.size), hole.joints)] = np.nan
    return replace(log, **values)


def without_their_rows(log: JointLog) -> JointLog:
    """The log without the rows that lack a position or an effort; a velocity is derived from positions."""
    assert log.effort is not None
    kept = np.isfinite(log.position_rad).all(axis=1) & np.isfinite(log.effort).all(axis=1)
    return log.samples(np.asarray(kept))
