"""What a log's torque has beyond that of the fitted motion, thinned, in blocks of time: causes are tried on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import ceil, floor

import numpy as np

from collaudit.core.data.recommendation_result import FittedThresholds
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import median_of
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.torque_table.block_sums import rows_of_blocks
from collaudit.core.torque_table.log_samples import thinned

#: Causes act on motion below a few hertz: so many samples a second serve, and so many in all.
_RATE_HZ, _MOST_SAMPLES = 25.0, 12_000
#: Neighbouring samples share their errors: a block of so many seconds counts as one, s.
BLOCK_S = 2.0
#: A block of a joint with fewer samples tells nothing.
_FEWEST = 5
#: What is below so many times the usual level of a joint is no excess.
_USUAL = 1.5
#: A block that is so many times as far off as half of the blocks counts as this.
_FAR = 1.5
#: Step of speed over which a law's slope is taken, rad/s.
_DV = 1e-4
#: Where no friction file tells the usual level: this share of the threshold.
_SHARE_OF_GAMMA = 0.25


@dataclass(frozen=True, eq=False)
class Excess:
    """The residual of the judged joints where friction is a value, with what causes are made of.

    Attributes:
        joints: j judged ones.
        columns: their columns in the motion.
        time_s: (n,) of the thinned samples.
        motion: position, velocity, acceleration of all joints, (n, k) each.
        torque_nm: (n, j) effort less model and friction as fitted, before their level and zero are followed; 0 where it
            is not known.
        residual_nm: (n, j) residual, as judged.
        known: (n, j) samples that count.
        usual_nm: (j,) robust deviation of the residual in the fitted motion.
        zero_bound_nm: (j,) how far the zero of the torque is followed.
        model_nm: (n, j) model torque, friction included.
        friction_nm: (n, j) friction as fitted.
        slope_nm_s: (n, j) derivative of the model torque, friction included.
        block: (n,) number of its block of time.
    """

    joints: tuple[str, ...]
    columns: list[int]
    time_s: FloatArray
    motion: tuple[FloatArray, FloatArray, FloatArray]
    torque_nm: FloatArray
    residual_nm: FloatArray
    known: BoolArray
    usual_nm: FloatArray
    zero_bound_nm: FloatArray
    model_nm: FloatArray
    friction_nm: FloatArray
    slope_nm_s: FloatArray
    block: IntArray

    @cached_property
    def half(self) -> IntArray:
        """(b,) 0 or 1: pairs of blocks dealt out in turn; what one half tells is tried on the other."""
        return np.asarray((np.arange(int(self.block[-1]) + 1) // 2) % 2)

    @cached_property
    def count(self) -> FloatArray:
        """(b, j) samples of each block that count."""
        return np.asarray(rows_of_blocks(self.known.astype(np.float64), self.block).sum(axis=1))

    @cached_property
    def residual_size(self) -> FloatArray:
        """(b, j) RMS of the residual in each block over the joint's usual level; NaN where too little is known."""
        return rms(np.square(rows_of_blocks(self.residual_nm / self.usual_nm, self.block)).sum(axis=1), self.count)

    def beyond(self, size: FloatArray) -> FloatArray:
        """(b, j) how much of sizes is beyond the usual; 0 where nothing is known.

        Of a joint that is off most of the time, what is far above that counts no more: contact, whatever the cause.
        """
        excess = np.maximum(size - _USUAL, 0.0)
        known = (its[np.isfinite(its)] for its in self.residual_size.T)
        usual = np.array([median_of(its) if its.size else 0.0 for its in known]) - _USUAL
        return np.nan_to_num(np.where(usual > 0.0, np.minimum(excess, _FAR * usual), excess))


def rms(square: FloatArray, count: FloatArray) -> FloatArray:
    """Of sums of squares over so many samples; NaN where they are too few."""
    mean = np.divide(np.maximum(square, 0.0), count, out=np.full(count.shape, np.nan), where=count >= _FEWEST)
    return np.asarray(np.sqrt(mean))


def excess_of(
    prepared: Prepared,
    run: DetectorRun,
    laws: Mapping[str, FrictionModel],
    gamma_nm: Mapping[str, float],
    fitted: FittedThresholds | None,
) -> Excess | None:
    """The table of one judged log; None where no joint's friction is a value, or no model torque is known.

    Args:
        prepared: the log.
        run: its residual.
        laws: friction of its joints.
        gamma_nm: thresholds by joint.
        fitted: the usual level of joints, where a friction file tells it.
    """
    residual, series = run.residual, prepared.series
    judged = prepared.judged_series
    if residual.effort_nm is None or prepared.rigid_nm is None or not prepared.robot.has_inertials:
        return None
    told = residual.levels.keys() & gamma_nm.keys() - residual.still
    names = [name for name in judged.joint_names if name in told]
    if not names:
        return None
    own = [judged.joint_names.index(name) for name in names]
    columns = [series.column(name) for name in names]
    size = max(1, floor(1.0 / (_RATE_HZ * series.period_s)), ceil(series.time_s.size / _MOST_SAMPLES))
    judged_nm = (np.where(residual.state[:, k] == State.JUDGED, residual.torque_nm[:, k], np.nan) for k in own)
    torque = np.column_stack([thinned(x[:, None], size) for x in judged_nm])
    time_s, explained, q, v, a = (thinned(x, size) for x in (series.time_s[:, None], prepared.rigid_nm, *series.motion))
    if prepared.contact_nm is not None:
        explained += thinned(prepared.contact_nm, size)
    explained = explained[:, columns]
    known = np.isfinite(torque) & np.isfinite(q + v + a).all(axis=1, keepdims=True)
    if not known.any():
        return None
    slope = np.gradient(explained, size * series.period_s, axis=0)
    heat = None if series.temperature_c is None else thinned(series.temperature_c, size)
    friction, faster = (
        np.column_stack(
            [
                laws[name].sliding(speed, np.abs(load), None if heat is None else heat[:, c])
                for name, speed, load, c in zip(names, (v[:, columns] + more).T, explained.T, columns, strict=True)
            ]
        )
        for more in (0.0, _DV)
    )
    slope += (faster - friction) / _DV * a[:, columns]  # where it slides one way; elsewhere nothing is known
    followed = np.column_stack([thinned(residual.followed_nm[:, k : k + 1], size) for k in own])
    noise_nm = {} if fitted is None else {name: one.noise_nm for name, one in fitted.joints.items()}
    return Excess(
        tuple(names),
        columns,
        time_s[:, 0],
        (q, v, a),
        np.where(known, np.nan_to_num(torque + followed), 0.0),
        np.where(known, torque, 0.0),
        known,
        np.array([noise_nm.get(name) or _SHARE_OF_GAMMA * gamma_nm[name] for name in names]),
        np.array([residual.zeros[name].bound_nm if name in residual.zeros else 0.0 for name in names]),
        np.where(known, np.nan_to_num(explained + friction), 0.0),
        np.where(known, np.nan_to_num(friction), 0.0),
        np.where(known, np.nan_to_num(slope), 0.0),
        np.floor((time_s[:, 0] - time_s[0, 0]) / BLOCK_S).astype(np.int64),
    )
