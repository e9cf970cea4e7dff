"""What the efforts of a log look like against the model's torque, all joints together, and efforts in coarse steps."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.stats import few_values, weighted_median
from collaudit.core.prepare.effort.delay_estimate import Delay
from collaudit.core.prepare.effort.effort_gain import EffortGain
from collaudit.core.prepare.effort.gain_findings import MOUNTING_FIRST, gains_at
from collaudit.core.prepare.prepared import Prepared

_AS_TORQUE = (0.6, 1.67)
_DOUBLED = (1.75, 2.3)
_ALIKE = 1.6
_MOST = 0.6  # of the load, borne by joints with like gains
_COARSE = 0.5
#: Standard deviation of Gaussian noise over the median of |successive differences|: 1.4826 / sqrt(2).
_SD_PER_MEDIAN_DIFFERENCE = 1.05
#: An effort of more different values has no step.
_MOST_VALUES = 200
_HEARD = 1e-3  # a joint with less of the load than this does not speak of signs


def audit_effort(prepared: Prepared, delay: Delay | None = None) -> list[Finding]:
    """What all joints' efforts together look like, and efforts in coarse steps. Nothing is changed by it.

    Args:
        prepared: the log.
        delay: a delay of the effort that would spoil its gains, to be taken off before they are read.
    """
    return [*_kind(prepared, delay), *_steps(prepared)]


def _kind(prepared: Prepared, delay: Delay | None) -> list[Finding]:
    """One verdict for the log: a single joint's gain may be off because its model is, all together are not."""
    if prepared.rigid_nm is None:
        return []
    gains = prepared.gains
    if delay is not None and prepared.start.table is not None:
        table = prepared.start.table.seen(prepared.series, prepared.rigid_nm, prepared.contact_nm)
        gains = gains_at(table, prepared.series, delay)
    known = [g for g in gains if g.known and g.joint in prepared.judged]
    if not known:
        return []
    weight = np.array([_load(prepared, g) for g in known])
    gain = np.array([g.gain for g in known])
    size = weighted_median(np.log(np.abs(gain)), weight)
    typical = float(np.exp(size))
    heavy = np.abs(np.log(np.abs(gain)) - size) < np.log(_ALIKE)
    alike = float(weight[heavy].sum() / weight.sum())
    heard = weight > _HEARD * weight.sum()
    negative = float(np.mean(gain[heard] < 0))
    numbers = "; ".join(f"{g.joint} {g.gain:.3g} [{g.ci95[0]:.3g}, {g.ci95[1]:.3g}]" for g in known)
    text = _words(known, typical, alike, negative, prepared.series.effort_unit, prepared.upright)
    if delay is not None:
        text = f"After correction of its delay of {1e3 * delay.seconds:.0f} ms: {text[0].lower()}{text[1:]}"
    doubt = prepared.series.effort_unit == "Nm" and not (alike >= _MOST and _AS_TORQUE[0] <= typical < _DOUBLED[0])
    text = f"{text} Effort per N·m of model torque [95 %]: {numbers}."
    return [Finding("effort-kind", "warning" if doubt else "info", text)]


def _words(
    known: Sequence[EffortGain], typical: float, alike: float, negative: float, unit: str, upright: Collection[str]
) -> str:
    signs = "its sign is inverted" if negative == 1.0 else "its signs are mixed" if negative > 0.0 else ""
    flip = ", ".join(f'"{g.joint}" = -1' for g in known if g.gain < 0)
    mend = f" To correct it: [log.units] effort_sign = {{ {flip} }}." if flip else ""
    turned = ", ".join(g.joint for g in known if g.gain < 0 and g.joint in upright)
    mend = f" {turned}: {MOUNTING_FIRST}.{mend.replace('it:', 'a sign that is inverted:')}" if turned else mend
    if alike < _MOST or not _AS_TORQUE[0] <= typical <= _DOUBLED[1]:
        also = f", and {signs}" if signs else ""
        return (
            f"The effort looks like a motor current or another unit, not like N·m{also}{_or_masses(typical, alike)}. "
            "To correct it: [log.units] "
            'effort = "A" with torque_constant_nm_per_a of the manufacturer, '
            f'or [fit] estimate = ["friction", "gain"].{mend}'
        )
    if _DOUBLED[0] <= typical <= _DOUBLED[1]:
        also = f" and {signs}" if signs else ""
        return (
            f"The effort looks like about twice the torque{also}, as when it is counted twice; or the model lacks half "
            f"of what moves.{mend}"
        )
    if signs:
        return f"The effort looks like a torque in N·m, but {signs}.{mend}"
    return "The effort looks like a torque in N·m." if unit == "Nm" else "The effort has the size of a torque in N·m."


def _or_masses(typical: float, alike: float) -> str:
    """All joints by one factor that masses on file can be off by."""
    if alike < _MOST or not 0.3 < typical < 3.0:
        return ""
    return f"; or all masses on file are too {'large' if typical < 1 else 'small'} by the same factor"


def _load(prepared: Prepared, gain: EffortGain) -> float:
    """Variance of the model torque of a joint: how much a joint has to say."""
    assert prepared.rigid_nm is not None
    column: FloatArray = prepared.rigid_nm[:, prepared.series.column(gain.joint)]
    return float(np.nanvar(column)) * gain.explained + 1e-12


def _steps(prepared: Prepared) -> list[Finding]:
    series = prepared.series
    if series.effort is None:
        return []
    found = by_name(lambda joint: _coarse(series, joint), prepared.judged)
    return [finding for finding in found.values() if finding is not None]


def _coarse(series: UniformSeries, joint: str) -> Finding | None:
    """What is to say of a joint whose effort comes in steps."""
    assert series.effort is not None
    j = series.column(joint)
    moving = np.abs(series.velocity_rad_s[:, j]) > MOVING_RAD_S
    effort = series.effort[:, j][moving & np.isfinite(series.effort[:, j])]
    step = _step(effort)
    if step is None:
        return None
    noise = float(np.median(np.abs(np.diff(effort)))) * _SD_PER_MEDIAN_DIFFERENCE
    if not (step > _COARSE * float(np.std(effort)) or (step > 2.0 * noise and np.ptp(effort) < 60 * step)):
        return None
    text = (
        f"The effort of joint '{joint}' comes in steps of {step:.3g}, {np.ptp(effort) / step:.0f} steps from its "
        "smallest to its largest: thresholds of less than a few steps are not reliable."
    )
    return Finding("effort-filtered", "warning", text, joint=joint)


def _step(effort: FloatArray) -> float | None:
    """The step of an effort that takes few different values, else None."""
    values = few_values(effort, min(_MOST_VALUES, effort.size // 5))
    if values is None or values.size < 3:
        return None
    gaps = np.diff(values)
    step = float(np.median(gaps))
    ratio = gaps / step
    return step if np.mean(np.abs(ratio - np.round(ratio)) < 0.02) > 0.95 else None
