"""An independent look at a planned motion: its CSV at 1 kHz against every limit, without the planner's code.

Positions between rows are cubic (Hermite); torques come from the robot model; links are capsules between the joints'
origins, whose distances are worked out here.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping
from itertools import combinations

import numpy as np

Array = np.ndarray


def read_motion(text: str) -> tuple[Array, Array, Array, list[str]]:
    """Times (n,), positions and velocities (n, j), and names of the joints."""
    rows = list(csv.reader(io.StringIO("".join(x for x in text.splitlines(True) if not x.startswith("#")))))
    names = [name.removeprefix("q_") for name in rows[0] if name.startswith("q_")]
    data = np.array(rows[1:], dtype=float)
    return data[:, 0], data[:, 1 : 1 + len(names)], data[:, 1 + len(names) :], names


def at_1_khz(t: Array, q: Array, v: Array) -> tuple[Array, Array, Array, Array]:
    """Positions, velocities, accelerations and jerks (n, j) of the cubic through the rows, every millisecond."""
    time = np.arange(t[0], t[-1], 1e-3)
    k = np.clip(np.searchsorted(t, time, side="right") - 1, 0, t.size - 2)
    h = (t[k + 1] - t[k])[:, None]
    s = (time - t[k])[:, None]
    way, first, last = (q[k + 1] - q[k]) / h, v[k], v[k + 1]
    c, d = (3 * way - 2 * first - last) / h, (first + last - 2 * way) / h**2
    return q[k] + s * (first + s * (c + s * d)), first + s * (2 * c + 3 * s * d), 2 * c + 6 * s * d, 6 * d


def worst(values: Array, limit: Array) -> float:
    """The largest share of a limit that is used; above 1 is a violation."""
    return float(np.max(np.abs(values) / limit))


def segment_distance(a: Array, b: Array, c: Array, d: Array) -> Array:
    """(n,) least distances of segments a-b and c-d, all (n, 3) (Ericson, Real-Time Collision Detection, 5.1.9)."""
    u, w, r = b - a, d - c, a - c
    uu, ww, uw = (u * u).sum(1), (w * w).sum(1), (u * w).sum(1)
    ur, wr = (u * r).sum(1), (w * r).sum(1)
    tiny = 1e-12
    s = np.clip((uw * wr - ur * ww) / np.maximum(uu * ww - uw**2, tiny), 0.0, 1.0)
    t = (uw * s + wr) / np.maximum(ww, tiny)
    t = np.clip(t, 0.0, 1.0)
    s = np.clip((uw * t - ur) / np.maximum(uu, tiny), 0.0, 1.0)
    return np.linalg.norm(r + s[:, None] * u - t[:, None] * w, axis=1)


def nearest(
    ends: Mapping[str, tuple[Array, Array]], radius: Mapping[str, float], left_out: set[frozenset[str]]
) -> float:
    """Least distance of two capsules over all samples, m, pairs in ``left_out`` apart."""
    least = np.inf
    for one, two in combinations(ends, 2):
        if frozenset((one, two)) not in left_out:
            gap = segment_distance(*ends[one], *ends[two]) - radius[one] - radius[two]
            least = min(least, float(gap.min()))
    return least


def lowest(
    ends: Mapping[str, tuple[Array, Array]], radius: Mapping[str, float], table_z_m: float, fixed: set[str]
) -> float:
    """Least height of a capsule over the table, m."""
    return min(
        float(np.minimum(a[:, 2], b[:, 2]).min()) - radius[name] - table_z_m
        for name, (a, b) in ends.items()
        if name not in fixed
    )


def capsule_ends(
    points_of: Callable[[Array], Array], q: Array, joints: list[str], chosen: Array
) -> dict[str, tuple[Array, Array]]:
    """Ends of the capsules of base and links at some samples; ``points_of`` gives base, joints and tip (j + 2, 3)."""
    points = np.array([points_of(pose) for pose in q[chosen]])
    names = ["base", *joints]
    return {name: (points[:, k], points[:, k + 1]) for k, name in enumerate(names)}
