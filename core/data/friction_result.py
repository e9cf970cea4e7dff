"""Result types of one joint's friction: points, law, intervals, what the data cannot determine."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from collaudit.core.friction_laws.law_registry import LAWS, LawName

OpenSide = Literal["low", "high", "both"]
Bounds = tuple[float | None, float | None]


@dataclass(frozen=True, slots=True)
class FrictionPoint:
    """One (speed, friction) point, eq. (16).

    Attributes:
        speed_rad_s: mean speed (rad/s; m/s if prismatic), positive.
        friction_nm: friction in the file's effort unit.
        sd_nm: spread of the friction over the positions of the section.
        se_nm: standard error of ``friction_nm``, from blocks of positions.
        source: ``pair`` (both directions, eq. 15) or ``model`` (the model's torque was subtracted).
        direction: +1 or -1 for ``model`` points, 0 for pairs.
        others_moving: True when other joints moved in the section.
        timing_nm: change of ``friction_nm`` if effort were stamped one standard deviation (0.41 samples) later than
            position; common to all points, in none of their standard errors.
        seconds: time that the shorter section took; 0 where that is not known.
    """

    speed_rad_s: float
    friction_nm: float
    sd_nm: float
    se_nm: float
    source: Literal["pair", "model"]
    direction: int
    others_moving: bool
    timing_nm: float = 0.0
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class ModelComparison:
    """One friction law beside the others, as ``model = "auto"`` compared them.

    Attributes:
        model: the law.
        parameters: fitted parameters (effective ones of the data-driven law).
        rmse_nm: of all points about its curve.
        held_out_rmse_nm: of points at speeds that were left out of the fit.
        held_out_score: mean square of the held-out errors, each in its point's standard deviation.
        held_out_score_se: standard error of that mean over the folds.
        aicc: corrected Akaike information criterion; only differences mean anything.
        chosen: whether this law was taken.
        note: why it was, why not, or why it could not be compared.
    """

    model: str
    parameters: float | None
    rmse_nm: float | None
    held_out_rmse_nm: float | None
    held_out_score: float | None
    held_out_score_se: float | None
    aicc: float | None
    chosen: bool
    note: str


@dataclass(frozen=True, slots=True)
class Identifiability:
    """What the data say about the parameters of one fit.

    Attributes:
        singular_values: of the Jacobian at the solution, columns scaled to length one, largest first.
        condition: largest over smallest; None when the smallest is zero to rounding.
        correlations: of two parameters' estimates, ``A_nm ~ D_nm_s_per_rad`` to a number in [-1, 1].
        at_bounds: parameters that stand at the edge of what was searched or allowed.
        open_sides: parameters whose interval is infinite, and on which side (its bound is null in ``ci95``).
        motion_needed: what motion would settle what is open.
    """

    singular_values: tuple[float, ...]
    condition: float | None
    correlations: dict[str, float]
    at_bounds: tuple[str, ...]
    open_sides: dict[str, OpenSide]
    motion_needed: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class KnownCombination:
    """A combination of parameters that the data do determine.

    Attributes:
        name: such as ``A + B``.
        value: its estimate.
        ci95: its interval.
        unit: its unit.
    """

    name: str
    value: float
    ci95: Bounds
    unit: str


@dataclass(frozen=True, slots=True)
class FrictionFit:
    """Friction of one joint: parameters, intervals, and what the data could not tell.

    ``parameters`` of static LuGre are A, B, C, D of eq. (11) with unit suffixes (``A_nm``, ``B_nm``,
    ``C_s_per_rad``, ``D_nm_s_per_rad``); Coulomb-viscous has ``A_nm`` and ``D_nm_s_per_rad``. In units other
    than N·m the suffixes say so (``A_raw`` …; prismatic joints ``A_n``, ``C_s_per_m`` …).

    Attributes:
        model: None when the joint could not be fitted; ``reason`` then says why.
        parameters: name to value.
        ci95: name to [low, high], an open side is None; None when there is no interval at all.
        covariance: of the parameters in their order, or None.
        identifiable: whether every parameter of eq. (11), or of the other law that was fitted, is determined
            by the data; a straight line never tells B and C.
        not_identifiable: sentences on what is not known, and why.
        known: combinations that are known where single parameters are not.
        n_points, n_pairs: friction points, and how many of them are pairs.
        speed_range_rad_s: slowest and fastest speed measured.
        rmse_nm: of the points about the curve.
        effort_unit: ``N·m``, ``N`` or ``raw``.
        points: the points.
        reason: why there is no model.
        section_count: constant-velocity sections used.
        rejected: reason to count of rejected stretches.
        comparison: every law that was compared, when the model was chosen automatically.
        identifiability: singular values, correlations, open sides, and what motion would settle them.
        r_squared: share of the points' variance that the curve explains.
        motion: ``sections`` of constant velocity, ``any`` motion, or ``sensors``: the difference between effort and a
            joint torque sensor over any motion.
        unphysical: parameters that the points want beyond what friction can be, by more than their uncertainty; the
            fit holds them at the bound.
        dissipates: whether friction opposes the motion; False where it is negative beyond its uncertainty.
        rmse_share: ``rmse_nm`` as a share of the joint's rated torque, when the robot model states one.
    """

    model: LawName | None
    parameters: dict[str, float]
    ci95: dict[str, Bounds | None]
    covariance: tuple[tuple[float, ...], ...] | None
    identifiable: bool
    not_identifiable: tuple[str, ...]
    known: tuple[KnownCombination, ...]
    n_points: int
    n_pairs: int
    speed_range_rad_s: tuple[float, float] | None
    rmse_nm: float | None
    effort_unit: str
    points: tuple[FrictionPoint, ...]
    reason: str | None = None
    section_count: int = 0
    rejected: dict[str, int] = field(default_factory=dict)
    comparison: tuple[ModelComparison, ...] = ()
    identifiability: Identifiability | None = None
    r_squared: float | None = None
    rmse_share: float | None = None
    motion: Literal["sections", "any", "sensors"] = "sections"
    unphysical: tuple[str, ...] = ()
    dissipates: bool = True

    def __post_init__(self) -> None:
        if self.model is not None and self.model not in LAWS:
            raise ValueError(f"there is no friction law {self.model!r}: {', '.join(LAWS)}")


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
