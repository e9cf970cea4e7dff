"""A clock that was set back while recording: a break in time, never two stretches shuffled into one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray, IntArray

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
