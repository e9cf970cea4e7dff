"""Which velocity to believe: the logged one, or the derivative of position."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.filters import differentiate, low_pass
from collaudit.core.findings import Finding
from collaudit.core.series import FloatArray, Span

_MOVING_RAD_S = 0.02
_DISAGREES = 0.3  # RMS difference as a share of the RMS speed


def choose_velocity(
    position: FloatArray,
    logged: FloatArray | None,
    segments: Sequence[Span],
    period_s: float,
    bandwidth_hz: float,
    joint_names: Sequence[str],
) -> tuple[FloatArray, list[Finding]]:
    """Take each joint's logged velocity where it is the derivative of its position, else derive it.

    Args:
        position: (n, j) rad on the uniform grid.
        logged: (n, j) rad/s or None.
        segments: gap-free stretches.
        period_s: sample period, s.
        bandwidth_hz: bandwidth at which the two are compared, Hz.
        joint_names: j names, for the findings.

    Returns:
        (n, j) velocity, and a finding for each departure from the log.
    """
    derived = differentiate(position, segments, period_s)
    if logged is None:
        return derived, [
            Finding(
                "log-velocity-derived",
                "info",
                "The log has no velocity; it was derived from position for all joints.",
            )
        ]
    smooth = low_pass(derived, segments, period_s, bandwidth_hz)
    compare = low_pass(logged, segments, period_s, bandwidth_hz)
    out = logged.copy()
    findings: list[Finding] = []
    a, b, c, d = (np.ascontiguousarray(x.T) for x in (logged, compare, smooth, derived))
    for j, joint in enumerate(joint_names):
        column, finding = _choose(a[j], b[j], c[j], d[j], joint)
        if finding:  # a departure from the log
            out[:, j] = column
        findings += finding
    return out, findings


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
