"""Residual and threshold of every joint of the real logs, beside what a day's script leaves (part ``levels``)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from changed_logs import cut, fitted, judged, prepared
from plain_script import CUT_HZ, SHARE, Samples, left_over, samples_of, split
from real_log_list import REAL_LOGS, RealLog
from scipy.signal import butter, filtfilt

from collaudit.core import api
from collaudit.core.config import LoadedConfig
from collaudit.core.data.audit_result import Audit
from collaudit.core.data.signals import State
from collaudit.core.errors import CollauditError

#: Fewer common samples of a joint say nothing of a quantile of 99.9 %.
_LEAST, _LEAST_COMMON = 200, 100
#: What the issue asks of the ratios: ours over the script's.
MOST_RMS, MOST_GAMMA = 1.10, 2.5
#: The gap between two parts of one log that filters see as an edge, s.
_EDGE_S = 0.2
Joint = dict[str, float | None]


def measure(asked: Any, known: frozenset[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Both settings of every log; what forbids judging where nothing can be."""
    data, work = asked.data, asked.work
    for log in REAL_LOGS:
        if log.name in known or (asked.logs and log.name not in asked.logs):
            continue
        settings = log.settings(data, work)
        found: dict[str, Any] = {"left_out": log.left_out}
        for setting, of in (("whole", whole), ("split", apart)):
            try:
                found[setting] = of(log, settings, data, work)
            except CollauditError as error:
                found[setting] = {"refused": error.message}
        yield log.name, found


def whole(log: RealLog, settings: LoadedConfig, data: Path, work: Path) -> dict[str, Any]:
    """As users do: ``fit`` of the whole log, ``detect`` of the same, or of another; the script's part is its last."""
    friction = api.fit([log.fitted_files(data, work)], settings)
    audit = api.audit(log.files(data, work), settings, friction)
    model = api.load_robot(settings, audit.signals.joint_names)
    first, rest = split(samples_of(audit.signals, model))
    return compared(audit, rest, left_over(first, rest))


def apart(log: RealLog, settings: LoadedConfig, data: Path, work: Path) -> dict[str, Any]:
    """Both fit on the first part of the log, or on the other log, and are judged on the rest."""
    read = api.open_log(log.files(data, work), settings)
    if log.fitted:
        first, rest = api.open_log(log.fitted_files(data, work), settings), read
    else:
        first, rest = cut(read, 0.0, SHARE), cut(read, SHARE, 1.0 + 1e-9)
    ready = prepared(first, settings)
    friction = fitted([ready], settings)
    audits = [judged(part, settings, friction) for part in (ready, rest)]
    model = api.load_robot(settings, audits[1].signals.joint_names)
    samples = [_inside(samples_of(audit.signals, model), audit) for audit in audits]
    return compared(audits[1], samples[1], left_over(*samples))


def _inside(samples: Samples, audit: Audit) -> Samples:
    """Without the ends, where filters settle."""
    time_s = audit.signals.time_s
    at = time_s[samples.rows]
    return samples.part((at > time_s[0] + _EDGE_S) & (at < time_s[-1] - _EDGE_S))


def compared(audit: Audit, rest: Samples, script_nm: np.ndarray) -> dict[str, Any]:
    """By joint: what the script leaves of all its motion, and both of what of it we judged; gamma in force there."""
    signals, result, joints = audit.signals, audit.result, {}
    residual, state = np.asarray(signals.residual_nm)[rest.rows], np.asarray(signals.state)[rest.rows]
    slow = low_passed(np.asarray(signals.residual_nm), result.log.sample_period_s)[rest.rows]
    gamma = audit.signals.gamma_nm[rest.rows]
    for j, name in enumerate(signals.joint_names):
        moving, script, ours = rest.moving[:, j], np.abs(script_nm[:, j]), np.abs(residual[:, j])
        facts: Joint = {"moving": int(np.count_nonzero(moving)), "audit_rms": result.residual[name].rms_nm}
        if facts["moving"] > _LEAST:
            common = moving & (state[:, j] == State.JUDGED) & np.isfinite(ours)
            facts |= {"judged": float(np.mean(common[moving])), **_level("script", script[moving])}
            facts["gamma"] = float(np.median(gamma[common if common.any() else moving, j]))
            if np.count_nonzero(common) > _LEAST_COMMON:
                facts |= {**_level("common", script[common]), **_level("ours", ours[common])}
                facts["ours_10hz_rms"] = float(np.sqrt(np.mean(slow[common, j] ** 2)))
        joints[name] = facts
    return {
        "joints": joints, "contacts": len(result.contacts), "verdict": result.verdict,
        "seconds": result.log.duration_s, "why": next(iter(result.reasons), "")[:200],
    }  # fmt: skip


def low_passed(residual_nm: np.ndarray, period_s: float) -> np.ndarray:
    """(n, j) as the script filters its torque; gaps bridged by straight lines."""
    b, a = butter(2, min(CUT_HZ * 2 * period_s, 0.9))
    rows, out = np.arange(len(residual_nm)), np.zeros_like(residual_nm)
    for j, values in enumerate(residual_nm.T):
        known = np.isfinite(values)
        if known.any():
            out[:, j] = filtfilt(b, a, np.interp(rows, rows[known], values[known]))
    return out


def _level(of: str, size_nm: np.ndarray) -> Joint:
    return {f"{of}_rms": float(np.sqrt(np.mean(size_nm**2))), f"{of}_p999": float(np.quantile(size_nm, 0.999))}


def ratios(joint: Mapping[str, float | None], setting: str) -> tuple[float | None, ...]:
    """Ours over the script's: RMS, and gamma over its 99.9 % quantile.

    Of the whole log as anyone would compare them: RMS as audit.json has it, the script's over all its motion. Of the
    split, both over the same samples.
    """
    mine, its = ("audit_rms", "script") if setting == "whole" else ("ours_rms", "common")
    rms, other, p999 = (joint.get(key) for key in (mine, f"{its}_rms", f"{its}_p999"))
    over = None if rms is None or not other else rms / other
    gamma = joint.get("gamma")
    known = over is not None and p999 and gamma is not None and np.isfinite(gamma)
    return over, gamma / p999 if known else None


def summary(found: Mapping[str, Any], setting: str, left_out: bool, title: str) -> str:
    """Median and worst of the ratios over all joints of the tuned arms, or of the others; how many exceed the bar."""
    rows = [
        (f"{log} {joint}", *ratios(facts, setting))
        for log, both in found.items()
        if both["left_out"] == left_out
        for joint, facts in both[setting].get("joints", {}).items()
        if facts["moving"] > _LEAST
    ]
    cells = [f"{sum(row[1] is not None for row in rows)} of {len(rows)}"]
    for place, most in ((1, MOST_RMS), (2, MOST_GAMMA)):
        known = sorted((row[place], row[0]) for row in rows if row[place] is not None)
        over = sum(value > most for value, _ in known)
        middle, worst = (np.median([value for value, _ in known]), known[-1]) if known else (np.nan, (np.nan, ""))
        cells += [_n(float(middle)), f"{_n(worst[0])} ({worst[1]})", f"{over} of {len(known)}"]
    return f"| {title} | " + " | ".join(cells) + " |"


def tables(found: Mapping[str, Any], before: Mapping[str, Any]) -> Iterator[tuple[str, list[str]]]:
    """Tables of the page: the summary, then joint by joint."""
    head = [f"| | joints judged | ours/script RMS: median | worst | above {MOST_RMS:g} "
            f"| γ/99.9 %: median | worst | above {MOST_GAMMA:g} |",
            "|---|---|---|---|---|---|---|---|"]  # fmt: skip
    lines = []
    for setting, words in (("whole", "whole log"), ("split", "fitted on one part, judged on the rest")):
        for left_out, arms in ((False, ""), (True, ", arms left out")):
            lines += [summary(old, setting, left_out, f"before: {words}{arms}") for old in (before,) if old]
            lines.append(summary(found, setting, left_out, words + arms))
    yield "levels-summary", head + lines
    for setting in ("whole", "split"):
        yield f"levels-{setting}", list(_by_joint(found, before, setting))


def _by_joint(found: Mapping[str, Any], before: Mapping[str, Any], setting: str) -> Iterator[str]:
    yield (
        "| log, joint | script RMS / 99.9 % | RMS | γ | RMS ratio | γ/99.9 % | judged | γ before | γ/99.9 % before |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    for log, both in found.items():
        its, old = both[setting], before.get(log, {}).get(setting, {}).get("joints", {})
        if "refused" in its:
            yield f"| {log} | refused: {its['refused']} | | | | | | | |"
            continue
        for joint, facts in its["joints"].items():
            if facts["moving"] <= _LEAST:
                continue
            over, sharp = ratios(facts, setting)
            was = old.get(joint, {})
            mine, key = ("audit_rms", "script") if setting == "whole" else ("ours_rms", "common")
            slow = f" ({_n(facts.get('ours_10hz_rms'))})" if mine == "ours_rms" and "ours_10hz_rms" in facts else ""
            bars = ((over, MOST_RMS), (sharp, MOST_GAMMA))
            marks = ["**" if x is not None and x > most else "" for x, most in bars]
            yield (
                f"| {log}, {joint} | {_n(facts.get(key + '_rms'))} / {_n(facts.get(key + '_p999'))} "
                f"| {_n(facts.get(mine))}{slow} | {_n(facts.get('gamma'))} "
                f"| {marks[0]}{_n(over)}{marks[0]} | {marks[1]}{_n(sharp)}{marks[1]} "
                f"| {_percent(facts.get('judged'))} "
                f"| {_n(was.get('gamma'))} | {_n(ratios(was, setting)[1])} |"
            )


def _n(value: float | None) -> str:
    return "–" if value is None or not np.isfinite(value) else f"{value:.{max(3, len(str(int(value))))}g}"


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{100 * value:.0f} %"
