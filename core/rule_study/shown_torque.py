"""What a residual shows of a torque that is added to a log: windows of the log, and the torque through its filters.

The effort is not filtered before the detector's kernel, which is linear: an added torque x adds G x to what the model
does not explain. Where friction is a value, the residual grows by as much. Where it is an interval [low, high], the
residual is the distance from it of u + G x. A joint at rest gives way first: its friction takes up the torque until it
is at the end of its calibrated range, so that u rises to that end + G x only (:func:`shown`).

Short contacts reach a residual mostly through the motion: the arm gives way before its drives react, and velocity and
acceleration have passed their own low-pass. A torque is therefore added behind both filters; in the effort alone, as
of an arm that does not move at all, a knock of 10 ms would show a third more.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from collaudit.core.data.signals import State
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span
from collaudit.core.numeric.filters import low_pass
from collaudit.core.numeric.kernel import Kernel
from collaudit.core.numeric.runs import lowest_in_row
from collaudit.core.numeric.tables import blocks

if TYPE_CHECKING:  # a page draws planes without a detector, whose imports take longer than the page
    from collaudit.core.data.uniform_series import UniformSeries
    from collaudit.core.detection.detector_run import DetectorRun
    from collaudit.core.friction.friction_model import FrictionModel


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """Stretches of a log around moments, for some of its joints.

    Attributes:
        above_nm: (j, k, t) unexplained torque less the upper end of friction's interval; the residual where friction
            is a value.
        width_nm: (j, k, t) of the interval, 0 where friction is a value.
        taken_nm: (j, k, t) of the width what friction takes up as calibrated: the rest is doubt about its level.
        uncertainty_nm: (j, k, t) by which the threshold is raised.
        evidence: (j, k, t) samples that may count.
        standing: (j, k, t) samples at which the joint rests.
    """

    above_nm: FloatArray
    width_nm: FloatArray
    taken_nm: FloatArray
    uncertainty_nm: FloatArray
    evidence: BoolArray
    standing: BoolArray

    def part(self, contacts: slice) -> Windows:
        """Around some of the moments."""
        return Windows(
            self.above_nm[:, contacts],
            self.width_nm[:, contacts],
            self.taken_nm[:, contacts],
            self.uncertainty_nm[:, contacts],
            self.evidence[:, contacts],
            self.standing[:, contacts],
        )


def judges_joints(run: DetectorRun) -> bool:
    """Whether a torque on one joint shows in that joint's residual, and how it does is known."""
    return run.residual.isolation.isolates and run.residual.span_nm is not None and run.residual.hidden_nm is not None


def margin_samples(kernel: Kernel, bandwidth_hz: float, period_s: float) -> int:
    """Samples before and after a contact in which the filters show some of it."""
    return ceil((2.0 * kernel.settle_s + 1.5 / bandwidth_hz) / period_s) + 1


def windows(
    series: UniformSeries,
    run: DetectorRun,
    laws: Mapping[str, FrictionModel],
    columns: Sequence[int],
    samples: IntArray,
) -> Windows:
    """The log at some samples.

    Args:
        series: judged joints.
        run: a detector of which :func:`judges_joints` holds.
        laws: friction by joint.
        columns: j joints.
        samples: (k, t).
    """
    from collaudit.core.residual.friction_bounds import rest_below
    from collaudit.core.residual.residual import SIGMAS

    residual, state = run.residual, run.detected.state
    assert residual.span_nm is not None and residual.hidden_nm is not None
    shape = (len(columns), *samples.shape)
    out = Windows(*(np.empty(shape) for _ in range(4)), *(np.empty(shape, dtype=np.bool_) for _ in range(2)))
    for k, j in enumerate(columns):
        here, torque = state[:, j][samples], residual.torque_nm[:, j][samples]
        interval = here == State.FRICTION_INTERVAL
        out.above_nm[k] = np.where(interval, residual.span_nm[0][samples, j], torque)
        out.width_nm[k] = np.where(interval, residual.hidden_nm[samples, j], 0.0)
        level = residual.levels.get(series.joint_names[j])
        slack = 0.0 if level is None else SIGMAS * level.sd[samples]
        out.taken_nm[k] = out.width_nm[k] * (1.0 - 0.5 * slack / (1.0 + slack))
        out.uncertainty_nm[k] = residual.uncertainty_nm[:, j][samples]
        out.evidence[k] = (here <= State.FRICTION_INTERVAL) & np.isfinite(out.above_nm[k]) & np.isfinite(torque)
        law = laws.get(series.joint_names[j])
        slow = np.inf if law is None else rest_below(law)
        out.standing[k] = interval & (np.abs(residual.balance.velocity_rad_s[:, j][samples]) < slow)
    return out


def shown(around: Windows, added_nm: FloatArray) -> FloatArray:
    """(j, k, t) threshold below which each sample counts as above it with a torque (j, k, t) added, N·m.

    It is -inf where nothing can alarm. The rest of rule (6) is in :mod:`joint_plane`.
    """
    above, width = around.above_nm, around.width_nm
    pushed = above + added_nm
    if around.standing.any():
        with np.errstate(invalid="ignore"):
            spare = width - around.taken_nm
            rising = np.maximum(above, added_nm - around.taken_nm)
            falling = np.minimum(above, added_nm - spare)
            lazy = np.where(added_nm > 0, rising, np.where(added_nm < 0, falling, above))
        pushed = np.where(around.standing, lazy, pushed)
    inside = np.where(np.isfinite(width), width, 0.0)
    size = np.maximum(np.maximum(pushed, -(pushed + inside)), 0.0)
    hopeless = np.isinf(width)
    size -= around.uncertainty_nm
    size[~around.evidence | hopeless] = -np.inf
    return np.asarray(size)


def through_filters(torque_nm: FloatArray, kernel: Kernel, bandwidth_hz: float, period_s: float) -> FloatArray:
    """(…, t) torque as a detector with this kernel shows it; time runs along the last axis, with margins of zeros.

    Args:
        torque_nm: (…, t) that is added.
        kernel: of the detector.
        bandwidth_hz: of the low-pass of velocity and acceleration, which a causal detector does without.
        period_s: sample period, s.
    """
    length = torque_nm.shape[-1]
    rows = np.asfortranarray(torque_nm.reshape(-1, length).T)
    whole = [Span(0, length)]
    if not kernel.causal:
        rows = low_pass(rows, whole, period_s, bandwidth_hz)
    return np.ascontiguousarray(kernel.apply(rows, whole, period_s).T).reshape(torque_nm.shape)


#: Forces between which the smallest is looked for, N: beyond the largest no contact with a person is.
LEAST_N, LARGEST_N = 0.1, 5000.0
#: Halvings of that range: the force is found to 1 %.
_HALVINGS = 10
#: Contacts that are computed together: few enough to stay in the cache.
_AT_ONCE = 8


def first_alarms(excess_nm: FloatArray, gamma_nm: FloatArray, n: int) -> IntArray:
    """(k,) sample of the window at which rule (6) first fires on any joint; -1 where it does not.

    Args:
        excess_nm: (j, k, t).
        gamma_nm: (j,) thresholds.
        n: persistence, samples.
    """
    lasting: BoolArray = np.asarray(lowest_in_row(excess_nm, n) > gamma_nm[:, None, None])
    if lasting.shape[-1] == 0:
        return np.full(excess_nm.shape[1], -1, dtype=np.int64)
    fires = np.asarray(lasting.any(axis=0))
    return np.where(fires.any(axis=1), np.argmax(fires, axis=1) + n - 1, -1).astype(np.int64)


def alarmed(around: Windows, added_nm: FloatArray, gamma_nm: FloatArray, n: int) -> BoolArray:
    """(k,) whether rule (6) fires on any joint with these torques (j, k, t) added."""
    return np.asarray(first_alarms(shown(around, added_nm), gamma_nm, n) >= 0)


def noticed_forces(around: Windows, unit_nm: FloatArray, gamma_nm: FloatArray, n: int) -> FloatArray:
    """(k,) smallest force of each contact that alarms, N; infinite where none does, NaN where the log alarms anyway.

    Args:
        around: the log around the contacts.
        unit_nm: (j, k, t) torque through the filters of a contact of one newton.
        gamma_nm: (j,) thresholds.
        n: persistence, samples.
    """
    parts = [
        _noticed_forces(around.part(rows), np.ascontiguousarray(unit_nm[:, rows]), gamma_nm, n)
        for rows in blocks(unit_nm.shape[1], _AT_ONCE)
    ]
    return np.concatenate(parts) if parts else np.empty(0)


def _noticed_forces(around: Windows, unit_nm: FloatArray, gamma_nm: FloatArray, n: int) -> FloatArray:
    count = unit_nm.shape[1]
    low, high = np.full(count, np.log(LEAST_N)), np.full(count, np.log(LARGEST_N))
    seen = alarmed(around, LARGEST_N * unit_nm, gamma_nm, n)
    anyway = alarmed(around, np.zeros_like(unit_nm), gamma_nm, n)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        fires = alarmed(around, np.exp(middle)[None, :, None] * unit_nm, gamma_nm, n)
        high, low = np.where(fires, middle, high), np.where(fires, low, middle)
    return np.asarray(np.where(anyway, np.nan, np.where(seen, np.exp(high), np.inf)))


def alarm_delays(
    around: Windows, unit_nm: FloatArray, force_n: FloatArray, gamma_nm: FloatArray, n: int, onset: int
) -> IntArray:
    """(k,) samples from the onset to the alarm of contacts of these forces (k,); counted only where they alarm."""
    fired = first_alarms(shown(around, force_n[None, :, None] * unit_nm), gamma_nm, n)
    return np.asarray(fired[fired >= 0] - onset)
