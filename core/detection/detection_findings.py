"""Findings on a detection: slow filters, friction off its calibration, events cut off, poor models, spikes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from collaudit.core.data.audit_result import Collision, ResidualStats, RuleFacts
from collaudit.core.data.detection_result import LevelFacts
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.joint_log import MOVING_RAD_S, UniformSeries
from collaudit.core.data.signals import Signals, State
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray, run_bounds
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.stats import bend_of, median_of, robust_sd
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.followed_offsets import LARGEST
from collaudit.core.residual.residual import Residual

#: A level this far from the calibration is worth saying.
_NOTABLE_LEVEL = 0.05
#: A push of the persistence this many times the threshold is to be seen.
_SHORT_PUSH_FACTOR = 1.3
_LISTED_CUTS = 50
#: A model that leaves this share of the torque's spread in so much motion, s, explains nothing.
_NO_GAIN, _NO_GAIN_S = 0.9, 5.0
#: A residual that spreads this many times as far as the measured torque is that of an effort that shows neither model
#: nor friction.
_SHOWS_NEITHER = 3.0
#: A residual so many times that of the fitted logs is that of another arm, tool or sensor. Between real recordings of
#: one arm it grew by up to 1.9 times, and 2.8 times on an axis with a counterbalance; simulated, 2.6 times with
#: friction of another temperature, 2 to 4 times with another filter of the effort, and 16 times with another arm.
_OTHER_THAN_FITTED = 2.0
#: Samples that tell it as well as all would, and the fewest that do.
_TELLING = 500
#: Share of that spread, taken about zero, beyond which the median makes an offset of it: of one alone it is 0.67.
_OF_ONE_SIGN = 0.5
#: A zero further off than this share of the threshold is worth a word.
_NOTABLE_ZERO = 0.1
#: What cuts an event off: signals that end or mean nothing there.
_BLIND = [State.SATURATED, State.NOT_A_NUMBER, State.GAP, State.EDGE, State.NOT_DRIVEN]


def detection_findings(
    series: UniformSeries, run: DetectorRun, inputs: DetectionInputs, levels: Mapping[str, LevelFacts]
) -> list[Finding]:
    """A slow filter, friction off its calibration, and events cut off by what is not judged.

    Args:
        series: the judged joints.
        run, inputs: of the detector.
        levels: of friction, by joint.
    """
    findings = _slow_kernel(run, inputs.rule, series.period_s)
    findings += _friction_levels(levels)
    findings += _zeros_off(run.residual, inputs.rule)
    ripple = ", ".join(f"'{joint}' {nm:.2g} N·m" for joint, nm in run.residual.ripple_not_shown_nm.items())
    if ripple:
        text = (
            f"The log does not show the friction file's gear ripple at its place, so it is not subtracted: {ripple}. "
            "Constant thresholds are raised by it; automatic ones hold it."
        )
        findings.append(Finding("friction-level", "info", text))

    def of_joint(joint: str) -> list[Finding]:
        return _cut_events(series, run, series.column(joint), joint, inputs.rule.n)

    return findings + [finding for its in by_name(of_joint, inputs.rule.watch).values() for finding in its]


def _friction_levels(levels: Mapping[str, LevelFacts]) -> list[Finding]:
    """Joints whose friction ran notably off its calibration."""
    findings: list[Finding] = []
    for joint, level in levels.items():
        span = max(abs(level.lowest - 1.0), abs(level.highest - 1.0))
        if span >= LARGEST - 1e-6:
            text = (
                f"The friction of joint '{joint}' is {100 * LARGEST:.0f} % or more off its calibration: fit it "
                "again; alarms of this joint are doubtful."
            )
            findings.append(Finding("friction-level", "warning", text, joint=joint))
        elif span > max(_NOTABLE_LEVEL, 2.0 * level.sd):
            text = (
                f"The friction of joint '{joint}' ran at {level.lowest:.3g} to {level.highest:.3g} of its calibration "
                f"(standard error {level.sd:.2g}); the residual follows it."
            )
            findings.append(Finding("friction-level", "info", text, joint=joint))
    return findings


def _zeros_off(residual: Residual, rule: RuleFacts) -> list[Finding]:
    """Joints whose torque has another zero than in the fit, as far as that is worth a word."""
    findings = []
    for joint, zero in residual.zeros.items():
        far = max(abs(zero.lowest_nm), abs(zero.highest_nm))
        if far > zero.bound_nm:
            text = (
                f"The zero of the torque of joint '{joint}' lies {zero.lowest_nm:.2g} to {zero.highest_nm:.2g} N·m off "
                "where the fit had it: a drift of the sensor, a load, or a lasting contact. At most "
                f"{zero.bound_nm:.2g} N·m of it, a quarter of the threshold, are taken off; the rest is in the "
                "residual."
            )
            findings.append(Finding("friction-level", "warning", text, joint=joint))
        elif far > _NOTABLE_ZERO * rule.gamma_nm.get(joint, np.inf):
            text = (
                f"The zero of the torque of joint '{joint}' ran at {zero.lowest_nm:.2g} to {zero.highest_nm:.2g} N·m; "
                "it was taken off."
            )
            findings.append(Finding("friction-level", "info", text, joint=joint))
    return findings


def _slow_kernel(run: DetectorRun, rule: RuleFacts, period_s: float) -> list[Finding]:
    """Whether the kernel is too wide for the persistence asked for."""
    share = float(run.residual.balance.kernel.push_response(rule.n, period_s)[0].max())
    if share >= 1.0 / _SHORT_PUSH_FACTOR:
        return []
    name = run.detector.name
    remedy = (
        "A higher [conditioning] bandwidth_hz shows more, as far as the log's rate and noise allow."
        if name == "direct"
        else "A higher [detect] observer_gain_per_s or [conditioning] bandwidth_hz, or detector = 'direct', shows more."
    )
    text = (
        f"The filter of the detector '{name}' lets {100 * share:.0f} % of a push of "
        f"{1e3 * rule.n * period_s:.3g} ms pass: a push that short alarms only above {1 / share:.2g} times the "
        "threshold. "
        f"{remedy}"
    )
    return [Finding("rule-unfit", "warning", text)]


def _cut_events(series: UniformSeries, run: DetectorRun, j: int, joint: str, n: int) -> list[Finding]:
    """Exceedances that end in an unjudged stretch and would have been events had it gone on, or that lie in one.

    Faster than friction was measured, or between unjudged samples, the residual is no evidence, but no clean bill.
    """
    state, level = run.detected.state[:, j], run.gamma_nm[:, j].astype(np.float64)
    above = np.abs(run.residual.torque_nm[:, j]) > level
    pinned = state == State.SATURATED  # a clipped effort bounds the residual from below: it counts as above
    evidence = state <= State.FRICTION_INTERVAL
    meaningful = evidence | pinned | (state == State.TOO_FAST) | (state == State.TOO_BRIEF)
    above &= meaningful
    blind = np.logical_or.reduce([state == code for code in _BLIND])
    out = []
    fired = [c.onset_s for c in run.detected.collisions if c.joint == joint]
    for a, b in zip(*run_bounds(above | blind), strict=True):
        count = int(np.count_nonzero(above[a:b])) if b - a >= n else 0
        if count == 0 or (count == b - a and evidence[a:b].all()):
            continue
        first, last = float(series.time_s[a]), float(series.time_s[b - 1])
        if any(first - series.period_s <= t <= last for t in fired):
            continue
        text = (
            f"The residual of joint '{joint}' was above its threshold for {count} sample{'s' * (count != 1)} in or "
            f"next to a stretch that is not judged ({first:.4g} to {last:.4g} s): a contact may have been missed or "
            "cut off."
        )
        out.append(Finding("event-cut", "warning", text, joint=joint, start_s=first, end_s=last))
    return out[:_LISTED_CUTS]


def residual_level_findings(
    signals: Signals, stats: Mapping[str, ResidualStats], gamma_nm: Mapping[str, float], fitted_nm: Mapping[str, float]
) -> list[Finding]:
    """Joints whose residual is several times that of the fitted logs, or averages more than half their threshold, N·m.

    Args:
        signals: of the log.
        stats, gamma_nm: by joint.
        fitted_nm: by joint, what the robust standard deviation of the residual was in the motion of the fitted logs.
    """
    findings = []
    for joint, level in stats.items():
        if joint not in gamma_nm:
            continue
        gamma, mean = gamma_nm[joint], level.clean_mean_abs_nm
        usual, middle = _usual_nm(signals, joint)
        times = usual / fitted_nm[joint] if fitted_nm.get(joint) else 0.0
        if times > _OTHER_THAN_FITTED:
            text = (
                f"In most of the motion the residual of joint '{joint}' is {times:.2g} times that of the fitted logs "
                f"({usual:.3g} against {fitted_nm[joint]:.3g} N·m, robust standard deviation): the friction file may "
                "be of another arm, tool, temperature or filter of the effort, or contact lasts for most of the log."
            )
            if abs(middle) > _OF_ONE_SIGN * usual:
                text += (
                    f" Its median is {middle:.3g} N·m: most of it is an offset, as of a sensor whose zero has drifted "
                    "since the fit, or of a steady pull."
                )
        elif mean is not None and mean > 0.5 * gamma:
            text = (
                f"The contact-free residual of joint '{joint}' averages {mean:.3g} N·m against a threshold of "
                f"{gamma:.3g} N·m: the model fits this joint too poorly for it."
            )
        else:
            continue
        findings.append(Finding("residual-level", "warning", text, joint=joint))
    return findings


def _usual_nm(signals: Signals, joint: str) -> tuple[float, float]:
    """Robust standard deviation and median of a residual where friction is known by value; 0 where hardly anything."""
    j = signals.joint_names.index(joint)
    residual = signals.residual_nm[signals.state[:, j] == State.JUDGED, j]
    if residual.size < _TELLING:
        return 0.0, 0.0
    drawn = residual[:: residual.size // _TELLING]
    return robust_sd(drawn), median_of(drawn)


def scatter_findings(fits: Mapping[str, FrictionFit], gamma_nm: Mapping[str, float]) -> list[Finding]:
    """Joints whose friction points scatter about the curve by more than half the threshold."""
    return [
        Finding(
            "residual-level",
            "warning",
            f"The friction points of joint '{joint}' scatter by {fit.rmse_nm:.3g} {fit.effort_unit} (RMS) about the "
            f"fitted curve, against a threshold of {gamma_nm[joint]:g} {'N' if fit.effort_unit == 'N' else 'N·m'}: an "
            "error of friction or of the model can by itself look like a contact on this joint.",
            joint=joint,
        )
        for joint, fit in fits.items()
        if joint in gamma_nm and fit.rmse_nm is not None and fit.rmse_nm > 0.5 * gamma_nm[joint]
    ]


def model_worth_findings(prepared: Prepared, run: DetectorRun, inputs: DetectionInputs) -> list[Finding]:
    """Watched joints whose residual in motion spreads as much as their measured torque does, or several times as much.

    Contact adds to both alike. A residual of three times the measured torque is one of which model and friction alone
    make at least twice the torque that was measured.

    Args:
        prepared: the log and its model.
        run: what the detector made of it.
        inputs: which joints are watched.
    """
    series, residual = prepared.judged_series, run.residual
    if residual.effort_nm is None or prepared.rigid_nm is None:
        return []

    def of_joint(joint: str) -> Finding | None:
        j = series.column(joint)
        assert residual.effort_nm is not None
        moving = np.abs(series.velocity_rad_s[:, j]) > MOVING_RAD_S
        good = (run.detected.state[:, j] == State.JUDGED) & moving & np.isfinite(residual.effort_nm[:, j])
        if np.count_nonzero(good) * series.period_s < _NO_GAIN_S:
            return None
        effort = residual.effort_nm[:, j]
        after = float(np.std(residual.torque_nm[:, j][good]))
        smoothed = run.residual.balance.kernel.apply(effort[:, None], series.segments, series.period_s)
        before = float(np.std(smoothed[good, 0]))
        if after <= _NO_GAIN * before:
            return None
        text = (
            f"Subtracting model and friction does not reduce the torque of joint '{joint}': in motion the "
            f"residual spreads by {after:.3g} N·m (standard deviation), the measured torque by {before:.3g} N·m."
        )
        if after <= _SHOWS_NEITHER * before:
            return Finding("residual-level", "warning", text, joint=joint)
        text += " Its effort shows neither: nothing is judged by it."
        return Finding("residual-level", "error", text, joint=joint)

    found = by_name(of_joint, [joint for joint in inputs.rule.watch if joint in inputs.laws])
    return [finding for finding in found.values() if finding is not None]


#: Contact lasts longer than one sample where samples are no further apart, s.
_LONGEST_PERIOD_S = 0.01
#: A spike lies so many times the usual from the middle of its neighbours, and so many times as far as they lie apart.
_FAR, _ALONE = 12.0, 4.0
#: Samples, drawn evenly, that tell what is usual.
_DRAWN = 100_000


def spike_findings(series: UniformSeries, collisions: Sequence[Collision]) -> list[Finding]:
    """For each joint, how many of its alarms surround a spike: the filters make an alarm of one that is high enough.

    They make it lower, so an alarm that is higher than its spike has another cause. All stay alarms, for a shock of the
    arm looks like that too.

    Args:
        series: the judged joints.
        collisions: alarms of all of them.
    """
    out: list[Finding] = []
    if series.effort is None or series.period_s > _LONGEST_PERIOD_S:
        return out
    for j, joint in enumerate(series.joint_names):
        own = [c for c in collisions if c.joint == joint]
        if not own:
            continue
        height = spikes(np.ascontiguousarray(series.effort[:, j]))
        first = np.searchsorted(series.time_s, [c.onset_s for c in own])
        last = np.searchsorted(series.time_s, [c.onset_s + c.duration_s for c in own], side="right")
        tops = [float(height[a:b].max(initial=0.0)) for a, b in zip(first, last, strict=True)]
        held = [(c, top) for c, top in zip(own, tops, strict=True) if top > max(c.gamma_nm, abs(c.peak_nm))]
        if held:
            text = (
                f"{len(held)} of {len(own)} alarms of joint '{joint}' surround a single sample of its effort that lies "
                f"{max(top for _, top in held):.3g} N·m off both of its neighbours; the first is at "
                f"{held[0][0].onset_s:.3f} s. A push lasts longer: look for faults of the channel, or for shocks."
            )
            out.append(Finding("effort-spikes", "warning", text, joint=joint, start_s=held[0][0].onset_s))
    return out


def spikes(x: FloatArray) -> FloatArray:
    """(n,) how far each single sample that sticks out lies off the middle of its neighbours; 0 for every other."""
    off = 0.5 * bend_of(x)
    some = off[:: max(1, off.size // _DRAWN)]
    usual = median_of(some[np.isfinite(some)])
    with np.errstate(invalid="ignore"):
        alone = (off > _FAR * usual) & (off > _ALONE * 2.0 * np.abs(np.gradient(x)))
    return np.where(alone, off, 0.0)
