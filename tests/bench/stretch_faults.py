"""Faults of stretches and stamps: rows filled, frozen, replayed, doubled, lost; cells without a value; flags; clocks.

See ``log_faults``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from log_faults import LogFault, Place, columns_of, with_values

from collaudit.core.data.joint_log import Annotation, JointLog

#: Of most of a log a little is left in each so many seconds.
_EVERY_S = 2.5
_FIELDS = ("position_rad", "velocity_rad_s", "effort")


def _stretches(log: JointLog, place: Place, length: float) -> Iterator[slice]:
    for at in place.times:
        a, b = np.searchsorted(log.time_s, [at - length / 2, at + length / 2])
        if b > a:
            yield slice(int(a), int(b))


def _copies(log: JointLog, fields: tuple[str, ...]) -> dict[str, np.ndarray]:
    return {name: np.array(getattr(log, name)) for name in fields if getattr(log, name) is not None}


def stretches() -> Iterator[LogFault]:
    """Rows that were filled, frozen or copied."""

    def filled(log: JointLog, place: Place, length: float, fields: tuple[str, ...]) -> JointLog:
        values = _copies(log, fields)
        for part in _stretches(log, place, length):
            share = np.linspace(0.0, 1.0, part.stop - part.start + 2)[1:-1, None]
            for value in values.values():
                first, last = value[max(0, part.start - 1)], value[min(len(value) - 1, part.stop)]
                value[part] = (1.0 - share) * first + share * last
        return with_values(log, **values)

    def frozen(log: JointLog, place: Place, length: float, fields: tuple[str, ...], noise: float) -> JointLog:
        values = _copies(log, fields)
        for part in _stretches(log, place, length):
            for value in values.values():
                value[part] = value[part.start] + noise * place.rng.standard_normal(value[part].shape)
        return with_values(log, **values)

    def replayed(log: JointLog, place: Place, length: float, fields: tuple[str, ...]) -> JointLog:
        values = _copies(log, fields)
        for part in _stretches(log, place, length):
            for value in values.values():
                value[part] = value[2 * part.start - part.stop : part.start]
        return with_values(log, **values)

    effort = ("effort",)
    for words, fields in (("all columns", _FIELDS), ("efforts", effort)):
        for length in (0.4, 0.8):
            change = partial(filled, length=length, fields=fields)
            yield LogFault("interpolated gap", f"{words}, {length:g} s", change, blinds=True)
            change = partial(replayed, length=length, fields=fields)
            yield LogFault("replayed", f"{words}, {length:g} s", change, blinds=True)
        yield LogFault("frozen", f"{words}, 0.5 s", partial(frozen, length=0.5, fields=fields, noise=0.0), blinds=True)
    noisy = partial(frozen, length=0.5, fields=effort, noise=0.02)
    yield LogFault("frozen", "efforts, 0.5 s, with noise of 0.02", noisy, blinds=True)


def stamps() -> Iterator[LogFault]:
    """Samples twice, rows lost, clocks."""

    def rows(log: JointLog, chosen: np.ndarray, time_s: np.ndarray) -> JointLog:
        values = {name: value[chosen] for name, value in _copies(log, _FIELDS).items()}
        return with_values(log, time_s=time_s, **values)

    def doubled(log: JointLog, place: Place, calm_first: bool, size: float) -> JointLog:
        assert log.effort is not None
        calm = np.array(log.effort)
        for part in _stretches(log, place, 0.5):
            share = np.linspace(0.0, 1.0, part.stop - part.start)[:, None]
            calm[part] = (1.0 - share) * calm[part.start] + share * calm[part.stop - 1]
        calm += size * place.rng.standard_normal(calm.shape)
        pair = (calm, log.effort) if calm_first else (log.effort, calm)
        twice = np.repeat(np.arange(log.time_s.size), 2)
        out = rows(log, twice, log.time_s[twice])
        return with_values(out, effort=np.stack(pair, axis=1).reshape(len(twice), -1))

    def renumbered(log: JointLog, place: Place, length: float, share: float) -> JointLog:
        keep = place.rng.random(log.time_s.size) >= share
        for part in _stretches(log, place, length):
            keep[part] = False
        chosen = np.flatnonzero(keep)
        return rows(log, chosen, log.time_s[: chosen.size])

    def clock(log: JointLog, place: Place, factor: float, jitter_s: float) -> JointLog:
        noise = jitter_s * place.rng.standard_normal(log.time_s.size)
        time_s = np.sort(factor * log.time_s + noise)
        return with_values(log, time_s=time_s - time_s[0])

    def thinned(log: JointLog, place: Place, every: int, back: bool) -> JointLog:
        chosen = np.arange(0, log.time_s.size, every)
        few = rows(log, chosen, log.time_s[chosen])
        if not back:
            return few
        full = {
            name: np.column_stack([np.interp(log.time_s, few.time_s, x) for x in value.T])
            for name, value in _copies(few, _FIELDS).items()
        }
        return with_values(log, **full)

    for first, words in ((True, "without the push first"), (False, "with the push first")):
        change = partial(doubled, calm_first=first, size=0.0)
        yield LogFault("one stamp twice", f"efforts {words}", change, blinds=True)
        change = partial(doubled, calm_first=first, size=0.5)
        yield LogFault("one stamp twice", f"efforts {words}, both noisy", change, blinds=True)
    for length in (0.25, 0.5):
        change = partial(renumbered, length=length, share=0.0)
        yield LogFault("rows cut, stamps renumbered", f"{length:g} s", change, blinds=True)
    yield LogFault("rows cut, stamps renumbered", "2 % here and there", partial(renumbered, length=0.0, share=0.02))
    for factor in (0.8, 1.25):
        yield LogFault("clock", f"runs × {factor:g}", partial(clock, factor=factor, jitter_s=0.0))
    yield LogFault("clock", "stamps of ± 4 ms", partial(clock, factor=1.0, jitter_s=0.004))
    for every in (5, 12):
        yield LogFault("resampled", f"one row of {every}", partial(thinned, every=every, back=False))
        yield LogFault("resampled", f"one row of {every}, filled up", partial(thinned, every=every, back=True))


def missing() -> Iterator[LogFault]:
    """Cells without a value: of one joint or all, over the push, in most of the log, or in every other row."""

    def lost(log: JointLog, place: Place, fields: tuple[str, ...], who: str, where: str) -> JointLog:
        rows = np.zeros(log.time_s.size, dtype=np.bool_)
        if where == "every other row":
            rows[::2] = True
        if where == "88 % of the log":
            rows = log.time_s % _EVERY_S < 0.88 * _EVERY_S
        if where != "every other row":
            for part in _stretches(log, place, 1.0):
                rows[part] = True
        values = _copies(log, fields)
        for value in values.values():
            value[np.ix_(rows, columns_of(log, who))] = np.nan
        return with_values(log, **values)

    push, most, other = "1 s over the push", "88 % of the log", "every other row"
    for words, fields, who, places in (
        ("positions", ("position_rad",), "one", (push, most)),
        ("positions", ("position_rad",), "all", (most, other)),
        ("velocities", ("velocity_rad_s",), "one", (most,)),
        ("velocities", ("velocity_rad_s",), "all", (most, other)),
        ("efforts", ("effort",), "one", (push, most, other)),
        ("efforts", ("effort",), "all", (most, other)),
    ):
        for where in places:
            change = partial(lost, fields=fields, who=who, where=where)
            blinds = words == "efforts" and where != other  # others may feel little of the push
            yield LogFault("missing values", f"{words} of {who}, {where}", change, blinds=blinds)


#: Efforts that swing by so much, N·m, so many times a second.
_SWING_NM, _SWING_HZ = 68.0, 5.0


def unjudged() -> Iterator[LogFault]:
    """The push lies in time that is not judged, and its efforts are on record."""

    def flagged(log: JointLog, place: Place, name: str, length: float) -> JointLog:
        times = tuple((at - length / 2, at + length / 2) for at in place.times)
        return replace(log, annotations=(*log.annotations, Annotation(name, "mode", times)))

    def sparse(log: JointLog, place: Place, every: int, length: float) -> JointLog:
        keep = np.ones(log.time_s.size, dtype=np.bool_)
        for part in _stretches(log, place, length):
            keep[part] = np.arange(part.stop - part.start) % every == 0
        return log.samples(keep)

    def placeless(log: JointLog, place: Place, length: float, swing_nm: float) -> JointLog:
        values = _copies(log, ("position_rad", "effort"))
        for part in _stretches(log, place, length):
            values["position_rad"][part] = np.nan
            swing = swing_nm * np.sin(2 * np.pi * _SWING_HZ * (log.time_s[part] - log.time_s[part.start]))
            values["effort"][part] += swing[:, None]
        return with_values(log, **values)

    for name in ("freedrive", "protective_stop", "power_off"):
        for length in (0.4, 1.5):
            yield LogFault("mode flag", f"{name}, {length:g} s", partial(flagged, name=name, length=length))
    for every, length in ((3, 1.0), (6, 1.0), (12, 1.0), (25, 1.0), (12, 3.0)):
        words = f"one row of {every}, {length:g} s"
        yield LogFault("rows thinned", words, partial(sparse, every=every, length=length))
    for length in (0.4, 1.0):
        for swing_nm in (0.0, _SWING_NM):
            words = f"{length:g} s, efforts " + (f"that swing by {swing_nm:g} N·m" if swing_nm else "as they are")
            yield LogFault("no positions", words, partial(placeless, length=length, swing_nm=swing_nm))
