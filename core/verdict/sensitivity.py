"""The smallest torque that would have alarmed at each instant of a log, and its distribution over time, by joint."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from collaudit.core.config.schema import Config, PolicyConfig
from collaudit.core.data.sensitivity_result import JointSensitivity, Sensitivity, TimeShares, TorqueLevel
from collaudit.core.data.signals import State
from collaudit.core.dataclass import dataclass
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.errors import ConfigError
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.runs import run_bounds
from collaudit.core.numeric.sliding_extremes import window_maxima, window_minima
from collaudit.core.numeric.stats import in_order
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.verdict.force_sensitivity import MOMENTS, force_sensitivities

#: Bounds, in thresholds, of the torque that is to be noticeable where the configuration states none.
_LEAST_THRESHOLDS, _MOST_THRESHOLDS = 2.0, 5.0
#: Shares of the time at which the distribution is given.
SHARES = (0.5, 0.8, 0.9, 0.95, 0.99, 1.0)


@dataclass(frozen=True, slots=True)
class Observable:
    """A torque that is to be noticeable, N·m, and whether the configuration states it."""

    torque_nm: float
    stated: bool


def observable_torques(
    policy: PolicyConfig, gamma_nm: Mapping[str, float], laws: Mapping[str, FrictionModel]
) -> dict[str, Observable]:
    """What is to be noticeable on each joint with a threshold: as stated, else threshold and breakaway friction.

    A contact as strong as the joint's own friction shows above the threshold while the joint slides. At least two
    thresholds are asked, for what friction hides on a joint with little of it, and at most five.

    Args:
        policy: what is stated.
        gamma_nm: thresholds of the judged joints.
        laws: their friction.

    Raises:
        ConfigError: a torque is stated for a joint that is not judged.
    """
    stated = policy.observable_nm
    if isinstance(stated, dict) and (unknown := sorted(stated.keys() - gamma_nm.keys())):
        raise ConfigError(
            "a torque is asked to be observable on a joint that is not judged",
            where="[policy] observable_nm",
            found=", ".join(unknown),
            expected="some of " + ", ".join(gamma_nm),
        )
    of_joint = stated if isinstance(stated, dict) else dict.fromkeys(gamma_nm, stated)
    out = {}
    for joint, gamma in gamma_nm.items():
        value, law = of_joint.get(joint), laws.get(joint)
        usual = gamma + (0.0 if law is None else law.hold)
        usual = min(max(usual, _LEAST_THRESHOLDS * gamma), _MOST_THRESHOLDS * gamma)
        out[joint] = Observable(usual if value is None else value, value is not None)
    return out


def detectable_torque(run: DetectorRun, j: int, n: int) -> FloatArray:
    """(n,) smallest torque of one joint, N·m, that would have alarmed at each instant; infinite where none would.

    Threshold plus what friction hides: the width of its interval, or the error its level may have (95 %) on top of
    what the threshold carries already. Friction may lie at one end and the torque act against it. A torque that lasts
    ``n`` samples has to exceed this level at each of them, so it is the lowest of the peaks over the stretches of
    ``n`` samples around an instant.

    Args:
        run: residual, threshold, states.
        j: column.
        n: persistence, samples.
    """
    level = run.threshold.of(j) + run.residual.uncertainty_nm[:, j]
    if run.residual.hidden_nm is not None:
        hidden = run.residual.hidden_nm[j]
        level[hidden.rows] += hidden.values
    level[(run.detected.state[:, j] > State.FRICTION_INTERVAL) | np.isnan(level)] = np.inf
    return _lasting(level, n)


def measure_sensitivity(
    prepared: Prepared,
    run: DetectorRun,
    inputs: DetectionInputs,
    config: Config,
    gaps_s: float,
    moving: Mapping[str, BoolArray],
) -> Sensitivity:
    """How little would have alarmed on a log.

    Args:
        prepared: the log.
        run: residual, threshold, states.
        inputs: the rule, watched joints.
        config: what is to be noticeable.
        gaps_s: time in gaps, in which nothing can be told.
        moving: by joint the samples (n,) at which it moved.

    Raises:
        ConfigError: something is to be noticeable on a joint that is not judged.
    """
    observable = observable_torques(config.policy, inputs.rule.gamma_nm, inputs.laws)
    series, states = prepared.judged_series, run.detected.state
    recorded = np.logical_or.reduce([column != State.GAP for column in states.T])
    samples = _spread(np.flatnonzero(recorded), MOMENTS)
    at_samples = np.full((samples.size, states.shape[1]), np.inf)

    def of_joint(joint: str) -> JointSensitivity:
        j = series.column(joint)
        level, state = detectable_torque(run, j, inputs.rule.n), states[:, j]
        at_samples[:, j] = level[samples]
        there, moves = np.asarray((state != State.GAP) & (state != State.NOT_WATCHED)), moving[joint]
        if not there.all():
            level, moves = level[there], moves[there]
        return _distribution(level, moves, series.period_s, gaps_s, observable[joint])

    watched = [joint for joint in series.joint_names if inputs.watch[joint].watched and joint in observable]
    joints = by_name(of_joint, watched)
    if not run.residual.isolation.isolates:
        return Sensitivity(joints)
    return Sensitivity(joints, force_sensitivities(prepared, at_samples, samples, config.robot.tool.frame))


def _spread(samples: IntArray, most: int) -> IntArray:
    """At most so many of the samples, evenly spread."""
    if samples.size <= most:
        return samples
    return np.asarray(samples[((np.arange(most) + 0.5) * samples.size / most).astype(np.int64)])


def _distribution(
    level_nm: FloatArray, moving: BoolArray, period_s: float, gaps_s: float, observable: Observable
) -> JointSensitivity:
    """Of the levels (k,) of recorded samples, some in motion, and so much time besides in which nothing can be told."""
    known = np.isfinite(level_nm)
    detectable = np.asarray(level_nm <= observable.torque_nm)
    finite = level_nm[known]
    count = level_nm.size + round(gaps_s / period_s)
    starts, stops = run_bounds(~detectable)
    return JointSensitivity(
        observable_nm=observable.torque_nm,
        observable_stated=observable.stated,
        all=_shares(detectable, known, detectable.size, period_s, gaps_s),
        motion=_shares(detectable & moving, known & moving, int(np.count_nonzero(moving)), period_s, gaps_s),
        longest_hidden_s=float((stops - starts).max(initial=0)) * period_s,
        largest_nm=float(finite.max()) if finite.size else None,
        levels=tuple(TorqueLevel(*pair) for pair in zip(SHARES, level_at(finite, count, SHARES), strict=True)),
    )


def _shares(detectable: BoolArray, known: BoolArray, samples: int, period_s: float, gaps_s: float) -> TimeShares:
    """Of so many samples, those that are detectable, and those of which a level is known, being marked."""
    seen, told = int(np.count_nonzero(detectable)), int(np.count_nonzero(known))
    return TimeShares(
        time_s=samples * period_s + gaps_s,
        detectable_s=seen * period_s,
        hidden_s=(told - seen) * period_s,
        not_judged_s=(samples - told) * period_s + gaps_s,
    )


def level_at(known: FloatArray, count: int, shares: Sequence[float]) -> list[float | None]:
    """The smallest of the known values that a share of all ``count`` values does not exceed; None: too few are known.

    Args:
        known: (k,) finite values, k <= count.
        count: how many there are with the unknown ones, which exceed everything.
        shares: above 0, to 1.
    """
    places = [max(math.ceil(share * count - 1e-9), 1) - 1 for share in shares]
    value = {place: in_order(known, place)[0] for place in set(places) if place < known.size}
    return [value.get(place) for place in places]


def _lasting(level: FloatArray, n: int) -> FloatArray:
    """(n,) lowest, over the stretches of ``n`` samples that hold a sample, of their highest; overwrites ``level``."""
    if n <= 1 or level.size == 0:
        return level
    if level.size < n:
        level[:] = np.inf
        return level
    highest = np.empty(level.size + n - 1)
    highest[: n - 1] = highest[level.size :] = np.inf  # stretches that reach beyond an end do not exist
    window_maxima(level, n, highest[n - 1 : level.size])
    return window_minima(highest, n, level)
