"""Offset of the wrist sensor, and weight and centre of mass of the tool, from static poses.

At rest the sensor reads  force = -s W + b_f,  moment = -s (c x W) + b_t  with W = m g(q) in the sensor's axes and s
the configured sign: linear in m, m c and the six offsets.
"""

from __future__ import annotations

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import Bounds, SensorFacts
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray, run_bounds
from collaudit.core.numeric.stats import STANDARD_ERRORS_95, interval_95
from collaudit.core.prepare.prepared import Prepared

_STILL, _REST_S, _SETTLE_S = 0.003, 0.5, 0.2
_MIN_POSES = 4
_STANDARD_G = 9.80665
#: Least spread of gravity about a third axis of the sensor, m/s², for what hangs on that axis to be known.
_LEAST_SPREAD = 0.1 * _STANDARD_G
_FLAT = (
    "Gravity never leaves a plane of the sensor: poses turned about another axis are missing, and the offset "
    "along the one left out is poorly known."
)


def calibrate_sensor(prepared: Prepared, config: Config) -> SensorFacts | None:
    """Calibrate from all stretches at rest; None without a wrench, its frame, or enough poses."""
    series, frame = prepared.series, config.log.wrench_frame
    if series.wrench is None or frame is None or prepared.robot.bodies is None:
        return None
    poses = _static_poses(series, series.wrench)
    if len(poses) < _MIN_POSES:
        return None
    q = np.array([pose[0] for pose in poses])
    reading = np.array([pose[1] for pose in poses])
    when = np.array([pose[2] for pose in poses])
    gravity = prepared.robot.gravity_in(q, frame)
    spread = np.linalg.svd(gravity - gravity.mean(axis=0), compute_uv=False) / np.sqrt(len(poses))
    if spread[1] < 0.05 * _STANDARD_G:
        return None
    sign = float(config.log.wrench_sign)
    design, target = _equations(gravity, reading, sign)
    scale = _scales(design, target)
    weighted = design / scale[:, None]
    estimate: FloatArray = np.asarray(np.linalg.lstsq(weighted, target / scale, rcond=None)[0], dtype=np.float64)
    rest = target - design @ estimate
    free = max(1, target.size - 10)
    scale = scale * float(np.sqrt(np.sum((rest / scale) ** 2) / free))
    weighted = design / scale[:, None]
    covariance: FloatArray = np.asarray(np.linalg.pinv(weighted.T @ weighted, hermitian=True), dtype=np.float64)
    left = rest.reshape(-1, 6)
    clock = when - when.mean()
    slope = clock @ left / float(clock @ clock)
    slope_sd = np.sqrt(np.sum((left - np.outer(clock, slope)) ** 2, axis=0) / max(1, len(poses) - 2) / (clock @ clock))
    length = float(np.ptp(when))
    ci95 = tuple(map(interval_95, estimate, np.sqrt(np.diag(covariance))))
    known = ci95[0][0] > 0.0
    centre, x, y, z = _centre(estimate, covariance)
    turn, turn_sd = _turn(gravity, reading[:, :3], sign, spread)
    return SensorFacts(
        frame=frame,
        poses=len(poses),
        mass_kg=float(estimate[0]),
        mass_ci95=ci95[0],
        com_m=centre if known else None,
        com_ci95=(x, y, z) if known else None,
        offset=tuple(estimate[4:].tolist()),
        offset_ci95=ci95[4:],
        turn_deg=None if turn is None else tuple(turn.tolist()),
        turn_half_deg=None if turn_sd is None else STANDARD_ERRORS_95 * turn_sd,
        drift=tuple((slope * length).tolist()),
        drift_ci95=tuple(map(interval_95, slope * length, slope_sd * length)),
        missing=(_FLAT,) if spread[2] < _LEAST_SPREAD else (),
    )


def _centre(estimate: FloatArray, covariance: FloatArray) -> tuple[tuple[float, float, float], Bounds, Bounds, Bounds]:
    """Centre of mass, m, and the interval of each coordinate; to first order d(mc/m) = (d(mc) - c dm)/m."""
    mass = float(estimate[0]) if estimate[0] != 0 else np.inf
    centre = estimate[1:4] / mass
    slope = np.column_stack([-centre, np.eye(3)]) / mass
    sd = np.sqrt(np.maximum(np.diag(slope @ covariance[:4, :4] @ slope.T), 0.0))
    x, y, z = map(interval_95, centre, sd)
    return tuple(centre.tolist()), x, y, z


def audit_force_sensor(prepared: Prepared, config: Config, found: SensorFacts | None) -> list[Finding]:
    """What static poses say of the sensor and the tool, or which poses are missing."""
    if prepared.series.wrench is None or config.log.wrench_frame is None:
        return []
    if found is None:
        text = (
            f"The wrist sensor cannot be calibrated from this log: it needs at least {_MIN_POSES} poses at rest of "
            f"{_REST_S} s in which the sensor is turned differently against gravity, about two axes."
        )
        return [Finding("log-wrench", "info", text)]
    parts = [f"tool mass {found.mass_kg:.4g} ± {_half(found.mass_ci95):.2g} kg"]
    if found.com_m is not None and found.com_ci95 is not None:
        centre = ", ".join(f"{c:.4f} ± {_half(b):.2g}" for c, b in zip(found.com_m, found.com_ci95, strict=True))
        parts.append(f"centre of mass [{centre}] m")
    offset = ", ".join(f"{x:.3g} ± {_half(b):.2g}" for x, b in zip(found.offset, found.offset_ci95, strict=True))
    parts.append(f"offset [{offset}] N, N·m")
    if found.turn_deg is not None and found.turn_half_deg is not None:
        turn = ", ".join(f"{x:.2f}" for x in found.turn_deg)
        parts.append(f"sensor turned against its frame by [{turn}] ± {found.turn_half_deg:.2f} degrees")
    use = 'To use it: [log] wrench_bias = "calibrated", and this friction file.'
    text = f"From {found.poses} poses at rest (95 %): {'; '.join(parts)}. {' '.join((*found.missing, use))}"
    findings = [Finding("log-wrench", "info", text)]
    least = [0.5] * 3 + [0.02] * 3
    strong = [
        abs(x) > max(1.5 * _half(b), floor) for x, b, floor in zip(found.drift, found.drift_ci95, least, strict=True)
    ]
    if any(strong):
        size = ", ".join(f"{x:.3g}" for x in found.drift)
        text = f"The zero of the wrist sensor drifts over the log by [{size}] (N, N·m)."
        findings.append(Finding("log-wrench", "warning", text))
    return findings


def _half(bounds: Bounds) -> float:
    return 0.5 * ((bounds[1] or 0.0) - (bounds[0] or 0.0))


def _static_poses(series: UniformSeries, wrench: FloatArray) -> list[tuple[FloatArray, FloatArray, float]]:
    """Position (j,), mean reading (6,) and time of every stretch at rest."""
    with np.errstate(invalid="ignore"):
        still = np.asarray((np.abs(series.velocity_rad_s) < _STILL).all(axis=1))
    settle = round(_SETTLE_S / series.period_s)
    poses = []
    for start, stop in zip(*run_bounds(still), strict=True):
        if (stop - start) * series.period_s < _REST_S:
            continue
        rows = slice(int(start) + settle, int(stop) - settle // 2)
        reading = wrench[rows]
        reading = reading[np.isfinite(reading).all(axis=1)]
        if reading.shape[0] >= 10:
            place = np.nanmean(series.position_rad[rows], axis=0)
            poses.append((place, reading.mean(axis=0), float(series.time_s[rows].mean())))
    return poses


def _equations(gravity: FloatArray, reading: FloatArray, sign: float) -> tuple[FloatArray, FloatArray]:
    """Design (6 n, 10) and target (6 n,), pose by pose."""
    n = gravity.shape[0]
    design = np.zeros((n, 6, 10))
    design[:, :3, 0] = -sign * gravity
    for k, axis in enumerate(np.eye(3)):
        design[:, 3:, 1 + k] = -sign * np.cross(axis, gravity)
    design[:, np.arange(6), 4 + np.arange(6)] = 1.0
    return design.reshape(6 * n, 10), reading.reshape(6 * n)


def _scales(design: FloatArray, target: FloatArray) -> FloatArray:
    """(6 n,) noise of forces and of moments, each from its own residual."""
    rest = (target - design @ np.linalg.lstsq(design, target, rcond=None)[0]).reshape(-1, 6)
    force, moment = (max(float(np.std(part)), 1e-9) for part in (rest[:, :3], rest[:, 3:]))
    return np.tile([force] * 3 + [moment] * 3, rest.shape[0])


def _turn(
    gravity: FloatArray, force: FloatArray, sign: float, spread: FloatArray
) -> tuple[FloatArray | None, float | None]:
    """Rotation vector (degrees) that carries the frame's gravity to the sensor's, by Procrustes (Kabsch 1976)."""
    if spread[2] < _LEAST_SPREAD:
        return None, None
    from scipy.spatial.transform import Rotation

    a, b = gravity - gravity.mean(axis=0), -sign * (force - force.mean(axis=0))
    u, s, vt = np.linalg.svd(b.T @ a)
    turn = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    size = float(s.sum() / np.sum(a**2))
    rest = b - size * a @ turn.T
    sd = float(np.sqrt(np.sum(rest**2) / max(1, rest.size - 7)) / (size * spread[2] * np.sqrt(len(a))))
    return np.degrees(Rotation.from_matrix(turn).as_rotvec()), float(np.degrees(sd))
