"""Memory garbage in a log: stamps and values that no recording of an arm can hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from collaudit.core.data.joint_log import JointLog, WrenchSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, frozen

#: A stamp so far from the middle of the log, s (12 days), and so many times the usual distance, is garbage where few
#: are: a recording with a long break has many on both sides.
_FAR_S, _FAR_TIMES, _FEW = 1e6, 1e3, 0.1
_SURELY_NEAR_NS = int(0.9 * _FAR_S * 1e9)
#: No arm's values are larger, whatever their unit: rad or m (encoder counts too), rad/s, effort, N or N·m.
_LARGEST = 1e9
_WORDS = {"position_rad": "position", "velocity_rad_s": "velocity", "effort": "effort"}


def garbage_stamps(time_s: FloatArray) -> BoolArray:
    """(n,) stamps that are no times of this recording; those that are not numbers are not among them.

    Args:
        time_s: (n,) s from any origin, in any order.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        known = np.isfinite(time_s)
        times = time_s[known]
        if not times.size or float(times.max() / 2 - times.min() / 2) < _FAR_S / 2:
            return np.zeros(time_s.shape, dtype=np.bool_)
        middle = float(np.median(times))
        distance = np.abs(time_s - middle)
        usual = float(np.median(distance[known]))
        far = known & (distance > max(_FAR_S, _FAR_TIMES * usual))
    few = np.count_nonzero(far) <= _FEW * np.count_nonzero(known)
    return np.asarray(far if few else np.zeros_like(far))


def garbage_ns(stamps_ns: IntArray) -> BoolArray | None:
    """As :func:`garbage_stamps` of seconds; None where there is no garbage, which the ends of a recording tell."""
    if not stamps_ns.size or int(stamps_ns.max()) - int(stamps_ns.min()) < _SURELY_NEAR_NS:
        return None
    far = garbage_stamps(stamps_ns / 1e9)
    return far if far.any() else None


def plausible_ns(stamps_ns: IntArray, where: str) -> tuple[IntArray, list[Finding]]:
    """The stamps, ns, without garbage, and a finding where there is some."""
    far = garbage_ns(stamps_ns)
    return (stamps_ns, []) if far is None else (stamps_ns[~far], garbage_findings(far, "message", where))


def garbage_findings(far: BoolArray | None, what: str, where: str) -> list[Finding]:
    """A finding for the stamps that are garbage, if any are.

    Args:
        far: (n,) which of them are; None where none is.
        what: "row" or "message".
        where: the file or topic.
    """
    if far is None or not far.any():
        return []
    text = (
        f"{np.count_nonzero(far)} of {far.size} stamps are no times of this recording; these {what}s were left out. "
        f"The first is {what} {int(np.argmax(far)) + 1}."
    )
    return [Finding("log-nan", "warning", text, where=where)]


def without_impossible(log: JointLog, what: str) -> JointLog:
    """The log without rows whose stamp is infinite, and with values that no arm can have as missing ones.

    Args:
        log: as read.
        what: "row" or "message", as the findings count.
    """
    findings: list[Finding] = []
    changed: dict[str, FloatArray] = {}
    far = np.isinf(log.time_s)
    for name, word in _WORDS.items():
        values: FloatArray | None = getattr(log, name)
        if values is None or (bad := _beyond(values)) is None:
            continue
        bad &= ~far[:, None]  # of rows that are left out anyway nothing is said
        for j in np.flatnonzero(bad.any(axis=0)).tolist():
            joint = log.joint_names[j]
            findings.append(_finding(bad[:, [j]], values[:, [j]], f"{word} of joint '{joint}'", what, joint))
        changed[name] = _missing(values, bad)
    wrench = log.wrench
    if wrench is not None and (bad := _beyond(wrench.wrench)) is not None:
        findings.append(_finding(bad, wrench.wrench, f"wrench of {wrench.topic}", what))
        wrench = WrenchSeries(wrench.time_s, _missing(wrench.wrench, bad), wrench.topic)
    if findings:
        log = replace(log, wrench=wrench, findings=(*log.findings, *findings), **changed)  # type: ignore[arg-type]
    return _without_rows(log, far) if far.any() else log


def _without_rows(log: JointLog, far: BoolArray) -> JointLog:
    wrench = log.wrench
    if wrench is not None:
        keep = ~np.isinf(wrench.time_s)
        wrench = WrenchSeries(frozen(wrench.time_s[keep]), frozen(wrench.wrench[keep]), wrench.topic)
    return replace(log.samples(~far), wrench=wrench)


def _beyond(values: FloatArray) -> BoolArray | None:
    """Which of the numbers (n, c) no arm can have; None where there are none."""
    if not any(bool((np.abs(column) > _LARGEST).any()) for column in values.T):
        return None
    bad: BoolArray = (np.abs(values) > _LARGEST) & np.isfinite(values)
    return bad if bad.any() else None


def _missing(values: FloatArray, bad: BoolArray) -> FloatArray:
    out = values.copy(order="K")
    out[bad] = np.nan
    return frozen(out)


def _finding(bad: BoolArray, values: FloatArray, signal: str, what: str, joint: str | None = None) -> Finding:
    rows = np.flatnonzero(bad.any(axis=1))
    text = (
        f"{rows.size} values of the {signal} are beyond what an arm can have and count as missing; the "
        f"first is {values[bad][0]:.3g} in {what} {rows[0] + 1}."
    )
    return Finding("log-nan", "warning", text, joint=joint)
