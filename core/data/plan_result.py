"""Result types of a planned motion, as they stand in ``plan.json``."""

from dataclasses import dataclass
from typing import Literal

from collaudit.core.data.audit_result import Provenance

PLAN_SCHEMA = "collaudit/plan/1"
#: What every file of a plan says.
PROPOSAL = (
    "This is a proposal, computed from the robot's description. A person must check it on the robot before it runs: "
    "limits, tool, cables, people, everything around the arm. Run it slowly first, with a hand on the emergency stop."
)


@dataclass(frozen=True, slots=True)
class JointLimits:
    """Hard limits of one joint; rad and N·m, or m and N of a prismatic joint.

    Attributes:
        low_rad, high_rad: positions, margin taken off.
        speed_rad_s, acceleration_rad_s2, jerk_rad_s3, torque_nm: highest.
        start_rad: where the motion starts and ends.
    """

    low_rad: float
    high_rad: float
    speed_rad_s: float
    acceleration_rad_s2: float
    jerk_rad_s3: float
    torque_nm: float
    start_rad: float


@dataclass(frozen=True, slots=True)
class JointSweep:
    """Sweeps of one joint, each at one speed both ways, beside those of the other joints.

    Attributes:
        joint: its name.
        low_rad, high_rad: window of the sweeps.
        speeds_rad_s: ascending.
        start_s, end_s: when in the motion.
    """

    joint: str
    low_rad: float
    high_rad: float
    speeds_rad_s: tuple[float, ...]
    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True)
class Prediction:
    """What the motion should tell of one parameter.

    Attributes:
        joint: name, or None for a parameter of the whole arm.
        parameter: key of friction.json, or kind and name of what is identified.
        value: as known, or as guessed where it is not.
        before: half width of the 95 % interval that earlier logs give; None: open.
        after: the same with the planned motion; None where no log says how much torques scatter.
        guessed: whether ``value`` is a guess.
    """

    joint: str | None
    parameter: str
    value: float | None
    before: float | None
    after: float | None
    guessed: bool


@dataclass(frozen=True, slots=True)
class CleanTime:
    """How long a joint must move without contact for its threshold.

    Attributes:
        hours: clean hours that there are.
        hours_for_rate: that support the rate asked for.
        gamma_nm: the motion's level by these hours; None where no run says.
        gamma_after_nm: the same with the planned motion as further clean time.
        hours_for_gamma: clean hours for the threshold that was asked for; None where none was, or none reaches it.
    """

    hours: float
    hours_for_rate: float
    gamma_nm: float | None
    gamma_after_nm: float | None
    hours_for_gamma: float | None


@dataclass(frozen=True, slots=True)
class PlanFile:
    """``plan.json``.

    Attributes:
        schema: version of this file.
        statement: what a person must do before it runs.
        minutes_asked, duration_s: the motion is no longer than what was asked.
        per_hour: false alarms of the arm that the clean hours are for.
        gamma_asked_nm: threshold that the clean hours are for; None where none was asked for.
        limits: by joint.
        assumed: limits and places that are not stated.
        shapes: links with a shape of the description.
        capsules_m: radius of the capsule of every other link, by joint.
        unchecked: pairs of links that are not kept apart, being neighbours or nearly so.
        surroundings: table, workspace and tool, in words.
        sweeps: by joint.
        exciting_s: start and end of the exciting trajectory; None for none.
        exciting_moves: number of its moves.
        predictions: of all parameters.
        clean: by joint.
        missing: what could not be planned or predicted, and why.
        provenance: versions and hashes.
    """

    schema: str
    statement: str
    minutes_asked: float
    duration_s: float
    per_hour: float
    gamma_asked_nm: float | None
    limits: dict[str, JointLimits]
    assumed: tuple[str, ...]
    shapes: tuple[str, ...]
    capsules_m: dict[str, float]
    unchecked: tuple[str, ...]
    surroundings: tuple[str, ...]
    sweeps: tuple[JointSweep, ...]
    exciting_s: tuple[float, float] | None
    exciting_moves: int
    predictions: tuple[Prediction, ...]
    clean: dict[str, CleanTime]
    missing: tuple[str, ...]
    provenance: Provenance


Outcome = Literal["as predicted", "better", "worse", "not told", "not predicted", "not estimated"]


@dataclass(frozen=True, slots=True)
class Delivered:
    """What a log of the planned motion gave of one parameter, beside the prediction.

    Attributes:
        joint, parameter: as of :class:`Prediction`.
        predicted: half width.
        delivered: half width; None where the fit has no interval.
        outcome: in a word: as predicted within a factor; not estimated: it goes with inertials, which the fit took as
            exact.
    """

    joint: str | None
    parameter: str
    predicted: float | None
    delivered: float | None
    outcome: Outcome
