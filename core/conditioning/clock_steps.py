"""A clock that was set while recording, told from lost time: the positions go on as if no time had passed."""

from __future__ import annotations

import numpy as np

from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import median_of

#: A step of the clock is longer than so many sample periods, and than so many seconds.
_PERIODS, _LEAST_S = 20, 0.5
#: Samples on either side that tell the speed; the arm moves by so much in each, rad (m if prismatic).
_SIDE, _MOVES_RAD = 5, 2e-5
#: Share of a usual step by which the step of the positions differs at most.
_ALIKE = 0.5
_MOST = 20
_HOUR_S = 3600.0


def clock_step_findings(time_s: FloatArray, position: FloatArray) -> list[Finding]:
    """Steps of the stamps, forward or back, at which a moving arm goes on by one sample's way.

    Args:
        time_s: (n,) stamps in the order of recording, s.
        position: (n, j) at them, rad (m if prismatic).
    """
    steps = np.diff(time_s)
    known = np.isfinite(steps)
    if not known.any():
        return []
    limit = max(_PERIODS * median_of(np.abs(steps[known])), _LEAST_S)
    findings = []
    with np.errstate(invalid="ignore"):
        places = np.flatnonzero(np.abs(steps) > limit)
    for k in places[(places >= _SIDE) & (places + 1 + _SIDE < time_s.size)][:_MOST].tolist():
        usual = (position[k] - position[k - _SIDE] + position[k + 1 + _SIDE] - position[k + 1]) / (2 * _SIDE)
        off = np.abs(position[k + 1] - position[k] - usual)
        size = float(np.nanmax(np.abs(usual), initial=0.0))
        if size > _MOVES_RAD and float(np.nanmax(off, initial=0.0)) <= _ALIKE * size:
            findings.append(_finding(float(time_s[k]), float(steps[k])))
    return findings


def _finding(at_s: float, by_s: float) -> Finding:
    hours = round(by_s / _HOUR_S)
    cause = "as NTP does"
    if 0 < abs(hours) < 24 and abs(by_s - hours * _HOUR_S) < 1.0:
        cause = "as daylight saving or another time zone does"
    text = (
        f"The clock was set {'forward' if by_s > 0 else 'back'} by {abs(by_s):.7g} s at {at_s:.4g} s, {cause}: the arm "
        "goes on from sample to sample as if no time had passed. That time stands as a gap; no samples were lost in it."
    )
    code = "time-gap" if by_s > 0 else "log-clock"
    return Finding(code, "warning", text, start_s=at_s)
