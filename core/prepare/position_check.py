"""Do positions look like radians? Checked against the joint limits and against what an arm can do."""

from __future__ import annotations

import numpy as np

from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import quantile_of
from collaudit.core.robot.robot_model import RobotModel

#: Most joints stay within two turns either way from their zero; degrees pass this at once.
_TWO_TURNS_RAD = 4.0 * np.pi
#: Beyond a joint limit by this much is no calibration error, rad. (Passing a limit within two turns tells nothing: the
#: UR3's last wrist turns on past its URDF's.)
_BEYOND_LIMIT_RAD = 1.0
#: A joint with limits that turns on past them, as wrists do, does so by few turns.
_MOST_PAST_LIMIT_RAD = 10.0 * np.pi
#: Joints of arms are slower; 30 degrees a second taken for radians are not. For the fastest percent of the samples.
_FAST_RAD_S = 10.0
#: Moves of less than this on every joint, while efforts say otherwise, look like degrees taken for radians twice.
_TINY_RAD = 0.06
_DEGREE = np.pi / 180.0
_MAX_SAMPLES = 20_000


def position_findings(series: UniformSeries, robot: RobotModel, unit: str, stated: bool) -> list[Finding]:
    """Joints whose positions cannot be radians, or cannot have been degrees.

    Turns alone prove nothing: a wrist may turn for ever. They are evidence of degrees where the speed is one of
    degrees too, where half of the joints turn like that, or where a joint is many turns past its limits.

    Args:
        series: the log; positions in rad (m if prismatic), after conversion from the unit.
        robot: kinds and limits of the joints.
        unit: of the positions as logged, ``rad`` or ``deg``.
        stated: whether the configuration says so; what speaks against it is then a warning and nothing more.
    """
    names = series.joint_names
    order = [robot.joint_names.index(name) for name in names]
    known = np.asarray(np.isfinite(series.position_rad).any(axis=0))
    turning = [j for j, k in enumerate(order) if known[j] and robot.joint_types[k] == "revolute"]
    if not turning:
        return []
    if unit == "deg":
        return _too_small(series.position_rad[:, turning], stated)
    limit = np.fmax(*np.abs(robot.position_limits[order]).T)  # no number where there is none
    limit[limit > _MOST_PAST_LIMIT_RAD] = np.nan  # nor where it is one in degrees
    low, high = (f(series.position_rad, axis=0, initial=0.0) for f in (np.nanmin, np.nanmax))  # no table beside it
    reach = np.maximum(high, -low)
    beyond = [j for j in turning if reach[j] > max(_TWO_TURNS_RAD, np.nan_to_num(limit[j]) + _BEYOND_LIMIT_RAD)]
    if not beyond:
        return []
    most = len(beyond) >= 2 and 2 * len(beyond) >= len(turning)
    limited = np.isfinite(limit)
    alone = len(turning) == 1 and limited[beyond[0]]
    findings = []
    for j in beyond:
        speed = _top_speed(series, j)
        far = limited[j] and reach[j] > _MOST_PAST_LIMIT_RAD
        degrees = most or alone or far or speed > _FAST_RAD_S
        if degrees or limited[j]:
            bound = f"its limits are within {limit[j]:.4g}" if limited[j] else "it has no limits"
            seen = f"Joint '{names[j]}' reaches {reach[j]:.4g} rad at up to {speed:.3g} rad/s, and {bound}"
            findings.append(_beyond(names[j], seen, degrees, stated))
    return findings


def _top_speed(series: UniformSeries, j: int) -> float:
    """What the fastest percent of the samples exceeds, rad/s, by the positions."""
    step = max(1, series.position_rad.shape[0] // _MAX_SAMPLES)
    at = np.arange(0, series.position_rad.shape[0] - 1, step)
    speed = np.abs(series.position_rad[at + 1, j] - series.position_rad[at, j]) / series.period_s
    speed = speed[np.isfinite(speed)]
    return quantile_of(speed, 0.99) if speed.size else 0.0


def _beyond(joint: str, seen: str, degrees: bool, stated: bool) -> Finding:
    if stated and degrees:
        text = f'{seen}: degrees? They were taken as radians, as [log.units] position = "rad" states.'
    elif degrees:
        text = (
            f'{seen}: degrees? Then say so in [log.units]: position = "deg"; if they are radians, position = "rad". '
            "Nothing was converted, and nothing is judged."
        )
    else:
        text = f"{seen}: it kept turning, at a speed that is possible in radians only, and was taken as radians."
    return Finding("log-unit-suspect", "error" if degrees and not stated else "warning", text, joint=joint)


def _too_small(position: FloatArray, stated: bool) -> list[Finding]:
    """Positions in degrees that would be an ordinary motion had they been radians."""
    span = float(np.nanmax(np.nanmax(position, axis=0) - np.nanmin(position, axis=0)))
    if not 0.01 * _DEGREE < span < _TINY_RAD:
        return []
    seen = (
        f"No joint moves by more than {span / _DEGREE:.3g} degrees in the whole log as stated; taken as radians it "
        f"would be {span / _DEGREE:.3g} rad."
    )
    if stated:
        text = f'{seen} They were taken as degrees, as [log.units] position = "deg" states.'
        return [Finding("log-unit-suspect", "warning", text)]
    text = f'{seen} If they are radians, say so in [log.units]: position = "rad". Nothing is judged.'
    return [Finding("log-unit-suspect", "error", text)]
