"""Shapes in time of the contacts that are added to a log: from a hard knock to a slow clamp."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.numeric.arrays import FloatArray

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


#: What is added to every log: knocks of a stiff hit, a push by hand, and the slow closing of a clamping contact.
SHAPES = (
    ContactShape("knock 5 ms", 0.005, 0.0025),
    ContactShape("knock 10 ms", 0.010, 0.005),
    ContactShape("knock 20 ms", 0.020, 0.010),
    ContactShape("push 100 ms", 0.100, 0.030),
    ContactShape("clamp 1 s", 1.000, 0.450),
)
#: The push that planes of single joints are drawn for, and the lasting torque whose delay they give.
REFERENCE_PUSH = ContactShape("push 100 ms", 0.100, 0.030)
LASTING = ContactShape("lasting", 0.700, 0.030)
