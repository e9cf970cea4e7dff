"""``gamma_nm = "auto"``: thresholds of the friction file, at the persistence of the log that is judged."""

from __future__ import annotations

import math
from collections.abc import Mapping

from collaudit.core.config.schema import Config
from collaudit.core.config.schema_detect import DEFAULT_PERSISTENCE_MS
from collaudit.core.data.threshold_result import FittedThresholds, JointThreshold, ThresholdLevel
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.detection.rule import persistence_samples
from collaudit.core.findings import Finding
from collaudit.core.prepare.quiet_level import QuietLevel

#: Rounding of a persistence that is stated in ms and counted in samples.
_SLACK = 1e-3
_HOUR_S = 3600.0
#: Events, with 95 % confidence no more, in a time in which none was seen (Poisson).
_NONE_SEEN_95 = -math.log(0.05)
#: Hours of motion from which thresholds are not called little supported.
_MUCH_H = 0.1
_SHOWN = 6


def with_fitted_thresholds(
    config: Config, thresholds: FittedThresholds | None, still: Mapping[str, QuietLevel], series: UniformSeries
) -> tuple[Config, list[Finding]]:
    """The configuration with numbers in place of "auto"; unchanged when it asks for something else.

    A joint without a threshold on file gets none: it is not judged, and an error says so.

    Args:
        config: as given.
        thresholds: of the friction file; None without a file, or of an older one.
        still: joints that are judged for changes of their torque: their thresholds come from this log.
        series: the judged joints.
    """
    if config.detect.gamma_nm != "auto":
        return config, []
    gamma = {joint: level.gamma_nm for joint, level in still.items()}
    findings: list[Finding] = []
    usable, why = usable_thresholds(thresholds, config)
    n, lasting_s = _persistence(config, series.period_s)
    for joint in series.joint_names:
        known = usable.joints.get(joint) if usable is not None else None
        level = level_at(known, n, lasting_s) if known is not None else None
        if level is not None and joint not in still:
            gamma[joint] = level.gamma_nm
    missing = [joint for joint in series.joint_names if joint not in gamma]
    for joint in missing:
        known = usable.joints.get(joint) if usable is not None else None
        reason = why or (known.reason if known is not None else None) or "the friction file has no threshold for it"
        text = f"Joint '{joint}' is not judged: gamma_nm = \"auto\", and {reason}."
        findings.append(Finding("gamma-missing", "error", text, joint=joint))
    fitted = {joint: level for joint, level in gamma.items() if joint not in still}
    if usable is not None and fitted:
        findings.append(_source(usable, fitted, series.joint_names))
        findings += [f for f in isolated_peak_findings(usable) if f.joint in fitted]
        findings += _beyond_drive(usable, fitted)
    detect = config.detect.changed({"gamma_nm": gamma})
    return config.changed({"detect": detect}), findings


def _persistence(config: Config, period_s: float) -> tuple[int, float]:
    """Persistence in samples and in s, as the rule will have it."""
    n = config.detect.n
    if n is None:
        n = persistence_samples((config.detect.persistence_ms or DEFAULT_PERSISTENCE_MS) / 1e3, period_s)
    return n, n * period_s


def usable_thresholds(
    thresholds: FittedThresholds | None, config: Config
) -> tuple[FittedThresholds | None, str | None]:
    """Thresholds that belong to this residual, or why there are none."""
    if thresholds is None:
        return None, "there is no friction file with thresholds (collaudit fit writes them)"
    ours = (config.detect.detector, config.detect.causal)
    if (thresholds.detector, thresholds.causal) != ours:
        return None, (
            f"the thresholds on file belong to {_words(thresholds.detector, thresholds.causal)}, and this residual is "
            f"of {_words(*ours)} (fit again with the same [detect] table)"
        )
    return thresholds, None


def _words(detector: str, causal: bool) -> str:
    return f"the detector '{detector}' ({'causal' if causal else 'offline'})"


def level_at(known: JointThreshold, n: int, lasting_s: float) -> ThresholdLevel | None:
    """The threshold of the longest persistence on file that is no longer than the rule's, in samples and in time.

    A threshold for a shorter persistence is higher, so it is safe for a longer one. A rule that is shorter than
    everything on file, as at a higher sample rate, gets the highest threshold.
    """
    fitting = [x for x in known.levels if x.n <= n and x.persistence_s <= (1.0 + _SLACK) * lasting_s]
    if fitting:
        return min(fitting, key=lambda x: x.gamma_nm)
    return max(known.levels, key=lambda x: x.gamma_nm, default=None)


def _source(thresholds: FittedThresholds, gamma: dict[str, float], order: tuple[str, ...]) -> Finding:
    """The evidence for the thresholds, in one sentence."""
    known = [thresholds.joints[joint] for joint in order if joint in gamma]
    least = min(joint.hours for joint in known)
    held = min(joint.held_out for joint in known)
    in_sample = "" if held > 0.5 else "; for a joint or more the friction law was not held out, so they may be too low"
    listed = ", ".join(f"{joint} {gamma[joint]:.3g}" for joint in order if joint in gamma)
    text = (
        f"Thresholds (N·m) from the friction file's held-out residual: {listed}. They are "
        f"supported by at least {_duration(least)} of motion per joint{in_sample}."
    )
    if 0 < least < _MUCH_H:
        text += (
            f" That is little: so short a time alone cannot exclude up to {_NONE_SEEN_95 / least:.2g} false alarms "
            "per joint and hour (95 %), and the thresholds include a margin for that."
        )
    return Finding("gamma-from-fit", "info", text)


def isolated_peak_findings(thresholds: FittedThresholds) -> list[Finding]:
    """Peaks of the fitted residual that stand alone, with joint, time and size, and what thresholds make of them."""
    out = []
    for joint, known in thresholds.joints.items():
        for counted in (False, True):
            peaks = [peak for peak in known.isolated if peak.counted == counted]
            if not peaks:
                continue
            listed = [f"{p.peak_nm:.3g} N·m at {p.start_s:.1f} to {p.end_s:.1f} s of {p.log}" for p in peaks]
            more = f" and {len(listed) - _SHOWN} more" if len(listed) > _SHOWN else ""
            facts = f"{', '.join(listed[:_SHOWN])}{more}; 80 % of the seconds stay below {peaks[0].usual_nm:.3g} N·m."
            if counted:
                text = (
                    f"The fitted threshold of joint '{joint}' is determined by isolated peaks of the residual: {facts} "
                    "If something was touched there, the threshold is too high, and contact below it goes unseen."
                )
            else:
                text = (
                    f"The fitted threshold of joint '{joint}' does not count isolated peaks of the residual: "
                    f"{facts} They look like contact or a stop. If nothing happened there, motion like it will alarm."
                )
            code = "gamma-peaks-counted" if counted else "gamma-peaks-left-out"
            out.append(Finding(code, "warning", text, joint=joint))
    return out


def _beyond_drive(thresholds: FittedThresholds, gamma: Mapping[str, float]) -> list[Finding]:
    """Thresholds above what the drive of the joint can exert."""
    out = []
    for joint, level in gamma.items():
        rated = thresholds.joints[joint].rated_nm
        if rated is not None and level >= rated:
            text = (
                f"The fitted threshold of joint '{joint}', {level:.3g} N·m, is above what its drive is rated for "
                f"({rated:.3g} N·m): hardly any contact on it can alarm. The fitted residual has errors of this size, "
                "or contact in it."
            )
            out.append(Finding("gamma-beyond-drive", "warning", text, joint=joint))
    return out


def _duration(hours: float) -> str:
    seconds = hours * _HOUR_S
    if seconds < 120.0:
        return f"{seconds:.3g} s"
    return f"{seconds / 60.0:.3g} min" if seconds < 2.0 * _HOUR_S and math.isfinite(seconds) else f"{hours:.3g} h"
