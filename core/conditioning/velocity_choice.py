"""Which velocity to believe: the logged one, or the derivative of position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from collaudit.core.conditioning.velocity_lag import Lag, lag_rows, pooled_s, velocity_lag
from collaudit.core.data.uniform_series import MOVING_RAD_S
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray, Span
from collaudit.core.numeric.filters import differentiate, low_pass
from collaudit.core.numeric.parallel import ordered_map

_DISAGREES = 0.3  # RMS difference as a share of the RMS speed


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Velocities and acceleration of all joints.

    Attributes:
        raw_rad_s: (n, j) velocity as chosen, not filtered.
        velocity_rad_s: (n, j) low-passed.
        acceleration_rad_s2: (n, j) central difference of the low-passed velocity.
        lag_s: how much later than the derivative of position the logged velocity is, s; None where that is not told.
        findings: every departure from the log.
    """

    raw_rad_s: FloatArray
    velocity_rad_s: FloatArray
    acceleration_rad_s2: FloatArray
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
        source: ``logged`` keeps a velocity that is merely late; ``position`` derives it always.
    """
    rows = lag_rows(segments, period_s, bandwidth_hz)
    velocity, acceleration = (np.empty(position.shape, order="F") for _ in range(2))
    changed: dict[int, FloatArray] = {}
    findings: list[Finding] = []

    def one(j: int) -> tuple[list[Finding], Lag | None]:
        said: list[Finding] = []
        lag = None
        derived = differentiate(np.ascontiguousarray(position[:, j]), segments, period_s)
        if logged is None:
            changed[j] = derived
            low_pass(derived, segments, period_s, bandwidth_hz, velocity[:, j])
        else:
            smooth = low_pass(derived, segments, period_s, bandwidth_hz)
            own = np.ascontiguousarray(logged[:, j])
            compare = low_pass(own, segments, period_s, bandwidth_hz, velocity[:, j])
            chosen, said = _choose(own, compare, smooth, derived, joint_names[j])
            if chosen is own:
                lag = velocity_lag(compare, smooth, rows, period_s, MOVING_RAD_S)
                late = lag is not None and lag.matters(period_s)
                chosen = derived if source == "position" or (late and source == "auto") else own
            if chosen is not own:
                changed[j] = chosen
                if chosen is derived:
                    velocity[:, j] = smooth
                else:
                    low_pass(chosen, segments, period_s, bandwidth_hz, velocity[:, j])
        differentiate(velocity[:, j], segments, period_s, acceleration[:, j])
        return said, lag

    lags: list[Lag | None] = []
    for said, lag in ordered_map(one, range(len(joint_names))):
        findings += said
        lags.append(lag)
    findings += _late(lags, joint_names, period_s, source)
    if logged is None:
        text = "The log has no velocity; it was derived from position for all joints."
        findings = [Finding("log-velocity-derived", "info", text)]
    raw = logged
    if raw is None or changed:  # a departure from the log
        raw = np.empty_like(position) if raw is None else raw.copy()
        for j, column in changed.items():
            raw[:, j] = column
    return Motion(raw, velocity, acceleration, pooled_s(lags), tuple(findings))


def _late(lags: Sequence[Lag | None], joint_names: Sequence[str], period_s: float, source: str) -> list[Finding]:
    """Which velocities are late, by how much, and what is done about it."""
    late = [
        f"'{joint}' {1e3 * lag.seconds:.1f} ms (95 %: {1e3 * lag.ci95[0]:.1f} to {1e3 * lag.ci95[1]:.1f})"
        for joint, lag in zip(joint_names, lags, strict=True)
        if lag is not None and lag.matters(period_s)
    ]
    if not late:
        return []
    kept = source == "logged"
    done = "used all the same, as [conditioning] velocity asks" if kept else "derived from position instead"
    text = (
        "The logged velocity is behind the positions, as one that the drive filters is: "
        f"{', '.join(late)}. Of {'this joint' if len(late) == 1 else 'these joints'} it was {done}."
    )
    return [Finding("log-velocity-late", "warning", text)]


def _choose(
    logged: FloatArray, compare: FloatArray, smooth: FloatArray, derived: FloatArray, joint: str
) -> tuple[FloatArray, list[Finding]]:
    def derive(text: str, code: str = "log-velocity-derived") -> tuple[FloatArray, list[Finding]]:
        return derived, [Finding(code, "warning", f"{text}; it was derived from position.", joint=joint)]

    both = np.isfinite(compare + smooth)
    if not both.any():
        return derive(f"Joint '{joint}' has no velocity values")
    moving = both & (np.abs(smooth) > MOVING_RAD_S)
    if np.count_nonzero(moving) < 10:
        return logged, []
    if np.all(logged[moving] == 0.0):
        return derive(f"The logged velocity of joint '{joint}' is zero while it moves")
    said, meant = compare[moving], smooth[moving]
    speed = float(np.sqrt(np.mean(meant**2)))
    error = float(np.sqrt(np.mean((said - meant) ** 2)))
    if error > _DISAGREES * speed:
        gain = float(said @ meant / (meant @ meant))
        degrees = abs(gain / 57.29578 - 1.0) < 0.1
        guess = " (degrees per second?)" if degrees else ""
        return derive(
            f"The logged velocity of joint '{joint}' is {gain:.3g} times the derivative of its position{guess}, "
            f"RMS difference {error:.3g} rad/s at an RMS speed of {speed:.3g} rad/s",
            "log-velocity-disagrees",
        )
    stuck = moving & (logged == 0.0)
    if np.count_nonzero(stuck) > 3:
        out = np.where(stuck, derived, logged)
        return out, [
            Finding(
                "log-velocity-derived",
                "warning",
                f"The logged velocity of joint '{joint}' is exactly zero in {np.count_nonzero(stuck)} samples in "
                "which it moves; there it was derived from position.",
                joint=joint,
            )
        ]
    return logged, []
