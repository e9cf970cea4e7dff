"""Stamps that contradict what was recorded: a clock that was set back, and two samples of one joint at one time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, marked
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.stats import NOISE_OF_BENDS, median_of

#: Steps back by more than this many periods are looked at; smaller ones are samples that came late.
SET_BACK_PERIODS = 10
#: So many samples with a stamp astray do not make a clock that was set.
_ASTRAY = 3
#: The break is given this many periods, so that nothing is judged or filtered across it.
_BREAK_PERIODS = 10
_NS = 1e9


@dataclass(frozen=True, slots=True)
class SetBack:
    """One place where a clock was set back.

    Attributes:
        at_ns: the last stamp before, as straightened.
        by_ns: how far it went back.
        shift_ns: what was added to every later stamp as recorded.
    """

    at_ns: int
    by_ns: int
    shift_ns: int


def straighten(stamps_ns: IntArray, known: tuple[SetBack, ...] | None = None) -> tuple[IntArray, tuple[SetBack, ...]]:
    """Let time go on where a clock was set back into time already recorded.

    Stretches that do not overlap (chunks of a file out of order) are left to be sorted.

    Args:
        stamps_ns: (n,) stamps in the order of recording.
        known: what another topic of the same clock showed; its shifts are then used, place by place.

    Returns:
        The stamps (the same array where nothing was found), and the places.
    """
    places = _steps_back(stamps_ns)
    if not places.shape[0] or (known is not None and len(known) != places.shape[0]):
        return stamps_ns, ()
    period = int(np.median(np.abs(np.diff(stamps_ns))))
    out = stamps_ns.copy()
    found: list[SetBack] = []
    shift = 0
    for number, place in enumerate(places.tolist()):
        stop = int(places[number + 1]) if number + 1 < places.shape[0] else out.shape[0]
        before = int(out[:place].max())
        piece = stamps_ns[place:stop] + shift
        if known is not None:
            shift = known[number].shift_ns
        elif int(piece.max()) >= int(out[:place].min()):
            shift += before - int(piece.min()) + _BREAK_PERIODS * period
        out[place:stop] = stamps_ns[place:stop] + shift
        if known is not None or out[place] > before:
            found.append(SetBack(before, int(stamps_ns[place - 1] - stamps_ns[place]), shift))
    return out, tuple(found)


def _steps_back(stamps: IntArray) -> IntArray:
    """Indices of the first samples after a step back that lasts."""
    if stamps.shape[0] < 2 * _ASTRAY + 2 or not (stamps[1:] < stamps[:-1]).any():
        return np.empty(0, dtype=np.int64)
    steps = np.diff(stamps)
    limit = SET_BACK_PERIODS * int(np.median(np.abs(steps)))
    places = np.flatnonzero(steps < -max(limit, 1)) + 1
    last = stamps.shape[0] - 1
    after = stamps[np.minimum(places + _ASTRAY, last)]
    before = stamps[np.maximum(places - 1 - _ASTRAY, 0)]
    return np.asarray(places[after < before], dtype=np.int64)


def as_recorded(stamps_ns: IntArray, found: tuple[SetBack, ...]) -> IntArray:
    """Straightened stamps as they were recorded."""
    if not found:
        return stamps_ns
    shifts = np.array([0, *(place.shift_ns for place in found)], dtype=np.int64)
    after = np.searchsorted(np.array([place.at_ns for place in found]), stamps_ns, side="left")
    return np.asarray(stamps_ns - shifts[after], dtype=np.int64)


def straighten_seconds(time_s: FloatArray) -> tuple[FloatArray, tuple[SetBack, ...]]:
    """As :func:`straighten`, of seconds; stamps that are not numbers are left as they are."""
    if bool((time_s[1:] >= time_s[:-1]).all()):
        return time_s, ()
    finite = np.flatnonzero(np.isfinite(time_s) & (np.abs(time_s) < 9e9))
    stamps = np.round(time_s[finite] * _NS).astype(np.int64)
    straight, found = straighten(stamps)
    if not found:
        return time_s, ()
    out = time_s.copy()
    out[finite] += (straight - stamps) / _NS
    return out, found


def set_back_findings(found: tuple[SetBack, ...], origin_ns: int, where: str) -> list[Finding]:
    """One finding a place.

    Args:
        found: the places.
        origin_ns: time zero of the log.
        where: the topic or file.
    """
    findings = []
    for place in found:
        at_s = (place.at_ns - origin_ns) / _NS
        text = (
            f"The clock was set back by {place.by_ns / _NS:.4g} s at {at_s:.4g} s, into time already recorded: later "
            f"samples follow after a break, their stamps as recorded plus {place.shift_ns / _NS:.6g} s."
        )
        findings.append(Finding("log-clock", "warning", text, where=where, start_s=at_s))
    return findings


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
