"""Rule (6) as applied to one log: thresholds, persistence in samples, which joints are judged, what is out of reach.

Judged are position-controlled joints, not those that give way to a commanded force. Thresholds that no contact of the
arm reaches, or hardly any, are said; how hard a push must be, and how long, is what ``core/verdict/sensitivity.py``
tells of the whole arm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import Config, DetectConfig
from collaudit.core.config.schema_judging import DEFAULT_PERSISTENCE_MS
from collaudit.core.data.audit_result import RuleFacts
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.data.recommendation_result import MotionLevels
from collaudit.core.detection.rule import persistence_samples
from collaudit.core.errors import NotJudgedError, refuse_unknown
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, run_bounds
from collaudit.core.numeric.stats import median_of, quantile_of
from collaudit.core.prepare.phases import contact_mask
from collaudit.core.prepare.prepared import Prepared

#: A spike of one sample or two does not alarm only to save time.
_FEWEST_CAUSAL = 3


def make_rule(
    series: UniformSeries,
    phases: NDArray[np.int8],
    config: Config,
    motion: MotionLevels | None = None,
) -> tuple[RuleFacts, dict[str, Watch]]:
    """Thresholds, persistence and watched joints for a log's judged joints.

    Args:
        series, phases, config: of the log.
        motion: what motion does by itself, where thresholds are automatic.

    Raises:
        ConfigError: a threshold or a watched name belongs to no judged joint.
        NotJudgedError: the persistence is longer than the log: nothing could alarm.
    """
    detect, motion = config.detect, motion or MotionLevels()
    watch = choose_watched(series, contact_mask(phases), detect)
    gamma: dict[str, float] = {}
    if not isinstance(detect.gamma_nm, str):
        problem = "a threshold belongs to no judged joint"
        gamma = stated_by_joint(detect.gamma_nm, series.joint_names, problem, "[detect] gamma_nm")
    for joint in series.joint_names:
        if joint not in gamma and watch[joint].watched:
            watch[joint] = Watch(False, False, "there is no threshold for it")
    n, requested = stated_persistence(detect, series.period_s)
    if n > series.time_s.size:  # before anything takes memory for so many
        raise NotJudgedError(
            "the persistence is longer than the log: nothing could alarm",
            found=f"n = {n} samples ({n * series.period_s:.4g} s), of {series.time_s.size} in the log",
            hint="shorten [detect] persistence_ms or n; 25 ms is usual",
        )
    rule = RuleFacts(
        detector=detect.detector,
        gamma_nm=gamma,
        n=n,
        persistence_s=n * series.period_s,
        persistence_requested_ms=requested,
        watch=tuple(j for j in series.joint_names if watch[j].watched),
        near_miss_nm={  # beyond what motion does where that is known
            joint: max(config.near_miss.amplitude * its, min(motion.level_nm.get(joint, 0.0), its))
            for joint, its in gamma.items()
        },
        near_miss_persistence=config.near_miss.persistence,
        motion_nm={joint: level for joint, level in motion.level_nm.items() if joint in gamma},
        at_rest_nm=motion.at_rest_nm,
    )
    return rule, watch


def stated_persistence(detect: DetectConfig, period_s: float) -> tuple[int, float | None]:
    """Persistence in samples, and in ms as it was asked for; None where it is told in samples."""
    if detect.n is not None:
        return detect.n, None
    n = persistence_samples(detect.asked_persistence_ms / 1e3, period_s)
    if detect.short_persistence:
        return min(max(n, _FEWEST_CAUSAL), persistence_samples(DEFAULT_PERSISTENCE_MS / 1e3, period_s)), None
    return n, detect.asked_persistence_ms


def stated_by_joint(
    stated: float | dict[str, float], joints: tuple[str, ...], problem: str, where: str
) -> dict[str, float]:
    """A number that is stated for all of the joints, or for some by name; arguments as of :func:`refuse_unknown`."""
    if not isinstance(stated, dict):
        return dict.fromkeys(joints, float(stated))
    refuse_unknown(stated, joints, problem, where)
    return {joint: float(stated[joint]) for joint in joints if joint in stated}


def watch_findings(watch: Mapping[str, Watch]) -> list[Finding]:
    """Which joints are not judged, or not in contact, and why."""
    findings: list[Finding] = []
    for joint, choice in watch.items():
        if not (choice.watched and choice.in_contact):
            where = "in contact" if choice.watched else "at all"
            text = f"Joint '{joint}' is not judged {where}: {choice.why}."
            findings.append(Finding("coverage-low", "info" if choice.watched else "warning", text, joint=joint))
    return findings


#: A joint in contact that reverses more often a second, over smaller strokes (rad; m if prismatic), is taken as
#: controlled by force: the paper's joints 2 to 5 do while they polish.
_REVERSALS_PER_S, _REVERSAL_STROKE = 0.5, 0.02
#: Strokes shorter than this are encoder noise of a standing joint, rad.
_NOISE_STROKE = 2e-4


@dataclass(frozen=True, slots=True)
class Watch:
    """Whether and where one joint is judged.

    Attributes:
        watched: whether it is judged at all.
        in_contact: whether it is judged during contact.
        why: the reason, for a reader.
    """

    watched: bool
    in_contact: bool
    why: str


def choose_watched(series: UniformSeries, contact: BoolArray, config: DetectConfig) -> dict[str, Watch]:
    """Decide by joint.

    With ``watch = "auto"`` every joint is judged, except during contact those that reverse often over
    small strokes: friction at reversal cannot be modelled well, and their motion obeys the force (the
    paper's joints 2-5). A list of names overrides this.

    Raises:
        ConfigError: a named joint is not in the log.
    """
    if config.watch != "auto":
        problem = "a watched joint is not among the judged joints"
        refuse_unknown(config.watch, series.joint_names, problem, "[detect] watch")
        named, others = Watch(True, True, "named in [detect] watch"), Watch(False, False, "not named in [detect] watch")
        return {joint: named if joint in config.watch else others for joint in series.joint_names}
    out = {}
    for j, joint in enumerate(series.joint_names):
        rate, stroke = _reversals(series.position_rad[:, j], series.velocity_rad_s[:, j], contact, series.period_s)
        if rate > _REVERSALS_PER_S and stroke < _REVERSAL_STROKE:
            why = (
                f"force-controlled in contact: {rate:.2g} reversals a second over strokes of {stroke:.2g} rad "
                "(median); friction at reversal hides what its residual would show"
            )
            out[joint] = Watch(True, False, why)
        else:
            out[joint] = Watch(
                True, True, "position-controlled throughout" if contact.any() else "every joint is watched"
            )
    return _lumped(out, series.joint_names)


def _lumped(choice: dict[str, Watch], joints: tuple[str, ...]) -> dict[str, Watch]:
    """The paper's reduction: runs of force-controlled joints become one body seen by the joint inside of it."""
    forced = np.array([not choice[joint].in_contact for joint in joints])
    for a, b in zip(*run_bounds(forced), strict=True):
        names = f"{joints[a]} to {joints[b - 1]}" if b - a > 1 else joints[a]
        if a == 0:
            text = f"no position-controlled joint lies inside of {names}: in contact, pushes there cannot be seen"
        else:
            watcher, inner = joints[a - 1], choice[joints[a - 1]]
            text = f"in contact the links of {names} count as one body, and {watcher}, position-controlled, watches it"
            choice[watcher] = replace(inner, why=f"{inner.why}; in contact it also watches the links of {names}")
        for joint in joints[a:b]:
            choice[joint] = replace(choice[joint], why=f"{choice[joint].why}; {text}")
    return choice


def _reversals(q: FloatArray, v: FloatArray, contact: BoolArray, period_s: float) -> tuple[float, float]:
    """Reversals a second and median stroke between them, rad, over the contact phases."""
    if not contact.any():
        return 0.0, 0.0
    count, strokes, seconds = 0, [], 0.0
    for a, b in zip(*run_bounds(contact & np.isfinite(q) & np.isfinite(v)), strict=True):
        forward, backward = v[a:b] > 0, v[a:b] < 0
        turns = np.flatnonzero(forward[1:] & backward[:-1] | backward[1:] & forward[:-1]) + a
        stroke = np.abs(np.diff(q[turns]))
        stroke = stroke[stroke > _NOISE_STROKE]
        count += stroke.size
        strokes.append(stroke)
        seconds += (b - a) * period_s
    if count == 0 or seconds == 0:
        return 0.0, 0.0
    return count / seconds, median_of(np.concatenate(strokes))


#: A threshold that many times beyond all that any joint of the arm exerted, or than a joint's limit, is a mistake.
_FAR = 10.0
#: A threshold above this share of the range of the joint's torque tells little of what people do to an arm.
_COARSE = 0.1
#: Samples, drawn evenly, that tell that range.
_DRAWN = 100_000


def reach_findings(prepared: Prepared, rule: RuleFacts) -> list[Finding]:
    """Thresholds that nothing could exceed, and those that are large beside what the joints themselves exert.

    A drive holds against an external torque with its own, so an external torque above the joint's limit does not build
    up for long. The largest torque on record says what the arm is used for: an alarm that needs more than that needs
    a harder contact than all that the arm did itself.

    Args:
        prepared: the log, and the limits of its joints.
        rule: as applied.
    """
    series = prepared.judged_series
    if series.effort is None or series.effort_unit != "Nm":
        return []
    out, coarse = [], []
    largest, span = _largest_efforts(series), _range(series)
    limits = dict(zip(prepared.robot.joint_names, known_limits(prepared).tolist(), strict=True))
    most = max(largest.values(), default=0.0)
    for joint in rule.watch:
        gamma, limit = rule.gamma_nm[joint], limits[joint]
        if largest[joint] and (gamma > _FAR * most or gamma > _FAR * limit):
            limited = "" if np.isnan(limit) else f"; the joint's limit is {limit:.4g} N·m"
            text = (
                f"The threshold of joint '{joint}', {gamma:.4g} N·m, is more than {_FAR:g} times what this arm exerts "
                f"(at most {most:.4g} N·m on record{limited}): no contact exceeds it, and nothing is judged by it."
            )
            out.append(Finding("rule-unfit", "error", text, joint=joint))
        elif gamma > _COARSE * span[joint] > 0.0:
            coarse.append(f"{joint} {gamma:.3g} of {span[joint]:.3g}")
    if coarse:
        text = (
            f"Thresholds above a tenth of the range of the joint's own torque in this log, N·m: {', '.join(coarse)}. "
            "Contacts that are not small beside the arm's own torques go unseen there."
        )
        out.append(Finding("rule-unfit", "warning", text))
    return out


def known_limits(prepared: Prepared) -> FloatArray:
    """(j,) torque limits of the joints; NaN where none is known, or the log exceeds it: that is none."""
    largest = _largest_efforts(prepared.series) if prepared.series.effort_unit == "Nm" else {}
    seen = np.array([largest.get(joint, 0.0) for joint in prepared.robot.joint_names])
    return np.where(prepared.robot.effort_limit_nm >= seen, prepared.robot.effort_limit_nm, np.nan)


def _range(series: UniformSeries) -> Mapping[str, float]:
    """From the lowest to the highest effort of each joint, one in a hundred left out at either end, N·m or N."""
    assert series.effort is not None
    some = series.effort[:: max(1, series.effort.shape[0] // _DRAWN)]
    known = [column[np.isfinite(column)] for column in some.T]
    ends = [[quantile_of(x, share) if x.size else 0.0 for share in (0.01, 0.99)] for x in known]
    return {joint: b - a for joint, (a, b) in zip(series.joint_names, ends, strict=True)}


def _largest_efforts(series: UniformSeries) -> Mapping[str, float]:
    """The largest effort of each joint, N·m or N; joints without any are absent."""
    if series.effort is None:
        return {}
    ends = np.stack([np.fmax.reduce(series.effort, axis=0), -np.fmin.reduce(series.effort, axis=0)])
    size = np.abs(np.nan_to_num(np.maximum(*ends))).tolist()
    return dict(zip(series.joint_names, size, strict=True))
