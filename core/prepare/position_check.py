"""Can positions and time be in their units? Checked against the joint limits and against what an arm can do."""

from __future__ import annotations

import numpy as np

from collaudit.core.config.schema_log import UnitsConfig
from collaudit.core.data.joint_log import UniformSeries
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
#: Axes of robots are shorter, m; a joint that stays within so many times its limit may be calibrated otherwise.
_LONG_M, _TIMES_LIMIT = 50.0, 10.0
#: They are slower, too, m/s.
_FAST_M_S = 20.0
#: Half of the joints are beyond their limits of speed by more than limits are rounded, and one by so many times.
#: At their true rates the real logs of the guide reach 0.26 to 0.9 of a limit on their fastest joint.
_OVER_SPEED, _TIMES_SPEED = 1.2, 2.0
#: Steps of an encoder are small against the way in this time, s.
_WAY_S = 0.05


def position_findings(series: UniformSeries, robot: RobotModel, units: UnitsConfig) -> list[Finding]:
    """Joints whose positions cannot be in the unit they were taken in, or cannot have moved in the time they did.

    Args:
        series: the log; positions in rad (m if prismatic), after conversion from the unit.
        robot: kinds and limits of the joints.
        units: as the log was read. What speaks against one that is stated is a warning and nothing more.
    """
    order = [robot.joint_names.index(name) for name in series.joint_names]
    known = np.asarray(np.isfinite(series.position_rad).any(axis=0))
    turning = [j for j, k in enumerate(order) if known[j] and robot.joint_types[k] == "revolute"]
    sliding = [j for j, k in enumerate(order) if known[j] and robot.joint_types[k] == "prismatic"]
    findings: list[Finding] = []
    if turning and units.position == "deg":
        findings += _too_small(series.position_rad[:, turning])
    elif turning:
        findings += _too_far(series, robot, order, turning, "position" in units.given)
    findings += _too_long(series, robot, order, sliding, units)
    if any(finding.severity == "error" for finding in findings):
        return findings  # a speed that cannot be follows from that
    return findings + _too_fast(series, robot.speed_limits[order], [*turning, *sliding])


def _too_far(
    series: UniformSeries, robot: RobotModel, order: list[int], turning: list[int], stated: bool
) -> list[Finding]:
    """Joints that turn further than radians allow.

    Turns alone prove nothing: a wrist may turn for ever. They are evidence of degrees where the speed is one of
    degrees too, where half of the joints turn like that, or where a joint is many turns past its limits.
    """
    names = series.joint_names
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
        bound = f"its limits are within {limit[j]:.4g}" if limited[j] else "it has no limits"
        seen = f"Joint '{names[j]}' reaches {reach[j]:.4g} rad at up to {speed:.3g} rad/s, and {bound}"
        if degrees:
            findings.append(_suspect(names[j], f"{seen}: degrees?", 'position = "deg"', 'position = "rad"', stated))
        elif limited[j]:
            text = f"{seen}: it kept turning, at a speed that is possible in radians only, and was taken as radians."
            findings.append(Finding("log-unit-suspect", "warning", text, joint=names[j]))
    return findings


def _too_long(
    series: UniformSeries, robot: RobotModel, order: list[int], sliding: list[int], units: UnitsConfig
) -> list[Finding]:
    """Axes that slide further, or faster, than metres allow."""
    findings = []
    for j in sliding:
        reach = float(np.nanmax(np.abs(series.position_rad[:, j])))
        limit = float(np.fmax(*np.abs(robot.position_limits[order[j]])))
        speed = _top_speed(series, j)
        if reach <= (_TIMES_LIMIT * limit if limit > 0 else _LONG_M) and speed <= _FAST_M_S:
            continue
        seen = f"Joint '{series.joint_names[j]}' reaches {reach:.4g} m at up to {speed:.3g} m/s: millimetres?"
        taken, stated = f'length = "{units.length}"', "length" in units.given
        findings.append(_suspect(series.joint_names[j], seen, 'length = "mm"', taken, stated))
    return findings


def _too_fast(series: UniformSeries, limit: FloatArray, moving: list[int]) -> list[Finding]:
    """That half of the joints with a limit of speed are faster, by their positions, and one much: the time is wrong."""
    limited = [j for j in moving if limit[j] > 0]
    times = {j: _top_speed(series, j, _WAY_S) / float(limit[j]) for j in limited}
    beyond = [j for j in limited if times[j] > _OVER_SPEED]
    worst = max(beyond, key=lambda j: times[j], default=None)
    if worst is None or 2 * len(beyond) < len(limited) or times[worst] <= _TIMES_SPEED:
        return []
    text = (
        f"{len(beyond)} of {len(limited)} joints move faster than the description allows, "
        f"'{series.joint_names[worst]}' {times[worst]:.3g} times its {limit[worst]:.4g} rad/s: the time of the log "
        f"passes too slowly, with a sample every {1e3 * series.period_s:.4g} ms. State its unit, [log.units] time, or "
        "the rows per second, [log.csv] rate_hz; if the time is right, correct the limits of the description. Nothing "
        "is judged."
    )
    return [Finding("log-unit-suspect", "error", text)]


def _top_speed(series: UniformSeries, j: int, over_s: float = 0.0) -> float:
    """What the fastest percent of the samples exceeds, rad/s, by the positions so long apart, one sample at least."""
    way = max(1, round(over_s / series.period_s))
    step = max(1, series.position_rad.shape[0] // _MAX_SAMPLES)
    at = np.arange(0, series.position_rad.shape[0] - way, step)
    speed = np.abs(series.position_rad[at + way, j] - series.position_rad[at, j]) / (way * series.period_s)
    speed = speed[np.isfinite(speed)]
    return quantile_of(speed, 0.99) if speed.size else 0.0


def _suspect(joint: str, seen: str, other: str, taken: str, stated: bool) -> Finding:
    """That another unit is likelier than the one taken, both as keys; no veto where that one is stated."""
    text = f"{seen} They were taken as [log.units] states: {taken}."
    if not stated:
        text = f"{seen} Then say so in [log.units]: {other}; if not, {taken}. Nothing was converted, nothing is judged."
    return Finding("log-unit-suspect", "warning" if stated else "error", text, joint=joint)


def _too_small(position: FloatArray) -> list[Finding]:
    """Positions stated in degrees that would be an ordinary motion had they been radians."""
    span = float(np.nanmax(np.nanmax(position, axis=0) - np.nanmin(position, axis=0)))
    if not 0.01 * _DEGREE < span < _TINY_RAD:
        return []
    text = (
        f"No joint moves by more than {span / _DEGREE:.3g} degrees in the whole log as stated; taken as radians it "
        f'would be {span / _DEGREE:.3g} rad. They were taken as degrees, as [log.units] position = "deg" states.'
    )
    return [Finding("log-unit-suspect", "warning", text)]
