"""What the residual takes off besides friction over speed: the load on the gear, and ripple over position."""

from __future__ import annotations

import numpy as np

from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.gear.correction_fit import ripple_torque
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.kernel import Kernel
from collaudit.core.numeric.stats import median_of, robust_sd
from collaudit.core.prepare.prepared import Prepared

#: A residual beyond so many robust standard deviations may be a contact: it counts as this much of the ripple's check.
_CLIP = 3.0
_FEWEST_SAMPLES = 100
#: Share of its calibrated size above which the ripple of a log confirms the file's.
_CONFIRMED = 0.5


def carried_load(prepared: Prepared, joint: str, law: FrictionModel) -> FloatArray | None:
    """(n,) size of the torque on the gear, N·m; None where the law does not go with it."""
    if law.load is None or prepared.rigid_nm is None:
        return None
    j = prepared.series.column(joint)
    torque = prepared.rigid_nm[:, j]
    if prepared.contact_nm is not None:
        torque = torque + prepared.contact_nm[:, j]
    return np.asarray(np.abs(torque))


def known_ripple(
    series: UniformSeries,
    j: int,
    velocity: FloatArray,
    law: FrictionModel,
    kernel: Kernel,
    left_nm: FloatArray,
    usable: BoolArray,
) -> tuple[FloatArray | float, float]:
    """Ripple of one joint through the kernel, and what it may be wrong by, N·m.

    A joint that was opened, or counts from another zero, has its ripple elsewhere. The file's is therefore taken off
    only where this log has it at its place: where the residual's projection on it is more than half of it. Where it
    is not, nothing is taken off, and the threshold carries the whole amplitude.

    Args:
        series: where the joint was.
        j: its column.
        velocity: (n,) of the joint.
        law: with what is known of its ripple.
        kernel: that the residual has passed.
        left_nm: (n,) residual with the ripple in it.
        usable: (n,) samples at which that is known.

    Returns:
        (n,) torque, or 0, and a half width of 95 %.
    """
    if not law.ripple:
        return 0.0, 0.0
    wave = ripple_torque(law.ripple, series.position_rad[:, j], velocity)
    wave = kernel.apply(wave[:, None], series.segments, series.period_s)[:, 0]
    amplitude = sum(float(np.hypot(*w.same_nm) + np.hypot(*w.against_nm)) for w in law.ripple)
    rows = usable & np.isfinite(left_nm) & np.isfinite(wave)
    if np.count_nonzero(rows) < _FEWEST_SAMPLES:
        return 0.0, amplitude
    w, left = wave[rows], left_nm[rows] - median_of(left_nm[rows])
    bound = _CLIP * robust_sd(left)
    power = float(w @ w)
    if power <= 0.0 or float(w @ np.clip(left, -bound, bound)) < _CONFIRMED * power:
        return 0.0, amplitude
    return np.nan_to_num(wave), 2.0 * float(np.sqrt(sum(x.sd_nm**2 for x in law.ripple)))
