"""The smallest torque on one joint that would have alarmed at a moment: a push of stated duration on top of the log."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.filters import gaussian_smoothed, window_reach
from collaudit.core.numeric.kernel import Kernel
from collaudit.core.numeric.sliding_extremes import lowest_in_row
from collaudit.core.numeric.tables import blocks

#: Of a push less than this share of its height is not waited for in the detector's filter.
_LEAST_RESPONSE = 0.05
#: Samples that are looked at together.
_AT_ONCE = 1 << 18


@dataclass(frozen=True, slots=True, eq=False)
class Push:
    """A rectangular push as a detector shows it.

    Attributes:
        duration_s: of the push.
        response: (w,) share of its height that passes the detector's kernel, sample by sample.
        lead: samples of ``response`` before the push begins, of a kernel that runs both ways.
        n: persistence, samples.
    """

    duration_s: float
    response: FloatArray
    lead: int
    n: int

    @classmethod
    def of(cls, duration_s: float, kernel: Kernel, n: int, period_s: float, smoothed_s: float = 0.0) -> Push:
        """A push through a kernel, of the whole samples that fall into its duration at least.

        Args:
            duration_s: of the push.
            kernel: of the detector.
            n: persistence, samples.
            period_s: sample period, s.
            smoothed_s: standard deviation of the window by which the effort is smoothed besides; nothing passes an
                infinite one.
        """
        response, begin = kernel.push_response(int(duration_s / period_s + 1e-6), period_s)
        if np.isinf(smoothed_s):
            return cls(duration_s, response[:0], 0, n)
        if smoothed_s > 0.0:
            deviation = smoothed_s / period_s
            response = gaussian_smoothed(np.pad(response, window_reach(deviation)), deviation)
            begin += window_reach(deviation)
        shown = np.flatnonzero(response > _LEAST_RESPONSE * response.max(initial=0.0))
        if not shown.size:
            return cls(duration_s, response[:0], 0, n)
        return cls(duration_s, response[shown[0] : shown[-1] + 1], begin - int(shown[0]), n)

    @property
    def alarms(self) -> bool:
        """Whether it can alarm at any height: no filter or persistence can be longer, no two samples further apart."""
        return self.response.size >= self.n

    def moments(self, mask: BoolArray, most: int) -> IntArray:
        """At most so many of the marked samples (n,), evenly spread, at which the whole push lies within the log."""
        fits = mask[: max(0, mask.size - (self.response.size - self.lead) + 1)]
        samples = np.flatnonzero(fits)
        samples = samples[samples >= self.lead]
        if samples.size <= most:
            return samples
        return np.asarray(samples[((np.arange(most) + 0.5) * samples.size / most).astype(np.int64)])


def noticed_torque(run: DetectorRun, j: int, push: Push, moments: IntArray) -> FloatArray:
    """(k,) smallest torque of one joint, N·m (N), that would have alarmed if it began at the moments (k,).

    A push of height h shows as h·g(t). It alarms where, for ``n`` samples in a row, that and the log's own residual r
    exceed the threshold, and besides the range of friction where it is known only as a range, since the torque may act
    against it: h·g > γ + hidden - r, and with +r for the other sign. The larger of the two counts. Infinite where no
    push would alarm: too short for filter and persistence, or not judged.

    Args:
        run: residual, threshold, states.
        j: column.
        push: the push.
        moments: of :meth:`Push.moments`.
    """
    levels = run.threshold.with_persistences(j)
    found = [_exceeding(run, j, level, replace(push, n=n), moments) for level, n in levels]
    return np.asarray(np.minimum.reduce(found))


def _exceeding(run: DetectorRun, j: int, threshold: FloatArray, push: Push, moments: IntArray) -> FloatArray:
    """(k,) the same of one threshold (n,) and the push's persistence."""
    residual = run.residual.torque_nm[:, j]
    out = np.empty(moments.size)
    for part in blocks(moments.size, max(1, _AT_ONCE // max(1, push.response.size))):
        rows = moments[part, None] + np.arange(-push.lead, push.response.size - push.lead)
        level, state = threshold[rows], run.detected.state[rows, j]
        if run.residual.hidden_nm is not None:
            level += run.residual.hidden_nm[rows, j]
        own = np.where(state == State.JUDGED, residual[rows], 0.0)
        unknown = (state > State.FRICTION_INTERVAL) | np.isnan(level)
        out[part] = np.maximum(*(_height(np.where(unknown, np.inf, level - r), push) for r in (own, -own)))
    return out


def _height(needed_nm: FloatArray, push: Push) -> FloatArray:
    """(k,) smallest height of a push that exceeds what is needed (k, w) for ``n`` samples in a row."""
    peaks = -lowest_in_row(-np.maximum(needed_nm, 0.0) / push.response, push.n)
    return peaks.min(axis=1) if peaks.shape[1] else np.full(len(needed_nm), np.inf)
