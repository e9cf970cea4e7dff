"""Result types of a rule study: what threshold and persistence cost and notice, as they stand in study.json."""

from dataclasses import dataclass, field
from typing import Literal

from collaudit.core.data.recommendation_result import SetRule

STUDY_SCHEMA = "collaudit/study/1"
Motion = Literal["moving", "standing"]


@dataclass(frozen=True, slots=True)
class PlanePoint:
    """One rule of a joint in its plane.

    Attributes:
        gamma_nm, n: the rule.
        alarms: in the clean time.
        alarms_per_hour, alarms_per_hour_upper95: their rate and its one-sided 95 % Poisson bound; None without time.
        torque_nm: the smallest torque of the joint that such a rule notices, as of :class:`JointPlane`.
    """

    gamma_nm: float
    n: int
    alarms: int
    alarms_per_hour: float | None
    alarms_per_hour_upper95: float | None
    torque_nm: float | None


@dataclass(frozen=True, slots=True)
class JointPlane:
    """Alarms and sensitivity of one joint over threshold and persistence. Tables are (threshold, persistence).

    Attributes:
        gamma_nm: thresholds, rising.
        n: persistences, samples, rising.
        clean_hours: judged time away from contact that the alarms were counted in.
        alarms: their number in it; closer than 0.2 s they are one.
        torque_nm: the smallest torque of a push of 100 ms that alarms at 95 % of the judged moments; None: none does.
        configured: the rule that is set.
        chosen: the rule that is recommended; None where none is.
        frontier: the rules at which no other notices less torque at as few alarms, by rising alarms.
    """

    gamma_nm: tuple[float, ...]
    n: tuple[int, ...]
    clean_hours: float
    alarms: tuple[tuple[int, ...], ...]
    torque_nm: tuple[tuple[float | None, ...], ...]
    configured: PlanePoint | None
    chosen: PlanePoint | None
    frontier: tuple[PlanePoint, ...]


@dataclass(frozen=True, slots=True)
class ForceNoticed:
    """The force of which a share of contacts was noticed, with its 95 % interval.

    Attributes:
        share: of the contacts.
        force_n: None where the share is not reached at any force.
        ci95_n: by the ranks of the contacts; None at an open end.
    """

    share: float
    force_n: float | None
    ci95_n: tuple[float | None, float | None]


@dataclass(frozen=True, slots=True)
class ContactSensitivity:
    """Contacts of one shape at one place (or at all), added to the log.

    Attributes:
        shape: name of the shape; ``duration_s``, ``edge_s`` its length and its rise.
        place: where it acted, or None for all places.
        motion: of the joints that feel it most at its onset; None for both.
        contacts: number of them.
        noticed: forces of which half and 90 % were noticed.
        delay_s: median time from onset to alarm at twice the force that each contact needs; None without any.
        blind: share of the contacts that no force up to the largest made alarm.
    """

    shape: str
    duration_s: float
    edge_s: float
    place: str | None
    motion: Motion | None
    contacts: int
    noticed: tuple[ForceNoticed, ...]
    delay_s: float | None
    blind: float


@dataclass(frozen=True, slots=True)
class RuleSensitivity:
    """What contacts one rule of the whole arm notices.

    Attributes:
        name: ``configured`` or ``recommended``.
        gamma_nm: thresholds of the watched joints.
        n: persistence, samples.
        contacts: by shape, place and motion.
    """

    name: str
    gamma_nm: dict[str, float]
    n: int
    contacts: tuple[ContactSensitivity, ...]


@dataclass(frozen=True, slots=True)
class ForceCell:
    """The smallest noticeable lasting force at the tool while that was in one part of the space.

    Attributes:
        centre_m: (x, y, z) of the part, base axes.
        moments: of the log that were computed there.
        force_n: median over them, of the force that is noticed from 95 % of all directions; None: from fewer.
    """

    centre_m: tuple[float, float, float]
    moments: int
    force_n: float | None


@dataclass(frozen=True, slots=True)
class BlindPose:
    """A pose, and the direction from which no joint feels a force at a place there.

    Attributes:
        place: where the force acts.
        time_s: when the arm was so.
        words: the direction, in base axes, for a reader.
        force_n: the smallest noticeable force from there; None: none is.
        share: of the moments in which such a direction exists at this place.
    """

    place: str
    time_s: float
    words: str
    force_n: float | None
    share: float


@dataclass(frozen=True, slots=True)
class ForceMap:
    """Where the arm notices how small a force: at the tool over the poses driven, and what is blind.

    Attributes:
        cell_m: edge of the cells.
        limit_n: a direction that needs more than this counts as blind.
        cells: where the tool was.
        blind: by place, the worst pose and direction.
    """

    cell_m: float
    limit_n: float
    cells: tuple[ForceCell, ...]
    blind: tuple[BlindPose, ...]


@dataclass(frozen=True, slots=True)
class ThresholdParts:
    """What a joint's threshold is made of.

    Attributes:
        level_nm: the level that the clean residual sustains for n samples once in a while: what causes are measured by.
        falls_nm: by cause (``noise``, ``reversal``, ``friction``, ``model``, ``ripple``, ``drift``, ``lag``), by how
            much that would fall without it, largest first; ``rest``: what is left without them all. Causes overlap, so
            these do not add up.
    """

    level_nm: float
    falls_nm: dict[str, float]


@dataclass(frozen=True, slots=True)
class LabelledCurve:
    """How many known contacts a rule misses as its thresholds rise, beside injected ones.

    Attributes:
        scale: factors on the configured thresholds, rising.
        contacts: number of known contacts that were judged.
        missed: share of them not noticed at each factor, with ``missed_ci95`` its Wilson interval.
        injected: by force in N, the share of injected pushes missed at the same factors.
    """

    scale: tuple[float, ...]
    contacts: int
    missed: tuple[float, ...]
    missed_ci95: tuple[tuple[float, float], ...]
    injected: dict[str, tuple[float, ...]]


@dataclass(frozen=True, slots=True)
class RuleStudy:
    """``study.json``: what the rule of one log costs and notices, and what others would.

    Attributes:
        log: name of the log; ``log_sha256`` its hash.
        period_s: sample period.
        joints: planes of the watched joints.
        rules: what contacts are noticed, by rule of the arm.
        force_map: over the poses driven; None without a kinematic model.
        parts: what each joint's threshold is made of.
        labelled: against known contacts; None where none are known.
        assumptions: what the numbers assume, in words.
        set_rules: what this log alone says of the configured thresholds, by joint: too tight, too loose or supported.
        units: by joint, of what its drive exerts: N·m, or N of a prismatic joint.
    """

    schema: str
    log: str
    log_sha256: str
    period_s: float
    joints: dict[str, JointPlane] = field(default_factory=dict)
    rules: tuple[RuleSensitivity, ...] = ()
    force_map: ForceMap | None = None
    parts: dict[str, ThresholdParts] = field(default_factory=dict)
    labelled: LabelledCurve | None = None
    assumptions: tuple[str, ...] = ()
    set_rules: dict[str, SetRule] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
