"""Channels of a simulated joint with a known delay, and what is estimated of it."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from collaudit.core.prepare.channel_delay import best_shift, reach
from collaudit.core.torque_table.block_sums import squares_left

T, LENGTH_S = 0.004, 40.0


def motion(kind: str, rng: np.random.Generator):  # type: ignore[no-untyped-def]
    """A joint's position as a function of time."""
    shape = [(rng.uniform(0.3, 1), rng.uniform(0.1, 1.5), rng.uniform(0, 6)) for _ in range(6)]
    if kind == "periodic":
        shape = [(a, k * 2 * shape[0][1], p) for k, (a, _, p) in enumerate(shape[:2], 1)]
    if kind == "moves":
        corners, places = np.cumsum(rng.uniform(0.5, 2, 200)), np.repeat(rng.normal(0, 1, 100), 2)
        fine = np.arange(-1.0, LENGTH_S + 2, 0.001)
        way = gaussian_filter1d(np.interp(fine, corners, places), 60)
        return lambda t: np.interp(t, fine, way)
    if kind == "slow":
        shape = [(a, 0.15 * w, p) for a, w, p in shape]
    return lambda t: sum(a * np.sin(2 * np.pi * w * t + p) for a, w, p in shape)


def found_and_true(kind: str, noise: float, rho: float, held_s: float, seed: int, carries: bool = True):  # type: ignore[no-untyped-def]
    """The delay of gravity, inertia and friction of one joint, with noise that lasts, held between coarse stamps."""
    rng = np.random.default_rng(seed)
    t = T * np.arange(round(LENGTH_S / T))
    delay = float(rng.uniform(-0.01, 0.05))
    q = motion(kind, rng)
    h = 0.004

    def speed(t: np.ndarray) -> np.ndarray:
        return np.asarray((q(t + h / 2) - q(t - h / 2)) / h)

    def torque(t: np.ndarray) -> np.ndarray:
        return np.asarray(3 * np.cos(1.3 * q(t) + 0.4) + 0.15 * (q(t + h) - 2 * q(t) + q(t - h)) / h**2)

    x, v = torque(t), speed(t)
    at = t - delay if not held_s else np.floor(t / held_s) * held_s - delay
    y = torque(at) + 0.5 * np.sign(speed(at)) + 0.2 * speed(at)
    errors = lfilter([np.sqrt(1 - rho**2)], [1, -rho], rng.normal(size=t.size))
    y = (y / np.std(y) if carries else 0.0) + noise * errors
    back, ahead = reach(T)
    rows = np.arange(-back, t.size - ahead)
    rows = rows[np.abs(v[rows]) > 0.02]

    def costs(pick):  # type: ignore[no-untyped-def]
        use = rows[pick]
        columns = np.column_stack([x[use], np.sign(v[use]), v[use], np.ones(use.size)])
        return lambda shifts: squares_left(columns, y[use[:, None] + shifts])[:, None]

    return best_shift(rows.size, costs, T), delay + (0.5 * (held_s - T) if held_s else 0.0)
