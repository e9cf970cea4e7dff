"""Result types of what friction goes with besides speed, as it is used in the residual and stands in friction.json."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class LoadFriction:
    """Friction that goes with the torque on the gear: per_nm · (|load| - usual load at that speed), against the motion.

    The law was fitted at the loads that came with its speeds: only what differs from those is added to it.

    Attributes:
        per_nm: N·m of friction per N·m of rigid-body torque and commanded force.
        per_nm_sd: its standard error.
        speeds_rad_s: speeds at which the usual load is known, rising (m/s if prismatic).
        usual_nm: mean load of the fit at each of them; straight between them.
        range_nm: loads of the fit (2nd to 98th percentile); beyond them friction is that of the nearer end.
    """

    per_nm: float
    per_nm_sd: float
    speeds_rad_s: tuple[float, ...]
    usual_nm: tuple[float, ...]
    range_nm: tuple[float, float]


@dataclass(frozen=True, slots=True)
class RippleWave:
    """One harmonic of torque over position: (a + s·c)·cos(k q) + (b + s·d)·sin(k q), s the sign of the velocity.

    Attributes:
        cycles_per_turn: k.
        same_nm: a, b: the same both ways, as cogging.
        against_nm: c, d: against the motion, as the mesh of a gear.
        sd_nm: standard error of an amplitude.
    """

    cycles_per_turn: float
    same_nm: tuple[float, float]
    against_nm: tuple[float, float]
    sd_nm: float


@dataclass(frozen=True, slots=True)
class FrictionCorrection:
    """What one joint's law is corrected by, each part shown on time that was held out.

    Attributes:
        load: friction of the load.
        ripple: harmonics over position, the strongest first.
        rms_nm, held_out_rms_nm: residual in settled motion without the corrections, and on time held out with them.
    """

    load: LoadFriction | None
    ripple: tuple[RippleWave, ...]
    rms_nm: float
    held_out_rms_nm: float
