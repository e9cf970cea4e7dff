"""What loggers, networks, drives and people do to a log, by class and name: for any arm, at any time.

A fault changes a log in memory. What it does to the whole log needs no place; what it does to a stretch happens at the
times that it is told: over the push of the judged log, and now and then in the fitted one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.signal import butter, lfilter, sosfiltfilt

from collaudit.core.data.joint_log import JointLog
from collaudit.core.robot.robot_model import RobotModel

Change = Callable[[JointLog, "Place"], JointLog]


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Where and on which arm.

    Attributes:
        times: middles of the stretches that are spoilt, s.
        model: the arm as it is.
        tool_frame: where something is carried.
        rng: of what is random in a fault.
    """

    times: tuple[float, ...]
    model: RobotModel
    tool_frame: str
    rng: np.random.Generator


@dataclass(frozen=True, slots=True)
class LogFault:
    """One variant.

    Attributes:
        kind: class, as the table has it.
        name: of the variant.
        change: of the log; None for a fault of the settings alone.
        lacks: what the configuration does not state: ``tool``, ``armature``.
        blinds: whether the push is no longer measured: rows that hold it are gone, or made up.
        fit_only: it is of the fitted log by its nature.
    """

    kind: str
    name: str
    change: Change | None = None
    lacks: tuple[str, ...] = field(default=())
    blinds: bool = False
    fit_only: bool = False


def with_values(log: JointLog, **values: Any) -> JointLog:
    return replace(log, **values)


def _period(log: JointLog) -> float:
    return float(np.median(np.diff(log.time_s)))


def _effort(change: Callable[[np.ndarray, JointLog, Place], np.ndarray]) -> Change:
    return lambda log, place: with_values(log, effort=change(np.array(log.effort), log, place))


def columns_of(log: JointLog, who: str) -> list[int]:
    return list(range(len(log.joint_names))) if who == "all" else [1]


def scales() -> Iterator[LogFault]:
    for who, factors in (("all", (0.5, 0.7, 0.8, 0.9, 1.1, 1.25, 1.5)), ("one", (0.5, 0.8, 1.5))):

        def scaled(effort: np.ndarray, log: JointLog, place: Place, factor: float, who: str) -> np.ndarray:
            effort[:, columns_of(log, who)] *= factor
            return effort

        for factor in factors:
            yield LogFault("scale", f"efforts of {who} × {factor:g}", _effort(partial(scaled, factor=factor, who=who)))


def filters() -> Iterator[LogFault]:
    def low_pass(effort: np.ndarray, log: JointLog, place: Place, cut_hz: float) -> np.ndarray:
        b, a = butter(2, min(0.99, 2 * cut_hz * _period(log)))
        return np.asarray(lfilter(b, a, effort - effort[0], axis=0)) + effort[0]

    def both_ways(effort: np.ndarray, log: JointLog, place: Place, cut_hz: float) -> np.ndarray:
        return np.asarray(sosfiltfilt(butter(2, 2 * cut_hz * _period(log), output="sos"), effort, axis=0))

    def mean(effort: np.ndarray, log: JointLog, place: Place, seconds: float) -> np.ndarray:
        count = max(1, round(seconds / _period(log)))
        sums = np.cumsum(np.r_[np.repeat(effort[:1], count, axis=0), effort], axis=0)
        return np.asarray((sums[count:] - sums[:-count]) / count)

    def held(effort: np.ndarray, log: JointLog, place: Place, rate_hz: float) -> np.ndarray:
        count = max(1, round(1.0 / rate_hz / _period(log)))
        return np.asarray(effort[np.arange(len(effort)) // count * count])

    for cut in (0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0):
        yield LogFault("low-pass", f"{cut:g} Hz", _effort(partial(low_pass, cut_hz=cut)))
    for cut in (1.0, 3.0, 10.0):
        yield LogFault("low-pass", f"zero-phase {cut:g} Hz", _effort(partial(both_ways, cut_hz=cut)))
    for seconds in (0.05, 0.1, 0.2, 0.5):
        yield LogFault("moving mean", f"{1000 * seconds:.0f} ms", _effort(partial(mean, seconds=seconds)))
    for rate in (5.0, 10.0, 20.0, 50.0):
        yield LogFault("held", f"effort held at {rate:g} Hz", _effort(partial(held, rate_hz=rate)))


def drives() -> Iterator[LogFault]:
    """Joints mixed up, signs, delays, steps, limits, noise."""

    def swapped(log: JointLog, place: Place, pair: tuple[int, int], fields: tuple[str, ...]) -> JointLog:
        order = list(range(len(log.joint_names)))
        order[pair[0]], order[pair[1]] = order[pair[1]], order[pair[0]]
        present = [name for name in fields if getattr(log, name) is not None]
        return with_values(log, **{name: np.array(getattr(log, name))[:, order] for name in present})

    def flipped(effort: np.ndarray, log: JointLog, place: Place, who: str) -> np.ndarray:
        effort[:, columns_of(log, who)] *= -1.0
        return effort

    def late(log: JointLog, place: Place, name: str, seconds: float) -> JointLog:
        values, count = np.array(getattr(log, name)), round(seconds / _period(log))
        values[count:] = values[: len(values) - count].copy()
        return with_values(log, **{name: values})

    def stepped(log: JointLog, place: Place, name: str, step: float) -> JointLog:
        return with_values(log, **{name: np.round(getattr(log, name) / step) * step})

    def clipped(effort: np.ndarray, log: JointLog, place: Place, share: float) -> np.ndarray:
        most = share * np.quantile(np.abs(effort), 0.999, axis=0)
        return np.clip(effort, -most, most)

    def noisy(effort: np.ndarray, log: JointLog, place: Place, sd: float) -> np.ndarray:
        return effort + sd * place.rng.standard_normal(effort.shape)

    def moved(effort: np.ndarray, log: JointLog, place: Place, by: float, drift: bool) -> np.ndarray:
        effort[:, 1] += by * (log.time_s / log.time_s[-1] if drift else 1.0)
        return effort

    for pair in ((0, 1), (1, 2), (3, 4)):
        change = partial(swapped, pair=pair, fields=("effort",))
        yield LogFault("joints swapped", f"efforts of {pair[0] + 1} and {pair[1] + 1}", change)
    whole = partial(swapped, pair=(3, 4), fields=("position_rad", "velocity_rad_s", "effort"))
    yield LogFault("joints swapped", "all columns of 4 and 5", whole)
    for who in ("one", "all"):
        yield LogFault("sign", f"efforts of {who} inverted", _effort(partial(flipped, who=who)))
    for seconds in (0.008, 0.024, 0.056, 0.104):
        change = partial(late, name="effort", seconds=seconds)
        yield LogFault("delay", f"efforts late by {1000 * seconds:.0f} ms", change)
    yield LogFault("delay", "velocities late by 56 ms", partial(late, name="velocity_rad_s", seconds=0.056))
    for step in (0.5, 2.0):
        yield LogFault("quantised", f"efforts in steps of {step:g} N·m", partial(stepped, name="effort", step=step))
    yield LogFault("quantised", "positions in steps of 1 mrad", partial(stepped, name="position_rad", step=1e-3))
    for share in (0.3, 0.6):
        yield LogFault(
            "clipped", f"efforts at {100 * share:.0f} % of their peak", _effort(partial(clipped, share=share))
        )
    for sd in (1.0, 4.0):
        yield LogFault("noise", f"efforts ± {sd:g} N·m", _effort(partial(noisy, sd=sd)))
    yield LogFault("offset", "5 N·m on joint 2", _effort(partial(moved, by=5.0, drift=False)))
    yield LogFault("offset", "drift to 10 N·m on joint 2", _effort(partial(moved, by=10.0, drift=True)))


def arms() -> Iterator[LogFault]:
    """A load that nothing states, and descriptions that lack what most lack."""

    def carried(log: JointLog, place: Place, mass_kg: float) -> JointLog:
        q = np.ascontiguousarray(log.position_rad)
        wrench = np.zeros((len(q), 6))
        wrench[:, :3] = -mass_kg * place.model.gravity_in(q, place.tool_frame)
        order = [log.joint_names.index(name) for name in place.model.joint_names]
        effort = np.array(log.effort)
        effort[:, order] += place.model.wrench_torque(np.ascontiguousarray(q[:, order]), wrench, place.tool_frame)
        return with_values(log, effort=effort)

    for mass in (0.8, 1.5, 3.0):
        yield LogFault("load not stated", f"{mass:g} kg at the tool", partial(carried, mass_kg=mass))
    yield LogFault("description lacks", "tool", lacks=("tool",))
    yield LogFault("description lacks", "rotor inertia", lacks=("armature",))
    yield LogFault("description lacks", "tool and rotor inertia", lacks=("tool", "armature"))


Spans = Callable[[float, np.random.Generator], list[tuple[float, float]]]


def contacts() -> Iterator[LogFault]:
    """Contact in the fitted log."""

    def pressed(
        log: JointLog, place: Place, spans: Callable[[float, np.random.Generator], list[tuple[float, float]]]
    ) -> JointLog:
        assert log.effort is not None
        effort, joints = np.array(log.effort), len(log.joint_names)
        for start, end in spans(float(log.time_s[-1]), place.rng):
            away = np.minimum(log.time_s - start, end - log.time_s)
            link = int(place.rng.integers(1, joints))
            size = np.where(np.arange(link + 1) < 3, 20.0, 5.0) * place.rng.choice([-1.0, 1.0])
            size *= place.rng.uniform(0.5, 1.0, link + 1)
            effort[:, : link + 1] += np.clip(away / 0.05, 0.0, 1.0)[:, None] * size
        return with_values(log, effort=effort)

    def clamp(share: float) -> Spans:
        def spans(end: float, rng: np.random.Generator) -> list[tuple[float, float]]:
            start = rng.uniform(0.0, end * (1.0 - share))
            return [(start, start + share * end)]

        return spans

    def holds(length: float, every: float) -> Spans:
        return lambda end, rng: [(at, at + length) for at in np.arange(1.0, end - every, every)]

    for share in (0.05, 0.1, 0.2, 0.3, 0.4):
        change = partial(pressed, spans=clamp(share))
        yield LogFault("contact in the fit", f"one clamp of {100 * share:.0f} %", change, fit_only=True)
    for length in (0.3, 0.6, 0.9, 1.2):
        change = partial(pressed, spans=holds(length, 3.0))
        yield LogFault("contact in the fit", f"holds of {length:g} s every 3 s", change, fit_only=True)
    for length, every in ((0.2, 4.0), (0.2, 2.0), (0.2, 1.0), (0.2, 0.5)):
        change = partial(pressed, spans=holds(length, every))
        words = f"pushes of 0.2 s in {100 * length / every:.0f} %"
        yield LogFault("contact in the fit", words, change, fit_only=True)


FAMILIES = (contacts, scales, filters, drives, arms)
