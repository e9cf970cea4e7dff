"""Faults of signals and clocks, by name: what drives, drivers, networks, loggers and clocks do to a log."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
from faulty_case import PUSH_S, RATE_HZ, Fault, Signals

Named = Iterator[tuple[str, Fault]]
MIDDLE = sum(PUSH_S) / 2
_COLUMNS = {"one": [0], "all": [0, 1]}


def _span(s: Signals, length: float, at: float = MIDDLE) -> slice:
    return s.rows(at - length / 2, at + length / 2)


def _hold(s: Signals, name: str, length: float, columns: list[int], at: float = MIDDLE) -> None:
    values, part = getattr(s, name), _span(s, length, at)
    values[part, columns] = values[part.start, columns]


def _set(s: Signals, name: str, length: float, columns: list[int], value: float) -> None:
    getattr(s, name)[_span(s, length), columns] = value


def stuck() -> Named:
    for who, columns in _COLUMNS.items():
        for length in (0.1, 0.3, 0.4, 0.6, 1.0, 2.0, 4.0):
            yield f"effort-stuck-{who}-{length}s", partial(_hold, name="tau", length=length, columns=columns)
        for length in (0.3, 0.5, 1.0, 2.0):
            yield f"position-stuck-{who}-{length}s", partial(_hold, name="q", length=length, columns=columns)
            yield f"velocity-stuck-{who}-{length}s", partial(_hold, name="dq", length=length, columns=columns)
    for length in (0.4, 1.0, 2.0, 4.0, 8.0):

        def motion(s: Signals, length: float = length) -> None:
            _hold(s, "q", length, [0, 1])
            _hold(s, "dq", length, [0, 1])

        yield f"motion-stuck-{length}s", motion
    for length in (0.4, 2.0):
        yield f"effort-stuck-elsewhere-{length}s", partial(_hold, name="tau", length=length, columns=[0], at=4.0)


def missing() -> Named:
    for name in ("q", "dq", "tau"):
        for length in (0.1, 0.3, 0.5, 1.0, 3.0):
            yield f"{name}-missing-{length}s", partial(_set, name=name, length=length, columns=[0], value=np.nan)
    for who, columns in _COLUMNS.items():
        for length in (0.3, 0.4, 1.0, 4.0, 31.0):
            yield f"effort-zero-{who}-{length}s", partial(_set, name="tau", length=length, columns=columns, value=0.0)

    def none(s: Signals, name: str) -> None:
        setattr(s, name, None)

    yield "no-velocity", partial(none, name="dq")
    yield "no-effort", partial(none, name="tau")


def scales() -> Named:
    def scaled(s: Signals, name: str, columns: list[int], factor: float, start: float = 0.0) -> None:
        getattr(s, name)[s.rows(start, 99), columns] *= factor

    for who, columns in _COLUMNS.items():
        for factor in (0.01, 0.1, 0.3, 0.5, 0.7, 1.5, 2.0, 10.0, 1000.0, -1.0):
            yield f"effort-times-{factor:g}-{who}", partial(scaled, name="tau", columns=columns, factor=factor)
        yield f"position-inverted-{who}", partial(scaled, name="q", columns=columns, factor=-1.0)
        yield f"velocity-inverted-{who}", partial(scaled, name="dq", columns=columns, factor=-1.0)
    for name, factor in (("q", 180 / np.pi), ("dq", 180 / np.pi), ("tau", 1000.0), ("tau", 0.001), ("q", 0.001)):
        for start in (0.0, 4.0, 8.9, 9.15):
            fault = partial(scaled, name=name, columns=[0, 1], factor=factor, start=start)
            yield f"{name}-in-other-unit-times-{factor:.4g}-from-{start:g}s", fault


def offsets() -> Named:
    def moved(s: Signals, name: str, by: float, start: float = 0.0) -> None:
        getattr(s, name)[s.rows(start, 99), 0] += by

    for by in (-20.0, -5.0, -2.0, 2.0, 5.0, 20.0):
        yield f"effort-offset-{by:g}", partial(moved, name="tau", by=by)
    for by in (-12.0, 3.0, 12.0):
        yield f"effort-offset-from-5s-{by:g}", partial(moved, name="tau", by=by, start=5.0)
    for by in (0.05, 0.5, 3.0, 2 * np.pi):
        yield f"position-offset-{by:.3g}", partial(moved, name="q", by=by)
        yield f"position-jump-{by:.3g}-in-push", partial(moved, name="q", by=by, start=9.15)

    def drift(s: Signals, name: str, by: float) -> None:
        getattr(s, name)[:, 0] += by * s.t / s.t[-1]

    for by in (1.0, 5.0, 20.0):
        yield f"effort-drift-{by:g}", partial(drift, name="tau", by=by)
    yield "position-drift-0.2", partial(drift, name="q", by=0.2)

    def wrapped(s: Signals, columns: list[int]) -> None:
        s.q[:, columns] = (s.q[:, columns] + 2 * np.pi + 3.0) % (2 * np.pi) - 3.0 - 3.0

    yield "position-wraps", partial(wrapped, columns=[0])


def shapes() -> Named:
    def clipped(s: Signals, at: float) -> None:
        s.tau[:, 0] = np.clip(s.tau[:, 0], -at, at)

    for at in (1.0, 3.0, 5.0, 8.0, 12.0):
        yield f"effort-saturates-{at:g}", partial(clipped, at=at)

    def stepped(s: Signals, name: str, step: float) -> None:
        setattr(s, name, np.round(getattr(s, name) / step) * step)

    for step in (0.01, 0.1, 0.5, 1.0, 2.0, 5.0):
        yield f"effort-steps-{step:g}", partial(stepped, name="tau", step=step)
    for step in (1e-4, 1e-3, 1e-2):
        yield f"position-steps-{step:g}", partial(stepped, name="q", step=step)

    def noisy(s: Signals, name: str, sd: float) -> None:
        values = getattr(s, name)
        values += np.random.default_rng(5).normal(0, sd, values.shape)

    for name, sizes in (("tau", (0.5, 1.0, 3.0, 10.0)), ("q", (1e-4, 1e-3, 1e-2)), ("dq", (0.01, 0.1, 1.0))):
        for sd in sizes:
            yield f"{name}-noise-{sd:g}", partial(noisy, name=name, sd=sd)

    def spikes(s: Signals, name: str, value: float, count: int) -> None:
        getattr(s, name)[s.rows(*PUSH_S).start - 5 :: 7][:count, 0] = value

    for value in (1e3, 1e8, 1e30, 1e308, np.inf):
        for name in ("tau", "q", "dq"):
            yield f"{name}-spike-{value:g}", partial(spikes, name=name, value=value, count=1)
        yield f"effort-spikes-{value:g}", partial(spikes, name="tau", value=value, count=12)

    def late(s: Signals, name: str, by: float) -> None:
        rows = round(by * RATE_HZ)
        values = getattr(s, name)
        values[rows:] = values[: values.shape[0] - rows].copy()

    for by in (0.004, 0.012, 0.02, 0.052, 0.1, 0.3):
        yield f"effort-late-{by:g}s", partial(late, name="tau", by=by)
    for by in (0.012, 0.052, 0.2):
        yield f"velocity-late-{by:g}s", partial(late, name="dq", by=by)
        yield f"position-late-{by:g}s", partial(late, name="q", by=by)

    def slow(s: Signals, by: float) -> None:
        for k in range(1, s.t.size):
            s.tau[k] = s.tau[k - 1] + (s.tau[k] - s.tau[k - 1]) / (1 + by * RATE_HZ)

    for by in (0.05, 0.2, 1.0, 5.0):
        yield f"effort-filtered-{by:g}s", partial(slow, by=by)


def swaps() -> Named:
    def swapped(s: Signals, names: tuple[str, ...]) -> None:
        for name in names:
            setattr(s, name, getattr(s, name)[:, ::-1].copy())

    for names in (("tau",), ("q",), ("dq",), ("q", "dq"), ("q", "dq", "tau")):
        yield f"swapped-{'-'.join(names)}", partial(swapped, names=names)

    def flipped(s: Signals, share: float) -> None:
        picked = np.random.default_rng(6).random(s.t.size) < share
        s.tau[picked] *= -1

    for share in (0.001, 0.01, 0.1, 0.5):
        yield f"effort-signs-flip-{share:g}", partial(flipped, share=share)

    def shuffled(s: Signals, block: int) -> None:
        rng, order = np.random.default_rng(7), np.arange(s.t.size)
        for start in range(0, s.t.size, block):
            rng.shuffle(order[start : start + block])
        s.q, s.dq, s.tau = s.q[order], s.dq[order], s.tau[order]

    for block in (2, 10, 100, 4000):
        yield f"rows-shuffled-in-{block}", partial(shuffled, block=block)
