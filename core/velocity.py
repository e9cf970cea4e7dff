"""Which velocity to believe: the logged one, or the derivative of position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.filters import differentiate, low_pass
from collaudit.core.findings import Finding
from collaudit.core.parallel import ordered_map
from collaudit.core.series import FloatArray, Span

_MOVING_RAD_S = 0.02
_DISAGREES = 0.3  # RMS difference as a share of the RMS speed


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Velocities and acceleration of all joints.

    Attributes:
        raw_rad_s: (n, j) velocity as chosen, not filtered.
        velocity_rad_s: (n, j) low-passed.
        acceleration_rad_s2: (n, j) central difference of the low-passed velocity.
        findings: every departure from the log.
    """

    raw_rad_s: FloatArray
    velocity_rad_s: FloatArray
    acceleration_rad_s2: FloatArray
    findings: tuple[Finding, ...]


def choose_velocity(
    position: FloatArray,
    logged: FloatArray | None,
    segments: Sequence[Span],
    period_s: float,
    bandwidth_hz: float,
    joint_names: Sequence[str],
) -> Motion:
    """Take each joint's logged velocity where it is the derivative of its position, else derive it.

    Joint by joint, so that what is needed on the way stays small.

    Args:
        position: (n, j) rad on the uniform grid.
        logged: (n, j) rad/s or None.
        segments: gap-free stretches.
        period_s: sample period, s.
        bandwidth_hz: bandwidth of the low pass, at which the two are compared too, Hz.
        joint_names: j names, for the findings.
    """
    velocity, acceleration = np.empty_like(position), np.empty_like(position)
    changed: dict[int, FloatArray] = {}
    findings: list[Finding] = []

    def one(j: int) -> list[Finding]:
        derived = differentiate(np.ascontiguousarray(position[:, j]), segments, period_s)
        smooth = low_pass(derived, segments, period_s, bandwidth_hz)
        said: list[Finding] = []
        if logged is None:
            changed[j] = derived
        else:
            own = np.ascontiguousarray(logged[:, j])
            compare = low_pass(own, segments, period_s, bandwidth_hz)
            chosen, said = _choose(own, compare, smooth, derived, joint_names[j])
            if chosen is own:
                smooth = compare
            else:
                changed[j] = chosen
                smooth = smooth if chosen is derived else low_pass(chosen, segments, period_s, bandwidth_hz)
        velocity[:, j], acceleration[:, j] = smooth, differentiate(smooth, segments, period_s)
        return said

    for said in ordered_map(one, range(len(joint_names))):
        findings += said
    if logged is None:
        text = "The log has no velocity; it was derived from position for all joints."
        findings = [Finding("log-velocity-derived", "info", text)]
    raw = logged
    if raw is None or changed:  # a departure from the log
        raw = np.empty_like(position) if raw is None else raw.copy()
        for j, column in changed.items():
            raw[:, j] = column
    return Motion(raw, velocity, acceleration, tuple(findings))


def _choose(
    logged: FloatArray, compare: FloatArray, smooth: FloatArray, derived: FloatArray, joint: str
) -> tuple[FloatArray, list[Finding]]:
    def derive(text: str, code: str = "log-velocity-derived") -> tuple[FloatArray, list[Finding]]:
        return derived, [Finding(code, "warning", f"{text}; it was derived from position.", joint=joint)]

    both = np.isfinite(compare + smooth)
    if not both.any():
        return derive(f"Joint '{joint}' has no velocity values")
    moving = both & (np.abs(smooth) > _MOVING_RAD_S)
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
