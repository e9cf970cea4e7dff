"""Series over nights of what is followed of each joint, from the records of one robot's logs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from typing import Literal, assert_never

import numpy as np

from collaudit.core.history.log_record import JointRecord, LogRecord
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95

Quantity = Literal["friction", "load", "offset", "residual", "margin"]
#: What is tested for changes, and what it is: unit and words.
TESTED: dict[Quantity, tuple[str, str]] = {
    "friction": ("N·m", "friction"),
    "load": ("share", "rigid-body torque beyond the model, as a share of it"),
    "offset": ("N·m", "constant torque beyond the model"),
    "residual": ("N·m", "mean clean residual"),
}
#: Logs that scatter by this much more than their own errors say tell the error of a night; fewer take their own.
_LOGS_FOR_SCATTER = 3


@dataclass(frozen=True, slots=True, eq=False)
class NightSeries:
    """One quantity of one joint over nights.

    Attributes:
        quantity: what it is.
        nights: (n,) ISO dates, rising.
        value, se: (n,) mean of the night's logs, weighted, and its standard error (0 where it has none).
        temperature_c: (n,) of the joint, NaN where not known.
        basis: (n,) hash of the friction file that a night was judged with, or ``own`` for fits on the logs themselves.
        basis_se: (n,) standard error that all nights of one basis share: of the friction file's curve.
        left_out: nights that could not be used, and why.
    """

    quantity: Quantity
    nights: tuple[str, ...]
    value: FloatArray
    se: FloatArray
    temperature_c: FloatArray
    basis: tuple[str, ...]
    basis_se: FloatArray
    left_out: tuple[str, ...] = ()

    @property
    def days(self) -> FloatArray:
        """(n,) days from the first night."""
        every = [date.fromisoformat(night).toordinal() for night in self.nights]
        return np.array(every, dtype=np.float64) - (every[0] if every else 0)


@dataclass(frozen=True, slots=True)
class Reading:
    """One quantity of a joint in one log, or over the logs of a night; fields are those of :class:`NightSeries`."""

    night: str
    value: float
    se: float
    temperature_c: float | None
    basis: str
    basis_se: float


def joint_series(records: Sequence[LogRecord], joint: str, quantity: Quantity) -> NightSeries:
    """One quantity of one joint of one robot.

    Args:
        records: of the robot's logs.
        joint: its name.
        quantity: of :data:`TESTED`, or the margin of gamma.
    """
    speed, others = _speed(records, joint)
    readings = []
    for record in records:
        for item in record.joints:
            if item.joint == joint and (read := reading_of(record, item, quantity, speed)) is not None:
                readings.append(read)
    nights = sorted({reading.night for reading in readings})
    rows = [_night([r for r in readings if r.night == night]) for night in nights]
    left_out = (
        (f"{others} logs whose friction was measured at other speeds",) if others and quantity == "friction" else ()
    )
    return NightSeries(
        quantity=quantity,
        nights=tuple(nights),
        value=np.array([row.value for row in rows]),
        se=np.array([row.se for row in rows]),
        temperature_c=np.array([np.nan if row.temperature_c is None else row.temperature_c for row in rows]),
        basis=tuple(row.basis for row in rows),
        basis_se=np.array([row.basis_se for row in rows]),
        left_out=left_out,
    )


def _speed(records: Sequence[LogRecord], joint: str) -> tuple[float | None, int]:
    """The speed at which most logs give friction, and how many give it elsewhere."""
    speeds = Counter(j.law_speed_rad_s for r in records for j in r.joints if j.joint == joint and j.law_speed_rad_s)
    if not speeds:
        return None, 0
    speed, count = speeds.most_common(1)[0]
    return speed, speeds.total() - count


def reading_of(record: LogRecord, item: JointRecord, quantity: Quantity, speed: float | None) -> Reading | None:
    """One quantity of a joint in one log, of friction at one speed (rad/s); None where the log does not tell it."""
    found: tuple[float | None, float | None]
    basis = record.friction_sha256 or "own"
    basis_se = 0.0
    match quantity:
        case "friction":
            if item.law_nm is None or item.law_speed_rad_s != speed:
                return None
            low, high = item.law_nm_low, item.law_nm_high
            curve_se = 0.0 if low is None or high is None else (high - low) / 2 / STANDARD_ERRORS_95
            if record.friction_sha256 is None:
                found = item.law_nm, curve_se
            elif item.friction_excess is None or item.friction_excess_se is None:
                return None
            else:
                found = item.law_nm * (1.0 + item.friction_excess), item.law_nm * item.friction_excess_se
                basis_se = curve_se
        case "load":
            found = item.load_excess, item.load_excess_se
        case "offset":
            found = item.offset_nm, item.offset_nm_se
        case "residual":
            found = item.clean_mean_abs_nm, None
        case "margin":
            found = item.gamma_margin, None
        case _:
            assert_never(quantity)
    if found[0] is None:
        return None
    return Reading(record.night, found[0], found[1] or 0.0, item.temperature_c, basis, basis_se)


def _night(readings: Sequence[Reading]) -> Reading:
    """The logs of one night as one value: weighted by their errors, or by their scatter where that is larger."""
    value = np.array([r.value for r in readings])
    se = np.array([r.se for r in readings])
    weight = np.ones(value.size) if np.any(se <= 0) else 1.0 / se**2
    mean = float(np.sum(weight * value) / weight.sum())
    own = 0.0 if np.any(se <= 0) else float(1.0 / np.sqrt(weight.sum()))
    if value.size >= _LOGS_FOR_SCATTER:
        own = max(own, float(value.std(ddof=1) / np.sqrt(value.size)))
    known = [r.temperature_c for r in readings if r.temperature_c is not None]
    warm = float(np.mean(known)) if known else None
    basis = "own" if any(r.basis == "own" for r in readings) else max(r.basis for r in readings)
    return Reading(readings[0].night, mean, own, warm, basis, max(r.basis_se for r in readings))
