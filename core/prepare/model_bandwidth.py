"""How fast a model torque may be subtracted: as wide as the noise of the acceleration allows, joint by joint.

Inertia torque is computed from the second derivative of positions. On a slow log with coarse positions its upper bands
are noise, and subtracting them makes the residual larger. In each band the effort tells: where the model's content is
motion, the effort contains it too, and their regression is one; where it is noise, it is zero, and subtracting the band
raises the residual's power as soon as it is below a half. The median over short blocks of time tells it: a contact is
large beside noise, and in few of them.

Where a band that is left out stands out of its own noise it is motion, which the effort has and the model then lacks:
an arm that starts with a jerk. The residual may be wrong by that much there, and no threshold stands below it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, pairwise, takewhile

import numpy as np

from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import FloatArray, Span
from collaudit.core.numeric.filters import Kernel, low_pass
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.stats import MEDIAN_SE, SD_PER_MAD, median_of, weighted_median

#: Upper ends of the bands that may be left out, as shares of the filters' bandwidth; below the last all is kept.
_LADDER = (1.0, 0.7, 0.5, 0.35, 0.25)
#: The bands are judged in blocks of a period of the slowest, of which many hold no contact, on so many samples at most.
_FEWEST, _MOST_SAMPLES = 1000, 120_000
#: Subtracting a band raises the residual's power below this regression; one nearer to -1 than to 0 is a sign, no noise.
_HALF = 0.5
#: Leaving bands out must lower the power of the residual above the slowest band by this share.
_WORTH = 0.05


#: Standard deviations of the noise of what is left out beyond which it is motion: one sample of 16,000 lies there.
_MOTION_SDS = 4.0


@dataclass(frozen=True, slots=True, eq=False)
class ModelBandwidth:
    """Up to where the model torque of one joint is used.

    Attributes:
        joint: its name.
        bandwidth_hz: of the model torque, Hz.
        before_nm, after_nm: RMS of effort less model torque above a quarter of the filters' bandwidth, N·m, in the
            median of blocks of time.
        left_out_nm: (n,) model torque above the bandwidth, N·m; NaN outside the stretches.
    """

    joint: str
    bandwidth_hz: float
    before_nm: float
    after_nm: float
    left_out_nm: FloatArray = field(default_factory=lambda: np.zeros(0), repr=False)

    def lacking_nm(self, kernel: Kernel, series: UniformSeries) -> FloatArray:
        """(n,) how much of the motion's torque the model lacks behind a kernel, N·m: what stands out of the noise."""
        passed = kernel.apply(self.left_out_nm[:, None], series.segments, series.period_s)[:, 0]
        size = np.nan_to_num(np.abs(passed))
        noise = SD_PER_MAD * median_of(size[size > 0.0]) if size.any() else 0.0
        return np.maximum(size - _MOTION_SDS * noise, 0.0)


def quiet_model(
    series: UniformSeries, rigid_nm: FloatArray, contact_nm: FloatArray | None
) -> tuple[FloatArray, tuple[ModelBandwidth, ...]]:
    """Model torque without the bands that are noise, and the joints that have such; the same array where none has.

    Args:
        series: the log, with effort in N·m.
        rigid_nm: (n, j) rigid-body torque from its filtered acceleration.
        contact_nm: (n, j) torque of the commanded tool force, or None.
    """
    if series.effort is None or series.effort_unit != "Nm":
        return rigid_nm, ()
    measured, spans = series.effort, _part(series.segments)

    def one(j: int) -> ModelBandwidth | None:
        effort, rigid = (np.ascontiguousarray(x[: spans[-1].stop, j]) for x in (measured, rigid_nm))
        if contact_nm is not None:
            effort = effort - np.nan_to_num(contact_nm[: spans[-1].stop, j])
        return _bandwidth(series, spans, j, effort, rigid)

    found = tuple(b for b in ordered_map(one, range(rigid_nm.shape[1])) if b is not None)
    if not found:
        return rigid_nm, ()
    quiet = within_bandwidth(series, rigid_nm, found)
    left_out = np.asfortranarray(rigid_nm - quiet)
    return quiet, tuple(replace(b, left_out_nm=left_out[:, series.column(b.joint)]) for b in found)


def within_bandwidth(series: UniformSeries, rigid_nm: FloatArray, found: Sequence[ModelBandwidth]) -> FloatArray:
    """The (n, j) model torque without the bands that are noise; the same array where ``found`` names no joint."""
    if not found:
        return rigid_nm
    out = rigid_nm.copy(order="F")
    for b in found:
        j = series.column(b.joint)
        out[:, j] = low_pass(np.ascontiguousarray(rigid_nm[:, j]), series.segments, series.period_s, b.bandwidth_hz)
    return out


def _part(segments: tuple[Span, ...]) -> list[Span]:
    """The first stretches of a log, as many samples as are enough to judge by."""
    out: list[Span] = []
    left = _MOST_SAMPLES
    for span in segments:
        if left > 0:
            out.append(Span(span.start, min(span.stop, span.start + left)))
            left -= len(out[-1])
    return out


def _bandwidth(
    series: UniformSeries, spans: list[Span], j: int, effort: FloatArray, rigid: FloatArray
) -> ModelBandwidth | None:
    """The bandwidth of one joint's model torque; None where all of it serves."""
    ends = [share * series.bandwidth_hz for share in _LADDER]
    both = np.column_stack([effort, rigid])

    def up_to(end_hz: float) -> FloatArray:
        return low_pass(both, spans, series.period_s, end_hz)

    whole = up_to(ends[0])
    use = np.isfinite(whole).all(axis=1) & ~series.edge[: both.shape[0]]
    if np.count_nonzero(use) < _FEWEST:
        return None
    length = max(2, round(1.0 / (ends[-1] * series.period_s)))
    # no band is filtered beyond the first that is motion: of most joints that is the first of all
    bands = ((upper - lower)[use] for upper, lower in pairwise(chain([whole], map(up_to, ends[1:]))))
    noise = [band[:, 1] for band in takewhile(lambda band: _is_noise(band[:, 0], band[:, 1], length), bands)]
    if not noise:
        return None
    fast = (whole - up_to(ends[-1]))[use]
    before = fast[:, 0] - fast[:, 1]
    after = before + np.sum(noise, axis=0)
    power = [median_of(_by_block(x, x, length)) for x in (before, after)]
    if power[1] > (1.0 - _WORTH) * power[0]:
        return None
    before_nm, after_nm = (float(np.sqrt(p)) for p in power)
    return ModelBandwidth(series.joint_names[j], ends[len(noise)], before_nm, after_nm)


def _is_noise(effort: FloatArray, model: FloatArray, length: int) -> bool:
    """Whether a band of the model torque is clearly not in the effort, in the median of blocks of so many samples.

    Blocks weigh as much as they hold of the band: where a move begins and ends it is motion, and noise all the way.
    """
    power, shared = _by_block(model, model, length), _by_block(effort, model, length)
    moves = power > 0.0
    if not moves.any():
        return False
    slopes, weight = shared[moves] / power[moves], power[moves]
    slope = weighted_median(slopes, weight)
    spread = SD_PER_MAD * weighted_median(np.abs(slopes - slope), weight)
    error = MEDIAN_SE * spread * float(np.sqrt(np.sum(weight**2)) / np.sum(weight))
    return abs(slope) + 2.0 * error < _HALF


def _by_block(x: FloatArray, y: FloatArray, length: int) -> FloatArray:
    """(blocks,) mean product of two signals (n,) in each block of so many samples."""
    whole = x.size // length * length
    return np.asarray((x * y)[:whole].reshape(-1, length).mean(axis=1))


def bandwidth_findings(found: Sequence[ModelBandwidth], filters_hz: float) -> list[Finding]:
    """One finding on all joints of :func:`quiet_model`; none without any."""
    if not found:
        return []
    slow = f"above {_LADDER[-1] * filters_hz:.3g} Hz"
    named = ", ".join(
        f"'{b.joint}' {b.bandwidth_hz:.3g} Hz (RMS {slow} {b.before_nm:.2g} to {b.after_nm:.2g} N·m)" for b in found
    )
    text = (
        f"The acceleration is too noisy for the filters' {filters_hz:.3g} Hz: the effort does not contain the model "
        f"torque's upper bands, and subtracting them would make the residual larger. It is used up to: {named}."
    )
    return [fact(text)]
