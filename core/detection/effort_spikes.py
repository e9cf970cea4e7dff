"""Alarms around a single sample of the effort that lies far off both of its neighbours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.conditioning.measured.calm_stretches import bend_of
from collaudit.core.data.audit_result import Collision
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import median_of

#: Contact lasts longer than one sample where samples are no further apart, s.
_LONGEST_PERIOD_S = 0.01
#: A spike lies so many times the usual from the middle of its neighbours, and so many times as far as they lie apart.
_FAR, _ALONE = 12.0, 4.0
#: Samples, drawn evenly, that tell what is usual.
_DRAWN = 100_000


def spike_findings(series: UniformSeries, collisions: Sequence[Collision]) -> list[Finding]:
    """For each joint, how many of its alarms surround a spike: the filters make an alarm of one that is high enough.

    They stay alarms, for a shock of the arm looks like that too.

    Args:
        series: the judged joints.
        collisions: alarms of all of them.
    """
    out: list[Finding] = []
    if series.effort is None or series.period_s > _LONGEST_PERIOD_S:
        return out
    for j, joint in enumerate(series.joint_names):
        own = [c for c in collisions if c.joint == joint]
        if not own:
            continue
        height = spikes(np.ascontiguousarray(series.effort[:, j]))
        first = np.searchsorted(series.time_s, [c.onset_s for c in own])
        last = np.searchsorted(series.time_s, [c.onset_s + c.duration_s for c in own], side="right")
        tops = [float(height[a:b].max(initial=0.0)) for a, b in zip(first, last, strict=True)]
        held = [(c, top) for c, top in zip(own, tops, strict=True) if top > c.gamma_nm]
        if held:
            text = (
                f"{len(held)} of {len(own)} alarms of joint '{joint}' surround a single sample of its effort that lies "
                f"{max(top for _, top in held):.3g} N·m off both of its neighbours; the first is at "
                f"{held[0][0].onset_s:.3f} s. A push lasts longer: look for faults of the channel, or for shocks."
            )
            out.append(Finding("effort-spikes", "warning", text, joint=joint, start_s=held[0][0].onset_s))
    return out


def spikes(x: FloatArray) -> FloatArray:
    """(n,) how far each single sample that sticks out lies off the middle of its neighbours; 0 for every other."""
    off = 0.5 * bend_of(x)
    some = off[:: max(1, off.size // _DRAWN)]
    usual = median_of(some[np.isfinite(some)])
    with np.errstate(invalid="ignore"):
        alone = (off > _FAR * usual) & (off > _ALONE * 2.0 * np.abs(np.gradient(x)))
    return np.where(alone, off, 0.0)
