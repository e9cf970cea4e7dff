"""Which velocity to believe: the logged one, or the derivative of position."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, sqrt
from typing import Literal

import numpy as np

from collaudit.core.data.joint_log import MOVING_RAD_S
from collaudit.core.errors import NotJudgedError
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span, widened
from collaudit.core.numeric.filters import differentiate, low_pass
from collaudit.core.numeric.parallel import ordered_map
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

    def one(j: int) -> tuple[FloatArray | None, Finding | None, Lag | None]:
        own = np.ascontiguousarray(logged[:, j])
        derived = differentiate(np.ascontiguousarray(position[:, j]), segments, period_s)
        holes = np.isfinite(derived) & ~np.isfinite(own)
        missing = not np.isfinite(own).any()
        whole = np.where(holes, derived, own) if holes.any() and not missing else own
        smooth, motion = (low_pass(x, *filters) for x in (derived, whole))
        wrong, few, evidence = _wrong(own, holes, motion, smooth, derived, period_s)
        chosen = whole
        if evidence and source != "logged":
            chosen = np.where(wrong, derived, whole) if few else derived
            motion = low_pass(chosen, *filters) if few else smooth
        told = chosen is not derived and not (evidence and source == "logged")
        lag = velocity_lag(motion, smooth, rows, period_s, MOVING_RAD_S) if told else None
        if source == "position" or (source == "auto" and lag is not None and lag.heavy(period_s)):
            chosen, motion = derived, smooth
        elif source == "auto" and lag is not None and lag.matters(period_s):
            # what a controller has stays as logged: the raw velocity is not touched
            motion = ahead(motion, lag.seconds, segments, period_s)
        velocity[:, j] = motion
        said = _finding(joint_names[j], evidence, few, source, missing) if evidence else None
        return None if chosen is own else chosen, said, lag

    found = list(ordered_map(one, range(len(joint_names))))
    lags = {joint: lag for joint, (_, _, lag) in zip(joint_names, found, strict=True) if lag is not None}
    findings = [said for _, said, _ in found if said is not None] + _late(lags, period_s, source)
    raw = logged
    for j, (chosen, _, _) in enumerate(found):
        if chosen is not None:  # a departure from the log
            raw = logged.copy(order="F") if raw is logged else raw
            raw[:, j] = chosen
    return Motion(raw, velocity, pooled_s(lags.values()), tuple(findings))


def _finding(joint: str, evidence: str, few: bool, source: str, missing: bool) -> Finding:
    """What speaks against a logged velocity, and what was done about it."""
    if source == "logged":
        left = "asks for it: the joint is not judged" if missing else "asks"
        done = f". {'' if missing else 'It was used all the same, as '}[conditioning] velocity {left}."
    else:
        done = f"; {'there it' if few else 'it'} was derived from position."
    return Finding("log-velocity", "warning", f"The logged velocity of joint '{joint}' {evidence}{done}", joint=joint)


def _late(lags: Mapping[str, Lag], period_s: float, source: str) -> list[Finding]:
    """Which velocities are late, by how much, and what is done about it."""
    heavy = {joint: lag for joint, lag in lags.items() if lag.heavy(period_s)}
    light = {joint: lag for joint, lag in lags.items() if lag.matters(period_s) and joint not in heavy}
    done = {
        "logged": "used all the same, as [conditioning] velocity asks",
        "position": "derived from position, as [conditioning] velocity asks",
    }
    findings = []
    for found, auto in ((heavy, "derived from position instead"), (light, "shifted by this lag")):
        named = ", ".join(
            f"'{joint}' {1e3 * lag.seconds:.1f} ms (95 %: {1e3 * lag.ci95[0]:.1f} to {1e3 * lag.ci95[1]:.1f})"
            for joint, lag in found.items()
        )
        text = (
            f"The logged velocity lags behind the positions, as a velocity filtered by the drive does: {named}. "
            f"It was {done.get(source, auto)}."
        )
        if found:
            findings.append(Finding("log-velocity", "warning", text) if found is heavy else fact(text))
    return findings


def _wrong(
    logged: FloatArray, holes: BoolArray, motion: FloatArray, smooth: FloatArray, derived: FloatArray, period_s: float
) -> tuple[BoolArray, bool, str]:
    """Samples (n,) whose logged velocity is not the derivative of position, whether these are few, and what shows it.

    Args:
        logged, derived: (n,) velocity as logged, and of the position; ``holes`` are those that only the latter knows.
        motion, smooth: (n,) both low-passed, without holes.
        period_s: sample period, s.
    """
    known = np.isfinite(motion + smooth)
    moving, count = known & (np.abs(smooth) > MOVING_RAD_S), np.count_nonzero
    if not np.isfinite(logged).any():
        return holes, False, "has no values"
    said = [f"is missing or not a number in {count(holes)} samples"] if holes.any() else []
    way = np.cumsum(smooth[known]) * period_s
    if count(moving) < 10 or np.ptp(way) < _NOWHERE_RAD:  # a way that never leaves a narrow band is none
        return holes, bool(count(holes) <= _FEW * count(known)), " and ".join(said)
    reference, compare = smooth[moving], motion[moving]
    wrong, stuck = holes, moving & (logged == 0.0)
    if np.mean(np.square(compare - reference)) > _DISAGREES**2 * np.mean(np.square(reference)):
        wrong = holes | _far(logged, motion, smooth, derived, moving, period_s)
        fast = np.abs(reference) >= np.median(np.abs(reference))
        gain = float(np.median(compare[fast] / reference[fast]))
        guess = " (degrees per second?)" if abs(gain / 57.29578 - 1.0) < 0.1 else ""
        many = count(wrong & moving) > _FEW * count(moving)
        share = f"is {gain:.3g} times the derivative of its position{guess}, in the median of fast motion"
        said.append(share if many else f"is not the derivative of its position in {count(wrong)} samples")
    elif count(stuck) > _ZEROS:
        least = np.min(np.abs(logged), where=np.isfinite(logged) & (logged != 0.0), initial=np.inf)
        stuck &= np.abs(smooth) > least  # slower than its step, a velocity in counts is zero
        if count(stuck) > _ZEROS:
            wrong = holes | stuck
            said.append(f"is exactly zero in {count(stuck)} samples in which it moves")
    return wrong, bool(count(wrong & moving) <= _FEW * count(moving)), " and ".join(said)


def _far(
    logged: FloatArray, compare: FloatArray, smooth: FloatArray, derived: FloatArray, moving: BoolArray, period_s: float
) -> BoolArray:
    """(n,) samples within :data:`_MARGIN_S` of one whose logged velocity is far from the derivative of position."""
    typical = float(np.median(np.abs(smooth[moving])))
    apart = logged - derived
    far = np.abs(compare - smooth) > _DISAGREES * typical
    far |= np.abs(apart) > _DISAGREES * typical + 8.0 * robust_sd(apart[np.isfinite(apart)])
    return np.asarray(widened(far, max(1, round(_MARGIN_S / period_s))) & np.isfinite(derived))


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


def pooled_s(lags: Iterable[Lag]) -> float | None:
    """Lag of all joints together, s; None where no joint tells one."""
    known = list(lags)
    weight = sum(lag.weight for lag in known)
    return sum(lag.weight * lag.seconds for lag in known) / weight if weight > 0 else None
