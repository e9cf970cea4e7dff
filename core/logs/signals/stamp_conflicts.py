"""Samples of one stamp that contradict each other: two publishers, or two recordings in one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray

#: So many samples must contradict: one is a spike.
_FEW = 5
#: They differ by so many times what nine in ten samples change by, and by so many times what the signal did meanwhile.
_TIMES, _MOTIONS = 10.0, 4.0
#: More samples of one stamp come from a clock that stood still or was not set.
_MOST_ALIKE = 8
#: A clock that is set back so often at most begins a course of its own each time; stamps out of order more often are
#: those of one course.
_MOST_SET_BACK = 20


def contradictions(
    time_s: FloatArray, joints: Sequence[str], position: FloatArray | None, effort: FloatArray | None
) -> list[Finding]:
    """An error where samples of one stamp give other positions or efforts than noise and motion explain.

    Stamps may be coarser than the samples: then a repeated stamp's sample lies on the way to the next one. One that
    does not, while the signal goes on as if it were not there, belongs to another course. Where the clock was set back,
    stamps come again without a contradiction: samples before and behind are not compared.

    Args:
        time_s: (n,) stamps as recorded, s.
        joints: names of the j joints.
        position: (n, j), rad or m.
        effort: (n, j), in any unit.
    """
    finite = np.flatnonzero(np.isfinite(time_s))
    course = np.concatenate(([0], np.cumsum(np.diff(time_s[finite]) < 0))) if finite.size else finite
    if course.size and course[-1] > _MOST_SET_BACK:
        course = np.zeros_like(course)
    sorting = np.lexsort((time_s[finite], course))
    order, course = finite[sorting], course[sorting]
    later = (np.diff(time_s[order]) > 0) | (np.diff(course) > 0)
    fresh = np.concatenate(([True], later)) if order.size else np.zeros(0, np.bool_)
    if np.count_nonzero(~fresh) < _FEW or np.count_nonzero(fresh) < _FEW:
        return []
    for what, values in (("position", position), ("effort", effort)):
        if values is None:
            continue
        for j, joint in enumerate(joints):
            count = int(np.count_nonzero(_apart(values[order, j], fresh)))
            if count >= _FEW:
                text = (
                    f"{count} samples have the stamp of another one and give another {what} of joint '{joint}': two "
                    "publishers, or two recordings in one. Nothing shows which are right, so nothing is judged."
                )
                return [Finding("log-publishers-conflict", "error", text, joint=joint)]
    return []


def _apart(values: FloatArray, fresh: BoolArray) -> BoolArray:
    """(m,) of the samples whose stamp repeats, those on another course than the first of each stamp."""
    kept: IntArray = np.flatnonzero(fresh)
    again: IntArray = np.flatnonzero(~fresh)
    group = np.cumsum(fresh)[again] - 1
    course = values[kept]
    here, there, after = course[group], values[again], course[np.minimum(group + 1, kept.size - 1)]
    changes = np.abs(np.diff(course))
    known = changes[np.isfinite(changes)]
    least = _TIMES * float(np.quantile(known, 0.9)) + 1e-9 * float(np.nanmax(np.abs(course), initial=0.0))
    off = np.abs(there - here)
    few = np.bincount(group, minlength=kept.size)[group] <= _MOST_ALIKE
    return np.asarray(few & (off > least) & (np.abs(there - after) > least) & (off > _MOTIONS * np.abs(after - here)))
