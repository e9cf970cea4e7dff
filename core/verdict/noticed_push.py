"""The smallest torque on one joint, and force along the arm, that would have alarmed at a moment of a log.

A push of stated duration comes on top of the log. What force it takes follows from what each joint would have noticed
(:mod:`collaudit.core.robot.arm_places`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.data.sensitivity_result import AskedForce, ForceLevel, NoticedForce
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, blocks
from collaudit.core.numeric.filters import gaussian_smoothed, window_reach
from collaudit.core.numeric.kernel import Kernel
from collaudit.core.numeric.runs import lowest_in_row, run_bounds
from collaudit.core.robot.arm_places import Place, RequiredForce, alarming_forces
from collaudit.core.robot.robot_model import RobotModel

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
    push would alarm: too short for filter and persistence, or not judged. The difference to other cycles
    counts where it notices less, and only where its reference rests on nights that passed.

    Args:
        run: residual, threshold, states.
        j: column.
        push: the push.
        moments: of :meth:`Push.moments`.
    """
    residual, gamma = run.residual.torque_nm[:, j], run.gamma_nm[:, j]
    out = np.empty(moments.size)
    for part in blocks(moments.size, max(1, _AT_ONCE // max(1, push.response.size))):
        rows = moments[part, None] + np.arange(-push.lead, push.response.size - push.lead)
        level, state = gamma[rows].astype(np.float64), run.detected.state[rows, j]
        if run.residual.hidden_nm is not None:
            level += run.residual.hidden_nm[rows, j]
        own = np.where(state == State.JUDGED, residual[rows], 0.0)
        unknown = (state > State.FRICTION_INTERVAL) | np.isnan(level)
        out[part] = _both_signs(np.where(unknown, np.inf, level), own, push)
        if run.cycles is not None and run.cycles.proven.any():
            its = run.cycles.signals
            known = run.cycles.proven[rows] & (state == State.JUDGED) & np.isfinite(its.torque_nm[rows, j])
            level = np.where(known, its.gamma_nm[rows, j], np.inf)
            beside = _both_signs(level, np.where(known, its.torque_nm[rows, j], 0.0), push)
            out[part] = np.minimum(out[part], beside)
    return out


def _both_signs(level_nm: FloatArray, own_nm: FloatArray, push: Push) -> FloatArray:
    """(k,) smallest height of a push of either sign on top of what is there (k, w)."""
    return np.maximum(_height(level_nm - own_nm, push), _height(level_nm + own_nm, push))


def _height(needed_nm: FloatArray, push: Push) -> FloatArray:
    """(k,) smallest height of a push that exceeds what is needed (k, w) for ``n`` samples in a row."""
    peaks = -lowest_in_row(-np.maximum(needed_nm, 0.0) / push.response, push.n)
    return peaks.min(axis=1) if peaks.shape[1] else np.full(len(needed_nm), np.inf)


#: Shares of the time at which the distribution is given, besides that which the policy asks for.
_TIME_SHARES = (0.5, 0.95)


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """What the joints of an arm would have noticed at some moments of a log.

    Attributes:
        time_s: (k,) of the log.
        position_rad: (k, j) of all joints of the model.
        noticed_nm: (k, j) smallest torque of each that would have alarmed; infinite where none would.
        watched: (k, j) whether it was watched.
        spans_s: time that the moments stand for.
        lost_s: time besides, off the grid, in which nothing would have alarmed.
    """

    time_s: FloatArray
    position_rad: FloatArray
    noticed_nm: FloatArray
    watched: BoolArray
    spans_s: float
    lost_s: float


def noticed_forces(
    robot: RobotModel,
    places: Sequence[Place],
    counted: Moments,
    whole: Moments,
    asked: Mapping[str, RequiredForce],
    share: float,
) -> tuple[NoticedForce, ...]:
    """What force would have alarmed at each place.

    Args:
        robot: the arm.
        places: on it.
        counted: moments of the time that counts: in motion, of an arm that moved.
        whole: moments of all time, what is lost included.
        asked: force that must alarm, by place.
        share: of the time that counts, in which it must.

    Returns:
        One for each place before which a joint was watched at any of the moments, or at which a force is asked for.
    """
    out = []
    for place in places:
        watched: BoolArray = np.asarray(counted.watched.any(axis=0) | whole.watched.any(axis=0))
        joints = tuple(robot.joint_names[k] for k in place.columns if watched[k])
        if joints or place.name in asked:
            out.append(_at(robot, place, joints, counted, whole, asked.get(place.name), share))
    return tuple(out)


def _at(
    robot: RobotModel,
    place: Place,
    joints: tuple[str, ...],
    counted: Moments,
    whole: Moments,
    asked: RequiredForce | None,
    share: float,
) -> NoticedForce:
    here = alarming_forces(robot, place, counted.position_rad, counted.noticed_nm, counted.watched)
    count = here.force_n.size * (1.0 + (counted.lost_s / counted.spans_s if counted.spans_s > 0 else 0.0))
    shares = sorted({*_TIME_SHARES, share})
    known = here.force_n[np.isfinite(here.force_n)]
    levels = tuple(ForceLevel(x, level) for x, level in zip(shares, level_at(known, count, shares), strict=True))
    found = None
    if asked is not None and here.force_n.size:
        missed = here.force_n > asked.force_n
        always = alarming_forces(robot, place, whole.position_rad, whole.noticed_nm, whole.watched)
        seen = always.force_n <= asked.force_n
        each_s = whole.spans_s / max(1, whole.time_s.size)
        found = AskedForce(
            force_n=asked.force_n,
            by=asked.by,
            share=float(np.count_nonzero(~missed)) / count,
            noticed_s=each_s * float(np.count_nonzero(seen)),
            unnoticed_s=each_s * float(np.count_nonzero(~seen)),
            longest_unnoticed_s=longest_unseen(whole.time_s[always.felt], seen),
            limited_by=_most(here.first[missed & np.isfinite(here.force_n)], robot.joint_names),
            directions=here.noticed(asked.force_n),
        )
    return NoticedForce(place.name, place.link, place.frame, joints, levels, here.unfelt, found)


def _most(joints: IntArray, names: Sequence[str]) -> str | None:
    return names[int(np.bincount(joints).argmax())] if joints.size else None


def level_at(known: FloatArray, count: float, shares: Sequence[float]) -> list[float | None]:
    """The smallest of the known values that a share of all ``count`` values does not exceed; None: too few are known.

    Args:
        known: (k,) finite values, k <= count.
        count: how many there are with the unknown ones, which exceed everything.
        shares: above 0, to 1.
    """
    places = [max(int(np.ceil(share * count - 1e-9)), 1) - 1 for share in shares]
    value = {place: float(np.partition(known, place)[place]) for place in set(places) if place < known.size}
    return [value.get(place) for place in places]


def longest_unseen(time_s: FloatArray, seen: BoolArray) -> float:
    """Longest time, s, from one seen moment (k,) to the next, or the first or last of all, with unseen ones between."""
    starts, stops = run_bounds(~seen)
    if not starts.size:
        return 0.0
    return float((time_s[np.minimum(stops, seen.size - 1)] - time_s[np.maximum(starts - 1, 0)]).max())
