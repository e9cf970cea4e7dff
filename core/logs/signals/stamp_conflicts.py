"""Samples that contradict each other, of one stamp or of stamps in turn: two publishers, or two recordings in one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.blocks import steps_exceed
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.stats import median_of, quantile_of

#: So many samples must contradict: one is a spike.
_FEW = 5
#: They differ by so many times what nine in ten samples change by, and by so many times what the signal did meanwhile.
_TIMES, _MOTIONS = 10.0, 4.0
#: Of two publishers who stamp each by their own clock, so many samples among so many lie apart from both neighbours, by
#: so many medians of what samples change by. Real arms: at most 4, and most of them none, by 24 medians.
_SPRINGING, _CROWD, _MEDIANS = 8, 100, 30.0
#: So many changes tell their median.
_LOOKED_AT = 50_000
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
    stamps come again without a contradiction: samples before and behind are not compared. Stamps of two clocks are
    seldom the same: there many samples lie far from both their neighbours, which agree with each other.

    Args:
        time_s: (n,) stamps as recorded, s.
        joints: names of the j joints.
        position: (n, j), rad or m.
        effort: (n, j), in any unit.
    """
    order, fresh = _in_order(time_s)
    repeats = bool(min(np.count_nonzero(~fresh), np.count_nonzero(fresh)) >= _FEW)

    def shown(column: FloatArray) -> str | None:
        return _two_courses(column if order is None else column[order], fresh, repeats)

    for what, values in (("position", position), ("effort", effort)):
        if values is None:
            continue
        for joint, said in zip(joints, ordered_map(shown, values.T), strict=True):
            if said is not None:
                text = (
                    f"{said} another {what} of joint '{joint}': two publishers, or two recordings in one. "
                    "Nothing shows which are right, so nothing is judged."
                )
                return [Finding("log-publishers-conflict", "error", text, joint=joint)]
    return []


def _in_order(time_s: FloatArray) -> tuple[IntArray | None, BoolArray]:
    """Samples in order of their stamps, None where all are; and which of them, so ordered, begin a new stamp."""
    steps = np.diff(time_s)
    if bool((steps >= 0).all()) and bool(np.isfinite(time_s[-1:]).all()):
        return None, np.concatenate((np.ones(min(1, time_s.size), np.bool_), steps > 0))
    finite = np.flatnonzero(np.isfinite(time_s))
    course = np.concatenate(([0], np.cumsum(np.diff(time_s[finite]) < 0))) if finite.size else finite
    if course.size and course[-1] > _MOST_SET_BACK:
        course = np.zeros_like(course)
    sorting = np.lexsort((time_s[finite], course))
    order, course = finite[sorting], course[sorting]
    later = (np.diff(time_s[order]) > 0) | (np.diff(course) > 0)
    return order, np.concatenate((np.ones(min(1, order.size), np.bool_), later))


def _two_courses(values: FloatArray, fresh: BoolArray, repeats: bool) -> str | None:
    """What shows that samples (n,), in order of their stamps, belong to two courses; None where nothing does."""
    if repeats:
        count = int(np.count_nonzero(_apart(values, fresh)))
        if count >= _FEW:
            return f"{count} samples have the stamp of another one and give"
    at = _springing(values)
    if at.size >= _SPRINGING and int((at[_SPRINGING - 1 :] - at[: at.size - _SPRINGING + 1]).min()) < _CROWD:
        return f"{at.size} samples lie far from both their neighbours ({_SPRINGING} or more among {_CROWD}) and give"
    return None


def _springing(values: FloatArray) -> IntArray:
    """Places of the samples (n,) that lie far to one side of both their neighbours, which agree with each other."""
    every = max(1, (values.size - 1) // _LOOKED_AT)
    some = np.abs(values[1:][::every] - values[:-1][::every])
    some = some[np.isfinite(some) & (some > 0)]
    if some.size < _CROWD:
        return np.zeros(0, dtype=np.int64)
    far = steps_exceed(values, _MEDIANS * median_of(some))
    at: IntArray = np.flatnonzero(far[:-1] & far[1:])
    before, after = values[at + 1] - values[at], values[at + 2] - values[at + 1]
    least = np.minimum(np.abs(before), np.abs(after))
    return at[(before * after < 0) & (least > _MOTIONS * np.abs(before + after))]


def _apart(values: FloatArray, fresh: BoolArray) -> BoolArray:
    """(m,) of the samples whose stamp repeats, those on another course than the first of each stamp."""
    kept: IntArray = np.flatnonzero(fresh)
    again: IntArray = np.flatnonzero(~fresh)
    group = np.cumsum(fresh)[again] - 1
    course = values[kept]
    here, there, after = course[group], values[again], course[np.minimum(group + 1, kept.size - 1)]
    changes = np.abs(np.diff(course))
    known = changes[np.isfinite(changes)]
    if known.size == 0:  # a channel that is not known, or stamps that are all the same
        return np.zeros(again.size, dtype=np.bool_)
    least = _TIMES * quantile_of(known, 0.9) + 1e-9 * float(np.nanmax(np.abs(course), initial=0.0))
    off = np.abs(there - here)
    few = np.bincount(group, minlength=kept.size)[group] <= _MOST_ALIKE
    return np.asarray(few & (off > least) & (np.abs(there - after) > least) & (off > _MOTIONS * np.abs(after - here)))
