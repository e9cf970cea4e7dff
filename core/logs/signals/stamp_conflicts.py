"""Samples that contradict each other, of one stamp or of stamps in turn: two publishers, or two recordings in one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.runs import marked
from collaudit.core.numeric.stats import NOISE_OF_BENDS, median_of

#: So many samples must contradict: one is a spike.
_FEW = 5
#: A sample that contradicts lies beside the way by so many standard deviations of the difference of two samples and
#: this share of what the signal moved, alone or in the mean of so many.
_SURE, _ON_THE_WAY, _TOGETHER = 6.0 * 2.0**0.5, 0.5, (1, 4, 16)
#: A sample apart from its neighbours lies apart by so many times what these differ by.
_MOTIONS = 4.0
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
        return _two_courses(column[order], fresh, repeats)

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


def _in_order(time_s: FloatArray) -> tuple[IntArray | slice, BoolArray]:
    """Samples in order of their stamps, a slice where all are; and which of them, so ordered, begin a new stamp."""
    steps = np.diff(time_s, prepend=-np.inf)
    if bool((steps >= 0).all()) and bool(np.isfinite(time_s[-1:]).all()):
        return slice(None), steps > 0
    finite = np.flatnonzero(np.isfinite(time_s))
    course = np.concatenate(([0], np.cumsum(np.diff(time_s[finite]) < 0))) if finite.size else finite
    if course.size and course[-1] > _MOST_SET_BACK:
        course = np.zeros_like(course)
    sorting = np.lexsort((time_s[finite], course))
    order, course = finite[sorting], course[sorting]
    return order, (np.diff(time_s[order], prepend=-np.inf) > 0) | (np.diff(course, prepend=0) > 0)


def _two_courses(values: FloatArray, fresh: BoolArray, repeats: bool) -> str | None:
    """What shows that samples (n,), in order of their stamps, belong to two courses; None where nothing does."""
    if repeats:
        count = int(np.count_nonzero(_off_course(values, fresh)))
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
    far = np.abs(np.diff(values)) > _MEDIANS * median_of(some)
    at: IntArray = np.flatnonzero(far[:-1] & far[1:])
    before, after = values[at + 1] - values[at], values[at + 2] - values[at + 1]
    least = np.minimum(np.abs(before), np.abs(after))
    return at[(before * after < 0) & (least > _MOTIONS * np.abs(before + after))]


def contradicting(time_s: FloatArray, values: FloatArray) -> BoolArray | None:
    """(n,) samples of stamps whose samples give other values than noise and motion explain; None where there are none.

    Stamps may be coarser than the samples: then a repeated stamp's sample lies on the way to the next one. How far one
    lies beside that way is compared with the channel's noise, alone and in the mean over several.

    Args:
        time_s: (n,) stamps as recorded, s.
        values: (n,) of one channel.
    """
    order, fresh = _in_order(time_s)
    if bool(fresh.all()) or np.count_nonzero(fresh) < _FEW:
        return None
    wrong = _off_course(values[order], fresh)
    if not wrong.any():
        return None
    stamps = np.zeros(int(np.count_nonzero(fresh)), dtype=np.bool_)
    stamps[(np.cumsum(fresh) - 1)[~fresh][wrong]] = True
    out = np.zeros(time_s.size, dtype=np.bool_)
    out[order] = stamps[np.cumsum(fresh) - 1]
    return out


def _off_course(values: FloatArray, fresh: BoolArray) -> BoolArray:
    """(m,) of the samples whose stamp repeats, those that lie beside the way from the first of it to the next stamp's.

    Args:
        values: (n,) in order of their stamps.
        fresh: (n,) which begin a new stamp.
    """
    kept: IntArray = np.flatnonzero(fresh)
    again: IntArray = np.flatnonzero(~fresh)
    group = np.cumsum(fresh)[again] - 1
    course = values[kept]
    steps = np.abs(np.diff(course))
    steps, bends = steps[np.isfinite(steps) & (steps > 0)], np.abs(np.diff(course, 2))
    bends = bends[np.isfinite(bends)]
    if steps.size == 0 or bends.size == 0:  # a channel that is not known, or does not change
        return np.asarray(np.abs(values[again] - course[group]) > 0.0)
    noise = _SURE * max(median_of(bends) * NOISE_OF_BENDS, float(steps.min()))
    before, here = course[np.maximum(group - 1, 0)], course[group]
    after, there = course[np.minimum(group + 1, kept.size - 1)], values[again]
    motion = np.fmax(np.abs(after - here), np.abs(here - before))
    excess = there - np.clip(there, np.fmin(here, after), np.fmax(here, after))
    excess[group + 1 == kept.size] = 0.0  # where the last one leads to is not known
    few = np.bincount(group, minlength=kept.size)[group] <= _MOST_ALIKE
    excess, motion = np.where(few & np.isfinite(excess), excess, 0.0), np.where(np.isfinite(motion), motion, 0.0)
    out = np.zeros(again.size, dtype=np.bool_)
    for count in _TOGETHER:
        if again.size < count:
            break
        size, moved = _sums(excess, count), _sums(motion, count)
        first = np.flatnonzero(np.abs(size) > noise * np.sqrt(count) + _ON_THE_WAY * moved)
        out |= marked(first, first + count, again.size)
    return np.asarray(out & (excess != 0.0))


def _sums(x: FloatArray, count: int) -> FloatArray:
    """(m - count + 1,) sums of so many values in a row."""
    total = np.concatenate(([0.0], np.cumsum(x)))
    return total[count:] - total[:-count]
