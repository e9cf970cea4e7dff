"""An effort that changes its unit or its sign in the middle of a log: gravity's torque then has two gains, not one."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray

#: Samples that are enough to see it.
_MOST_SAMPLES = 4000
#: Either part is at least this long, s, and at least this share of the log.
_LEAST_S, _LEAST_SHARE = 2.0, 0.05
#: Load of either part, root mean square, as a share of the whole log's: less tells no gain.
_LOADED = 0.3
#: Share of either part's effort that its own gain explains; share of the rest that one gain for both leaves.
_EXPLAINED, _LEFT = 0.6, 0.4
#: Gains that differ by more than this factor are no change of friction or load; with a turned sign they are alike
#: within this one.
_FACTOR, _ALIKE = 15.0, 2.0


def switched_efforts(
    series: UniformSeries, model_nm: FloatArray | None, judged: Collection[str]
) -> tuple[Finding, ...]:
    """A finding for each judged joint whose effort changes its unit or sign.

    Args:
        series: all joints of the log.
        model_nm: (n, j) model torque, the tool's commanded force included.
        judged: names of the joints to judge.
    """
    if series.effort is None or model_nm is None:
        return ()
    findings, scaled = [], []
    for joint in judged:
        j = series.column(joint)
        found = _switch(series.time_s, series.effort[:, j], model_nm[:, j])
        if found is None:
            continue
        at, before, after = found
        if before * after > 0:
            scaled.append((at, joint, after / before))
            continue
        text = (
            f"The sign of the effort of joint '{joint}' turns at {at:.4g} s (gain against the model's torque "
            f"{before:.3g}, then {after:.3g}): nothing of this joint can be judged."
        )
        findings.append(Finding("effort-switched", "error", text, joint=joint, start_s=at))
    if scaled:  # a unit is one for all joints, also for those that bear too little to tell it
        at = scaled[0][0]
        listed = ", ".join(f"{joint} {share:.3g} times" for _, joint, share in scaled)
        text = (
            f"From {at:.4g} s on, efforts are many times larger or smaller against the model's torque ({listed}): "
            "their unit was switched while recording. Nothing can be judged."
        )
        findings.append(Finding("effort-switched", "error", text, start_s=at))
    return tuple(findings)


def _switch(time_s: FloatArray, effort: FloatArray, model: FloatArray) -> tuple[float, float, float] | None:
    """Time of the switch and the gains before and after it; None without one."""
    known = np.flatnonzero(np.isfinite(effort) & np.isfinite(model))
    known = known[:: max(1, known.size // _MOST_SAMPLES)]
    if known.size < 50:
        return None
    t, e, m = time_s[known], effort[known], model[known]
    ee, em, mm = (np.cumsum(x) for x in (e * e, e * m, m * m))
    length = max(_LEAST_S, _LEAST_SHARE * float(t[-1] - t[0]))
    inside = np.flatnonzero((t - t[0] >= length) & (t[-1] - t >= length))
    if inside.size == 0 or mm[-1] <= 0 or ee[-1] <= 0:
        return None
    left = _part(ee[inside], em[inside], mm[inside])
    right = _part(ee[-1] - ee[inside], em[-1] - em[inside], mm[-1] - mm[inside])
    whole = ee[-1] - em[-1] ** 2 / mm[-1]
    ratio = right[0] / np.where(left[0] == 0, np.nan, left[0])
    with np.errstate(invalid="ignore"):
        turned = (ratio < -1.0 / _ALIKE) & (ratio > -_ALIKE) & (left[2] + right[2] < _LEFT * whole)
        scaled = (np.abs(ratio) > _FACTOR) | (np.abs(ratio) < 1.0 / _FACTOR)
        load = (mm[inside] / (inside + 1.0), (mm[-1] - mm[inside]) / (known.size - inside - 1.0))
        loaded = np.minimum(*load) > _LOADED**2 * mm[-1] / known.size
        good = loaded & (turned | scaled) & (left[1] > _EXPLAINED) & (right[1] > _EXPLAINED)
    if not good.any():
        return None
    first, second = inside + 1.0, known.size - inside - 1.0
    unlikely = first * np.log(left[2] / first + 1e-12) + second * np.log(right[2] / second + 1e-12)
    best = int(np.argmin(np.where(good, unlikely, np.inf)))
    return float(t[inside[best]]), float(left[0][best]), float(right[0][best])


def _part(ee: FloatArray, em: FloatArray, mm: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Gain, share of the squares that it explains, and squares left, of each way to cut."""
    with np.errstate(invalid="ignore", divide="ignore"):
        gain = np.where(mm > 0, em / mm, 0.0)
        explained = np.where((mm > 0) & (ee > 0), em**2 / (mm * ee), 0.0)
    return gain, explained, np.maximum(ee - gain * em, 0.0)
