"""What is done to logs so that samples stand where nothing was measured, over a push: by loggers, tables and hands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np

from collaudit.core.data.joint_log import JointLog

ALL = ("effort", "position_rad", "velocity_rad_s")
Fault = Callable[[JointLog, int, int], JointLog]


def pushed(log: JointLog, j: int, onset_s: float, length_s: float, size_nm: float) -> JointLog:
    """The log with a push on one joint, with edges of 10 ms."""
    assert log.effort is not None
    since = log.time_s - onset_s
    rising = np.clip(np.minimum(since, length_s - since) / 0.01, 0.0, 1.0)
    effort = log.effort.copy()
    effort[:, j] += size_nm * (0.5 - 0.5 * np.cos(np.pi * rising))
    return replace(log, effort=effort)


def rows(log: JointLog, index: np.ndarray, time_s: np.ndarray | None = None) -> JointLog:
    """Some rows of a log, with other stamps where they are given."""
    arrays = {f.name: getattr(log, f.name) for f in fields(log)}
    taken = {name: x[index] for name, x in arrays.items() if isinstance(x, np.ndarray)}
    return replace(log, **taken | ({} if time_s is None else {"time_s": time_s}))


def _each(*names: str, change: Callable[[np.ndarray, int, int], None]) -> Fault:
    def spoilt(log: JointLog, a: int, b: int) -> JointLog:
        parts = {name: np.array(getattr(log, name)) for name in names}
        for x in parts.values():
            change(x, a, b)
        return replace(log, **parts)  # type: ignore[arg-type]

    return spoilt


def _fill(x: np.ndarray, a: int, b: int) -> None:
    share = (np.arange(a, b) - (a - 1))[:, None] / (b - a + 1)
    x[a:b] = (1 - share) * x[a - 1] + share * x[b]


def _hold(x: np.ndarray, a: int, b: int) -> None:
    x[a:b] = x[a - 1]


def _hold_with_noise(x: np.ndarray, a: int, b: int) -> None:
    x[a:b] = x[a - 1] + np.random.default_rng(a).normal(0.0, 0.02, x[a:b].shape)


def _replay(x: np.ndarray, a: int, b: int) -> None:
    x[a:b] = x[2 * a - b : a].copy()


def _cut(log: JointLog, a: int, b: int) -> JointLog:
    index = np.r_[0:a, b : log.time_s.size]
    return rows(log, index, log.time_s[: index.size])


def _doubled(bridged_first: bool) -> Fault:
    """Every row twice; of one copy the efforts bridge the push, with their noise."""

    def spoilt(log: JointLog, a: int, b: int) -> JointLog:
        assert log.effort is not None
        bridged, rng = log.effort.copy(), np.random.default_rng(b)
        noise = np.median(np.abs(np.diff(log.effort, axis=0)), axis=0)
        _fill(bridged, a, b)
        bridged[a:b] += noise * rng.normal(0.0, 1.0, bridged[a:b].shape)
        out = rows(log, np.repeat(np.arange(log.time_s.size), 2))
        assert out.effort is not None
        effort = out.effort.copy()
        effort[0 if bridged_first else 1 :: 2] = bridged
        return replace(out, effort=effort)

    return spoilt


FAULTS: dict[str, Fault] = {
    "efforts interpolated": _each("effort", change=_fill),
    "all columns interpolated": _each(*ALL, change=_fill),
    "efforts held": _each("effort", change=_hold),
    "efforts held, with noise": _each("effort", change=_hold_with_noise),
    "all columns held": _each(*ALL, change=_hold),
    "efforts replayed": _each("effort", change=_replay),
    "all columns replayed": _each(*ALL, change=_replay),
    "doubled, bridged first": _doubled(True),
    "doubled, push first": _doubled(False),
    "rows cut out, stamps closed up": _cut,
}
