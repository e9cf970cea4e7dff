"""Friction of the load on the gear, as a fit found it: its torque, and what it may be wrong by."""

from __future__ import annotations

import numpy as np

from collaudit.core.data.friction_correction import LoadFriction
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95


def load_torque(load: LoadFriction, load_nm: FloatArray, velocity: FloatArray) -> FloatArray:
    """(n,) friction of the load beyond what the law has of it, signed as friction is.

    Args:
        load: what is known of it.
        load_nm: (n,) size of the torque on the gear.
        velocity: (n,) of the joint.
    """
    return np.asarray(np.sign(velocity) * load.per_nm * (np.clip(load_nm, *load.range_nm) - _usual(load, velocity)))


def load_doubt(load: LoadFriction, load_nm: FloatArray, velocity: FloatArray) -> FloatArray:
    """(n,) half width of its 95 % interval: the slope's error, and all that loads beyond those of the fit could add."""
    held = np.clip(load_nm, *load.range_nm)
    slope = STANDARD_ERRORS_95 * load.per_nm_sd * np.abs(held - _usual(load, velocity))
    return np.asarray(slope + load.per_nm * np.abs(load_nm - held))


def _usual(load: LoadFriction, velocity: FloatArray) -> FloatArray:
    return np.interp(np.abs(velocity), load.speeds_rad_s, load.usual_nm)
