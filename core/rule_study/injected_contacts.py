"""Contacts of known force added to a log: where, from which direction, when, and the joint torques they cause.

A force F on the robot adds J_c(q)^T (-F) to what the drives have to bring up, eq. (3), at the poses that the log holds.
It keeps its direction in the link, and the motion is taken as it was recorded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.prepare.prepared import Prepared


@dataclass(frozen=True, slots=True)
class InjectedContact:
    """A contact of one newton at its peak.

    Attributes:
        sample: of the log, at its onset.
        place: words for where it acts.
        frame, point_m: a frame of the model and a point in its axes.
        direction: unit vector on the robot in base axes.
        felt: columns of the joints that can feel it; None: all.
        phase: how much later than the sample it begins, in samples.
    """

    sample: int
    place: str
    frame: str
    direction: tuple[float, float, float]
    point_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    felt: tuple[int, ...] | None = None
    phase: float = 0.0


def open_moments(series: UniformSeries, usable: BoolArray, before: int, after: int) -> IntArray:
    """Samples around which a stretch lies in one piece of the log and is usable throughout.

    Args:
        series: its segments.
        usable: (n,) samples without contact.
        before, after: length of the stretch, samples.
    """
    bad = np.concatenate(([0], np.cumsum(~usable)))
    parts = [np.arange(span.start + before, span.stop - after, dtype=np.int64) for span in series.segments]
    at = np.concatenate(parts) if parts else np.empty(0, dtype=np.int64)
    return np.asarray(at[bad[at + after] == bad[at - before]])


def spread_moments(moments: IntArray, most: int, rng: np.random.Generator) -> IntArray:
    """At most so many of the moments, one at random from each of equal parts."""
    if moments.size <= most:
        return moments
    part = (np.arange(most) + rng.random(most)) * moments.size / most
    return np.asarray(moments[part.astype(np.int64)])


def random_direction(rng: np.random.Generator) -> tuple[float, float, float]:
    """A unit vector, all directions being equally likely."""
    x, y, z = rng.normal(size=3)
    size = float(np.sqrt(x * x + y * y + z * z)) or 1.0
    return float(x / size), float(y / size), float(z / size)


def unit_torques(
    prepared: Prepared, contacts: Sequence[InjectedContact], samples: IntArray, shape: ContactShape
) -> FloatArray:
    """(j, k, t) what contacts of one newton add to the torque of the judged joints, N·m, unfiltered.

    Args:
        prepared: the log and its model.
        contacts: k.
        samples: (k, t) of the log, around each contact.
        shape: over time.
    """
    series, robot = prepared.series, prepared.robot
    columns, period = prepared.columns(), series.period_s
    out = np.zeros((len(columns), *samples.shape))
    for frame in dict.fromkeys(contact.frame for contact in contacts):
        rows = [k for k, contact in enumerate(contacts) if contact.frame == frame]
        force = np.empty((len(rows), 6))
        after = np.empty((len(rows), samples.shape[1]))
        for i, k in enumerate(rows):
            contact = contacts[k]
            turn = robot.frame_rotation(series.position_rad[contact.sample], frame)
            on_robot = turn.T @ np.array(contact.direction)
            force[i] = *on_robot, *np.cross(contact.point_m, on_robot)
            after[i] = (samples[k] - contact.sample - contact.phase) * period
        share = shape.values(after, period)
        wrench = (share[:, :, None] * force[:, None, :]).reshape(-1, 6)
        torque = -robot.wrench_torque(series.position_rad[samples[rows].ravel()], wrench, frame)
        out[:, rows] = torque[:, columns].T.reshape(len(columns), len(rows), samples.shape[1])
    for k, contact in enumerate(contacts):
        if contact.felt is not None:
            out[[i for i, column in enumerate(columns) if column not in contact.felt], k] = 0.0
    return out


#: A log's sample is taken as the mean over its period, of so many instants.
_INSTANTS = 16


@dataclass(frozen=True, slots=True)
class ContactShape:
    """A contact over time: raised-cosine edges, level between.

    Attributes:
        name: for tables.
        duration_s: from start to end, edges included.
        edge_s: length of each edge.
    """

    name: str
    duration_s: float
    edge_s: float

    def values(self, time_s: FloatArray, period_s: float) -> FloatArray:
        """Share of the peak over times (any shape) from the onset, each the mean over one sample period.

        Motion integrates a force over the time between two samples: a knock shorter than that is not lost between them.
        """
        offset = (np.arange(_INSTANTS) + 0.5) / _INSTANTS - 0.5
        return np.asarray(np.mean([self._at(time_s + period_s * o) for o in offset], axis=0))

    def _at(self, t: FloatArray) -> FloatArray:
        edge = min(self.edge_s, 0.5 * self.duration_s)
        inside = np.minimum(t, self.duration_s - t)
        return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.clip(inside / edge, 0.0, 1.0)))


#: The push that planes of single joints are drawn for.
REFERENCE_PUSH = ContactShape("push 100 ms", 0.100, 0.030)
#: What is added to every log: knocks of a stiff hit, a push by hand, and the slow closing of a clamping contact.
SHAPES = (
    ContactShape("knock 5 ms", 0.005, 0.0025),
    ContactShape("knock 10 ms", 0.010, 0.005),
    ContactShape("knock 20 ms", 0.020, 0.010),
    REFERENCE_PUSH,
    ContactShape("clamp 1 s", 1.000, 0.450),
)
