"""Which velocity to believe: the logged one, or the derivative of position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, sqrt
from typing import Literal

import numpy as np

from collaudit.core.data.uniform_series import MOVING_RAD_S
from collaudit.core.errors import NotJudgedError
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span
from collaudit.core.numeric.filters import differentiate, low_pass
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.runs import widened
from collaudit.core.numeric.stats import robust_sd

_DISAGREES = 0.3  # RMS difference as a share of the RMS speed
#: A velocity that is wrong in this share of the motion at most is mended there, and derived whole otherwise.
_FEW = 0.1
_MARGIN_S = 0.25
#: A joint that goes no further stands, whatever its noise says, rad (m if prismatic).
_NOWHERE_RAD = 0.002
#: So many samples in motion may be logged as exactly zero.
_ZEROS = 3


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Velocities of all joints.

    Attributes:
        raw_rad_s: (n, j) velocity as chosen, not filtered.
        velocity_rad_s: (n, j) low-passed.
        lag_s: how much later than the derivative of position the logged velocity is, s; None where that is not told.
        findings: every departure from the log.
    """

    raw_rad_s: FloatArray
    velocity_rad_s: FloatArray
    lag_s: float | None
    findings: tuple[Finding, ...]


def choose_velocity(
    position: FloatArray,
    logged: FloatArray | None,
    segments: Sequence[Span],
    period_s: float,
    bandwidth_hz: float,
    joint_names: Sequence[str],
    source: Literal["auto", "logged", "position"] = "auto",
) -> Motion:
    """Take each joint's logged velocity where it is the derivative of its position, and in time, else derive it.

    Joint by joint, so that what is needed on the way stays small.

    Args:
        position: (n, j) rad on the uniform grid.
        logged: (n, j) rad/s or None.
        segments: gap-free stretches.
        period_s: sample period, s.
        bandwidth_hz: bandwidth of the low pass, at which the two are compared too, Hz.
        joint_names: j names, for the findings.
        source: ``logged`` keeps it whatever speaks against it; ``position`` derives it always.

    Raises:
        NotJudgedError: the logged velocity is asked for, and there is none.
    """
    if logged is None and source == "logged":
        raise NotJudgedError(
            'the configuration asks for the logged velocity ([conditioning] velocity = "logged"), and the log has none',
            hint='name its columns or topic under [log], or set [conditioning] velocity = "auto"',
        )
    filters = segments, period_s, bandwidth_hz
    if logged is None:
        derived = differentiate(position, segments, period_s)
        text = "The log has no velocity; it was derived from position for all joints."
        return Motion(derived, low_pass(derived, *filters), None, (Finding("log-velocity", "info", text),))
    rows = lag_rows(*filters)
    velocity = np.empty(position.shape, order="F")
    changed: dict[int, FloatArray] = {}

    def one(j: int) -> tuple[list[Finding], Lag | None]:
        own, said, lag = np.ascontiguousarray(logged[:, j]), list[Finding](), None
        derived = differentiate(np.ascontiguousarray(position[:, j]), segments, period_s)
        whole, about_holes = _without_holes(own, derived, joint_names[j])
        smooth, compare = (low_pass(x, *filters) for x in (derived, whole))
        motion = compare
        chosen, evidence = _choose(whole, compare, smooth, derived, joint_names[j], period_s)
        said += about_holes
        if evidence and source == "logged":
            chosen = whole
            said.append(_kept(joint_names[j], own, evidence))
        elif evidence:
            what = "it was" if chosen is derived else "there it was"
            text = f"{evidence}; {what} derived from position."
            said.append(Finding("log-velocity", "warning", text, joint=joint_names[j]))
        else:
            lag = None if whole is derived else velocity_lag(compare, smooth, rows, period_s, MOVING_RAD_S)
            if source == "position" or (source == "auto" and lag is not None and lag.heavy(period_s)):
                chosen = derived
            elif source == "auto" and lag is not None and lag.matters(period_s):
                # what a controller has stays as logged: the raw velocity is not touched
                motion = ahead(compare, lag.seconds, segments, period_s)
        if chosen is not own:
            changed[j] = chosen
        if chosen is not whole:
            motion = smooth if chosen is derived else low_pass(chosen, *filters)
        velocity[:, j] = motion
        return said, lag

    found = list(ordered_map(one, range(len(joint_names))))
    lags = [lag for _, lag in found]
    findings = [finding for said, _ in found for finding in said] + _late(lags, joint_names, period_s, source)
    raw = logged
    if changed:  # a departure from the log
        raw = logged.copy(order="F")
        for j, column in changed.items():
            raw[:, j] = column
    return Motion(raw, velocity, pooled_s(lags), tuple(findings))


def _without_holes(logged: FloatArray, derived: FloatArray, joint: str) -> tuple[FloatArray, list[Finding]]:
    """A velocity (n,) without holes, from position there, or everywhere where many values are missing.

    One that is missing whole stays so, and so do values that positions do not tell.
    """
    known = np.isfinite(logged)
    missing = np.isfinite(derived) & ~known
    lost, count = np.count_nonzero(missing), np.count_nonzero(known)
    if not lost or not count:
        return logged, []
    few = lost <= _FEW * (lost + count)
    text = (
        f"{lost} of {lost + count} velocity values of joint '{joint}' are missing or not a number; "
        f"{'there it' if few else 'all of it'} was derived from position."
    )
    said = [Finding("log-velocity", "warning", text, joint=joint)]
    return np.where(missing, derived, logged) if few else derived, said


def _late(lags: Sequence[Lag | None], joint_names: Sequence[str], period_s: float, source: str) -> list[Finding]:
    """Which velocities are late, by how much, and what is done about it."""
    late = [(joint, lag) for joint, lag in zip(joint_names, lags, strict=True) if lag is not None]
    heavy = [(joint, lag) for joint, lag in late if lag.heavy(period_s)]
    light = [(joint, lag) for joint, lag in late if lag.matters(period_s) and not lag.heavy(period_s)]
    done = {
        "logged": "used all the same, as [conditioning] velocity asks",
        "position": "derived from position, as [conditioning] velocity asks",
    }
    findings = []
    for found, auto in ((heavy, "derived from position instead"), (light, "shifted by this lag")):
        if not found:
            continue
        named = ", ".join(
            f"'{joint}' {1e3 * lag.seconds:.1f} ms (95 %: {1e3 * lag.ci95[0]:.1f} to {1e3 * lag.ci95[1]:.1f})"
            for joint, lag in found
        )
        text = (
            f"The logged velocity lags behind the positions, as a velocity filtered by the drive does: {named}. "
            f"For {'this joint' if len(found) == 1 else 'these joints'} it was {done.get(source, auto)}."
        )
        findings.append(Finding("log-velocity", "warning", text) if found is heavy else fact(text))
    return findings


def _choose(
    logged: FloatArray, compare: FloatArray, smooth: FloatArray, derived: FloatArray, joint: str, period_s: float
) -> tuple[FloatArray, str]:
    """The logged velocity, its derivative from position, or a mixture where few samples are wrong.

    With what speaks against the logged one, empty where nothing does.
    """
    both = np.isfinite(compare + smooth)
    if not both.any():
        return derived, f"Joint '{joint}' has no velocity values"
    moving = both & (np.abs(smooth) > MOVING_RAD_S)
    way = np.cumsum(smooth[both]) * period_s
    if np.count_nonzero(moving) < 10 or np.ptp(way) < _NOWHERE_RAD:  # a way that never leaves a narrow band is none
        return logged, ""
    zero = moving & (logged == 0.0)
    if np.count_nonzero(zero) == np.count_nonzero(moving):
        return derived, f"The logged velocity of joint '{joint}' is zero while it moves"
    reference = smooth[moving]
    apart = compare[moving]
    apart -= reference
    error = float(np.sqrt(np.mean(np.square(apart, out=apart))))
    speed = float(np.sqrt(np.mean(np.square(reference, out=reference))))
    if error > _DISAGREES * speed:
        wrong = _wrong(logged, compare, smooth, derived, moving, period_s)
        if np.count_nonzero(wrong & moving) <= _FEW * np.count_nonzero(moving):
            evidence = (
                f"The logged velocity of joint '{joint}' is not the derivative of its position in "
                f"{np.count_nonzero(wrong)} of {np.count_nonzero(both)} samples"
            )
            return np.where(wrong, derived, logged), evidence
        reference = smooth[moving]
        gain, off = _typical(compare[moving], reference)
        guess = " (degrees per second?)" if abs(gain / 57.29578 - 1.0) < 0.1 else ""
        evidence = (
            f"The logged velocity of joint '{joint}' is {gain:.3g} times the derivative of its position{guess}, "
            f"median difference {off:.3g} rad/s at a median speed of {np.median(np.abs(reference)):.3g} rad/s"
        )
        return derived, evidence
    if np.count_nonzero(zero) <= _ZEROS:
        return logged, ""
    least = float(np.min(np.abs(logged), where=np.isfinite(logged) & (logged != 0.0), initial=np.inf))
    stuck = zero & (np.abs(smooth) > least)  # slower than its step, a velocity in counts is zero
    if np.count_nonzero(stuck) <= _ZEROS:
        return logged, ""
    evidence = (
        f"The logged velocity of joint '{joint}' is exactly zero in {np.count_nonzero(stuck)} samples in which it moves"
    )
    return np.where(stuck, derived, logged), evidence


def _wrong(
    logged: FloatArray, compare: FloatArray, smooth: FloatArray, derived: FloatArray, moving: BoolArray, period_s: float
) -> BoolArray:
    """(n,) samples within :data:`_MARGIN_S` of one whose logged velocity is far from the derivative of position."""
    typical = float(np.median(np.abs(smooth[moving])))
    both = np.isfinite(logged + derived)
    noise = robust_sd((logged - derived)[both])
    far = np.isfinite(compare + smooth) & (np.abs(compare - smooth) > _DISAGREES * typical)
    far |= both & (np.abs(logged - derived) > _DISAGREES * typical + 8.0 * noise)
    return np.asarray(widened(far, max(1, round(_MARGIN_S / period_s))) & np.isfinite(derived))


def _typical(said: FloatArray, reference: FloatArray) -> tuple[float, float]:
    """Median ratio of two velocities where the second is fast, and their median difference."""
    fast = np.abs(reference) >= np.median(np.abs(reference))
    return float(np.median(said[fast] / reference[fast])), float(np.median(np.abs(said - reference)))


def _kept(joint: str, logged: FloatArray, evidence: str) -> Finding:
    """What speaks against a velocity that the configuration asks for, as a warning."""
    if np.isfinite(logged).any():
        text = f"{evidence}. It was used all the same, as [conditioning] velocity asks."
    else:
        text = f"{evidence}. [conditioning] velocity asks for it: the joint is not judged."
    return Finding("log-velocity", "warning", text, joint=joint)


#: Fewer samples than this are nothing; a lag of 2.7 ms left alone doubles the residual of fast joints.
SAMPLES = 0.25
#: A velocity that is later than this was filtered so heavily that moving it ahead does not bring it back.
_HEAVY_S = 0.005
_BLOCKS = 20
_STUDENT = 2.093  # of 19 degrees of freedom, 95 %
_MIN_BLOCKS = 4.0  # that carry the knowledge


@dataclass(frozen=True, slots=True)
class Lag:
    """How late one joint's logged velocity is.

    Attributes:
        seconds: to first order; negative when it is early.
        ci95: its interval, s.
        weight: what the joint's motion tells, (rad/s²)²: a mean over joints is weighted by it.
    """

    seconds: float
    ci95: tuple[float, float]
    weight: float

    def matters(self, period_s: float) -> bool:
        """Whether the velocity is late for certain, and by enough to show in a residual."""
        return self.ci95[0] > 0 and self.seconds >= SAMPLES * period_s

    def heavy(self, period_s: float) -> bool:
        """Whether the velocity is so late that the derivative of position is the better one."""
        return self.matters(period_s) and self.seconds >= _HEAVY_S


def lag_rows(segments: Sequence[Span], period_s: float, bandwidth_hz: float) -> IntArray:
    """Samples to compare at: four in a period of the filter, none where it settles at the ends of a stretch."""
    step = max(1, int(0.25 / (bandwidth_hz * period_s)))
    margin = ceil(0.5 / (bandwidth_hz * period_s)) + 1
    parts = [np.arange(span.start + margin, span.stop - margin, step, dtype=np.int64) for span in segments]
    return np.concatenate(parts) if parts else np.zeros(0, dtype=np.int64)


def velocity_lag(
    logged: FloatArray, derived: FloatArray, rows: IntArray, period_s: float, slowest: float
) -> Lag | None:
    """Regress what the logged velocity lacks on the acceleration: v(t - lag) = v - lag·a, in blocks of time.

    Args:
        logged: (n,) logged velocity, low-passed.
        derived: (n,) derivative of position, low-passed alike.
        rows: from :func:`lag_rows`.
        period_s: sample period, s.
        slowest: slower motion is left out.

    Returns:
        The lag with an interval from the scatter between blocks; None with too little motion.
    """
    v = derived[rows]
    a = (derived[rows + 1] - derived[rows - 1]) / (2.0 * period_s)
    behind = v - logged[rows]
    use = np.isfinite(behind + a) & (np.abs(v) > slowest)
    if np.count_nonzero(use) < 2 * _BLOCKS:
        return None
    behind, a = behind[use], a[use]
    starts = np.arange(_BLOCKS) * a.size // _BLOCKS
    power = np.add.reduceat(a * a, starts)
    weight = float(power.sum())
    if weight <= 0 or weight**2 < _MIN_BLOCKS * float(power @ power):
        return None
    product = np.add.reduceat(behind * a, starts)
    lag = float(product.sum()) / weight
    scatter = float(np.sum((product - lag * power) ** 2)) * _BLOCKS / (_BLOCKS - 1)
    half = _STUDENT * sqrt(scatter) / weight
    return Lag(lag, (lag - half, lag + half), weight)


def ahead(velocity: FloatArray, lag_s: float, segments: Sequence[Span], period_s: float) -> FloatArray:
    """(n,) a velocity moved ahead by its lag, straight between samples; the last value holds at a stretch's end."""
    out = np.full_like(velocity, np.nan)
    for span in segments:
        at = np.arange(len(span), dtype=np.float64)
        out[span.slice] = np.interp(at + lag_s / period_s, at, velocity[span.slice])
    return out


def pooled_s(lags: Sequence[Lag | None]) -> float | None:
    """Lag of all joints together, s; None where no joint tells one."""
    known = [lag for lag in lags if lag is not None]
    weight = sum(lag.weight for lag in known)
    return sum(lag.weight * lag.seconds for lag in known) / weight if weight > 0 else None
