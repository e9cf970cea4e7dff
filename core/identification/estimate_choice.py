"""What a fit identifies beside friction, and how far the description is trusted: chosen by held-out error.

A description that is right needs no identification, and one that lacks a tool, rotors or good inertials leaves what no
friction law explains. Which of them it is the motion tells: each candidate is fitted without a part of the data and
predicts that part. Parts are blocks of time, and whole logs where there are several. The simplest candidate within one
standard error of the best is taken (the one-standard-error rule: Breiman et al., Classification and Regression Trees,
1984, ch. 3), an error that stretches of five seconds tell, for neighbouring samples err alike.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import EstimateChoice, TriedEstimate
from collaudit.core.errors import ConfigError, NotJudgedError
from collaudit.core.identification.motion_sums import MotionSums, collect
from collaudit.core.identification.solved_problem import Candidate, Gains, solved, with_gains
from collaudit.core.identification.sums_solution import Unknowns, held_out
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.prepare.prepared import Prepared

#: An error counts as at most this many times the usual one: contact and stops choose nothing.
_MOST = 3.0
#: Seconds that err alike: a stroke, or a few of them.
_ALIKE_S = 5.0
#: Whole logs are held out where there are so many.
_FEWEST_LOGS = 2
#: Standard errors by which a joint's own torque by its angle must predict better.
_SURE = 2.0
#: Trust in the description that is tried where none is stated: standard deviation of its inertials, as a share.
WIDTHS = (0.2, 1.0, 5.0)


def candidates_of(estimate: Sequence[str] | str, with_gain: bool, with_rotor: bool = True) -> tuple[Candidate, ...]:
    """What is tried, the simplest first.

    Args:
        estimate: as configured: ``auto``, or what is to be identified in any case.
        with_gain: whether the scale of the effort is open to the data.
        with_rotor: whether the effort has the torque that accelerates the rotors; behind the gears it has not.
    """
    if estimate != "auto":
        stated = tuple(item for item in estimate if item != "friction")
        return tuple(Candidate(stated, w) for w in (WIDTHS if "inertials" in stated else WIDTHS[:1]))
    parts = ((), ("rotor",), ("rotor", "tool")) if with_rotor else ((), ("tool",))
    plain = [Candidate(part, WIDTHS[0]) for part in parts]
    every = [*plain, *(Candidate(("inertials",), w) for w in WIDTHS)]
    return tuple([*every, *(replace(c, estimate=(*c.estimate, "gain")) for c in every)] if with_gain else every)


def with_springs(tried: Sequence[Candidate], joints: tuple[int, ...]) -> tuple[Candidate, ...]:
    """Each candidate also with torques by the angles of some joints; these after all that are rigid bodies alone.

    Args:
        tried: the simplest first; those with gains, which such torques would be mistaken for, get none.
        joints: by number.
    """

    def rank(one: Candidate) -> tuple[bool, bool, bool]:
        return "gain" in one.estimate, "spring" in one.estimate, "inertials" in one.estimate

    more = [replace(c, estimate=(*c.estimate, "spring"), springs=joints) for c in tried if "gain" not in c.estimate]
    return tuple(sorted((*tried, *more), key=rank))


def wanted(config: Config) -> tuple[str, ...] | Literal["auto"]:
    """What is to be identified; a tool whose mass is ``estimate`` belongs to it."""
    if config.fit.estimate == "auto":
        return "auto"
    asked = list(dict.fromkeys(config.fit.estimate))
    if config.robot.tool.mass_kg == "estimate" and "tool" not in asked:
        asked.append("tool")
    return tuple(asked)


def choose(
    prepared: Sequence[Prepared], config: Config, sums: MotionSums | None = None
) -> tuple[Candidate, EstimateChoice | None]:
    """What is identified from these logs beyond friction, and what else was tried; nothing where nothing can be.

    Args:
        prepared: the logs.
        config: what is asked for.
        sums: of the logs; None to gather them here.

    Raises:
        ConfigError: efforts in an unknown unit without the gain being estimated. NotJudgedError: what is asked for
            needs inertials, or more motion.
    """
    asked, robot = wanted(config), prepared[0].robot
    raw = prepared[0].series.effort_unit == "raw"
    tried = _possible(asked, prepared[0], config)
    nothing = Candidate((), tried[0].width)
    unmodelled = not robot.has_inertials or any(log.series.effort is None for log in prepared)
    if unmodelled and (asked == "auto" or not tried[0].estimate):
        return nothing, None
    if asked != "auto":
        _refuse_if_impossible(asked, prepared[0])
    stated = tried[0] if len(tried) == 1 else None
    if stated is not None:
        if raw or "gain" in stated.estimate:
            return stated, None
        others = candidates_of("auto", False, prepared[0].effort_source != "joint")
        tried = (stated, *(one for one in others if one != stated))
    try:
        sums = sums or collect(prepared, config.fit.blocks)
    except (NotJudgedError, ConfigError):
        if asked == "auto" or stated is not None:
            return stated or nothing, None
        raise

    gains: list[Gains] = []  # nothing else that a candidate opens changes them

    def unknowns(one: Candidate) -> Unknowns:
        if "tool" in one.estimate:  # with the inertia of its mass, and other gains beside it
            return solved(prepared, sums, config, one).problem.unknowns
        found, estimated = with_gains(prepared, config, one, sums, gains[0] if gains else None)
        if estimated is not None and not gains:
            gains.append(estimated)
        return found

    # one scale for all: each divided by its own gain, errors would look the smaller the larger the gain
    scale = unknowns(tried[0]).gain if raw else np.ones(len(robot.joint_names))
    if not np.isfinite(scale).any():
        return nothing, None

    whole_logs, alike = [sums.log] if np.unique(sums.log).size >= _FEWEST_LOGS else [], sums.together(_ALIKE_S)

    def left_of(one: Unknowns) -> FloatArray:
        return held_out(sums, one, [sums.fold, *whole_logs]) * (one.gain / scale)

    left = {one: left_of(unknowns(one)) for one in tried}
    plain = [one for one in tried if not {"gain", "inertials", "tool"} & set(one.estimate)]
    if asked == "auto" and plain:
        every = left_of(unknowns(replace(plain[-1], estimate=(*plain[-1].estimate, "spring"))))
        springs = _joints_better(every, left[plain[-1]], alike)
        tried = with_springs(tried, springs) if springs else tried
    left = {one: left[one] if one in left else left_of(unknowns(one)) for one in tried}
    if not np.isfinite(list(left.values())).all(axis=0).any():  # no sample by which all can be compared
        return tried[0], None

    def refused(one: Candidate) -> str:
        free = "tool" in one.estimate and one != stated and (asked == "auto" or stated is not None)
        return "the tool would weigh less than nothing" if free and _weighs_less(prepared, sums, config, one) else ""

    taken, choice = choose_estimate(tried, list(left.values()), alike, robot.joint_names, refused)
    if stated is None:
        return taken, choice
    return stated, None if taken == stated else replace(choice, taken=stated.words, better=taken.words)


def _possible(asked: Sequence[str] | str, log: Prepared, config: Config) -> tuple[Candidate, ...]:
    """The candidates of what is asked for that such logs leave open, the simplest first."""
    raw = log.series.effort_unit == "raw"
    with_gain = asked == "auto" and (raw or config.log.units.has_constants)
    every = candidates_of(asked, with_gain, log.effort_source != "joint")
    if asked == "auto" and raw:  # without its gain an effort is no torque
        return tuple(one for one in every if "gain" in one.estimate)
    if asked == "auto" and config.robot.tool.mass_kg == "estimate":
        return tuple(one for one in every if not {"inertials", "gain"} & set(one.estimate))  # a tool, or none
    return every


def _refuse_if_impossible(asked: Sequence[str], log: Prepared) -> None:
    if set(asked) == {"friction"}:
        return
    if not log.robot.has_inertials:
        raise NotJudgedError(
            f"{', '.join(asked)} cannot be identified: the robot has no inertials",
            hint="give a URDF with <inertial> elements, or masses in the [[robot.dh]] rows",
        )
    if log.series.effort_unit == "raw" and "gain" not in asked:
        raise ConfigError(
            "the effort's unit is not known, so its gain must be estimated too",
            where="[fit] estimate",
            found=", ".join(asked),
            expected='"gain" among them',
        )


def _joints_better(with_more: FloatArray, without: FloatArray, cluster: IntArray) -> tuple[int, ...]:
    """Joints whose held-out torque (n, j) is less with more identified, by two standard errors of the difference."""
    out = []
    for j in range(without.shape[1]):
        usual = np.array([np.sqrt(np.nanmean(without[:, j] ** 2))]) if np.isfinite(without[:, j]).any() else np.ones(1)
        gained = _by_cluster(without[:, j, None], usual, cluster) - _by_cluster(with_more[:, j, None], usual, cluster)
        if gained.size and gained.mean() > _SURE * _error(gained):
            out.append(j)
    return tuple(out)


def _weighs_less(prepared: Sequence[Prepared], sums: MotionSums, config: Config, taken: Candidate) -> bool:
    """Whether the arm would carry a tool of negative mass: something else of the description is wrong then."""
    found = solved(prepared, sums, config, taken)
    body = 10 * sums.robot.in_joint(config.robot.tool.frame)[2]
    known = config.robot.tool.mass_kg
    change = float(found.solution.inertials[body] - sums.robot.inertial_parameters[body])
    return change + (0.0 if isinstance(known, str) else known) < 0.0


def choose_estimate(
    tried: Sequence[Candidate],
    left: Sequence[FloatArray],
    cluster: IntArray,
    joint_names: Sequence[str],
    refused: Callable[[Candidate], str],
) -> tuple[Candidate, EstimateChoice]:
    """The simplest candidate within one standard error of the least held-out error, and what each leaves.

    Args:
        tried: the simplest first.
        left: of each (n, j) held-out torque, N·m.
        cluster: (n,) stretch that a sample belongs to.
        joint_names: of the columns.
        refused: why what a candidate finds cannot be; empty where it can. A tool that cannot be is none for all.
    """
    rms = np.array([_rms(rest) for rest in left])
    usual = np.min(np.where(np.isfinite(rms), rms, np.inf), axis=0)
    estimated = np.isfinite(left).all(axis=0)  # a joint whose gain some candidates do not tell compares none of them
    loss = np.array([_by_cluster(np.where(estimated, rest, np.nan), usual, cluster) for rest in left])
    mean, open_, taken = loss.mean(axis=1), np.ones(len(tried), dtype=bool), _simplest(loss)
    if why := refused(tried[taken]):
        open_ = np.array(["tool" not in one.estimate for one in tried])
        taken = int(np.flatnonzero(open_)[_simplest(loss[open_])])
    best = int(np.argmin(np.where(open_, mean, np.inf)))
    facts = tuple(
        TriedEstimate(
            what=one.words,
            held_out_rms_nm={j: float(x) for j, x in zip(joint_names, row, strict=True) if np.isfinite(x)},
            worse=float(a - mean[best]),
            refused=None if can_be else why,
        )
        for one, row, a, can_be in zip(tried, rms, mean, open_, strict=True)
    )
    return tried[taken], EstimateChoice(tried[taken].words, _error(loss[best]), facts)


def _simplest(loss: FloatArray) -> int:
    """The first of candidates (k, c) whose mean loss lies within one standard error of the least."""
    mean = loss.mean(axis=1)
    best = int(np.argmin(mean))
    return int(np.flatnonzero(mean <= mean[best] + _error(loss[best]))[0])


def _error(loss: FloatArray) -> float:
    """Standard error of the mean of (c,) losses."""
    return float(loss.std() / np.sqrt(loss.size))


def _rms(rest: FloatArray) -> FloatArray:
    """(j,) root mean square of what is known."""
    count = np.count_nonzero(np.isfinite(rest), axis=0)
    mean = np.nansum(rest**2, axis=0) / np.maximum(count, 1)
    return np.asarray(np.where(count > 0, np.sqrt(mean), np.nan))


def _by_cluster(rest: FloatArray, usual: FloatArray, cluster: IntArray) -> FloatArray:
    """(c,) mean over samples and joints of squared errors in units of the usual, of each cluster with any."""
    size = np.minimum(np.abs(rest) / np.maximum(usual, 1e-9), _MOST) ** 2
    known = np.isfinite(size)
    count = np.bincount(cluster, known.sum(axis=1))
    total = np.bincount(cluster, np.where(known, size, 0.0).sum(axis=1))
    return np.asarray(total[count > 0] / count[count > 0])
