"""Result types of detection beyond the rule itself: delays, detectors side by side, contacts, scores."""

from dataclasses import dataclass, field
from typing import Literal

ContactKind = Literal["meant", "accidental", "undecided"]
ContactState = Literal["new", "known", "back", "accepted"]
ToolMotion = Literal["went on", "slowed", "turned back", "stopped", "stood", "unknown"]
LoadKind = Literal["quasi-static", "transient", "unknown"]


@dataclass(frozen=True, slots=True)
class DelayFacts:
    """From the moment a torque exceeds gamma to the moment the rule fires, in its three parts.

    Attributes:
        filter_s: delay of the detector's filter; 0 offline (not causal).
        persistence_s: n times the sample period.
        jitter_s: up to one sample period, for the moment falls anywhere between two samples.
        noise_gain: how much of white sensor noise passes the filter (standard deviations).
    """

    filter_s: float
    persistence_s: float
    jitter_s: float
    noise_gain: float


@dataclass(frozen=True, slots=True)
class LevelFacts:
    """How far a joint's friction was off its calibration: range of the followed level, and its standard error.

    Attributes:
        lowest, median, highest: friction over its calibration, 1 = as calibrated.
        sd: median standard error.
        mean: over the motion that tells it; None without any.
    """

    lowest: float
    median: float
    highest: float
    sd: float
    mean: float | None = None


@dataclass(frozen=True, slots=True)
class ZeroFacts:
    """The zero of a joint's torque on the judged log, N·m: what was found of it, and how much was taken off at most."""

    lowest_nm: float
    highest_nm: float
    bound_nm: float


@dataclass(frozen=True, slots=True)
class LinkForce:
    """The size of a contact's force if it acts on one of the links on which it can be.

    Attributes:
        frame: of the link.
        joint: that moves it.
        low_n, high_n: 95 % interval; ``high_n`` None where a force there has directions that no joint sees.
    """

    frame: str
    joint: str
    low_n: float
    high_n: float | None


@dataclass(frozen=True, slots=True)
class ContactForce:
    """External force at a link, as least squares over the joints' residuals gives it.

    Attributes:
        frame: frame at whose origin a pure force is assumed.
        force_n: (x, y, z) on the robot in base axes, at the peak; None where a direction is blind.
        ci95_n: half width of its 95 % interval by axis; None where the joints cannot see that axis.
        size_n: its magnitude; None where a direction is blind.
        size_ci95_n: interval of the magnitude over all of ``links``: the nearer to an axis a force acts, the larger it
            must be. No lower than the contact's least force; without an upper end where one of the links has none.
        blind: directions (unit vectors in base axes) in which a force would not have been seen.
        misfit_nm: RMS of what the force does not explain.
        links: those on which the contact can be, this one and further out, with the force if it is there.
    """

    frame: str
    force_n: tuple[float, float, float] | None
    ci95_n: tuple[float | None, float | None, float | None]
    size_n: float | None
    size_ci95_n: tuple[float, float | None]
    blind: tuple[tuple[float, float, float], ...]
    misfit_nm: float
    links: tuple[LinkForce, ...] = ()


@dataclass(frozen=True, slots=True)
class LeastForce:
    """Lower bound (95 %) of a contact's force: one joint's torque over the longest lever arm that a contact can have.

    Attributes:
        force_n: no force smaller than this, anywhere on the links that the joint moves, gives its torque.
        joint: whose torque it is.
        lever_m: longest distance from its axis to the surface of what it moves; 1 for prismatic joints.
    """

    force_n: float
    joint: str
    lever_m: float


@dataclass(frozen=True, slots=True)
class ContactScene:
    """What the arm was doing when a contact was strongest.

    Attributes:
        time_s: that moment.
        points_m: (x, y, z) in the base of the joints, base to tip, and of the tool: a stick figure of the pose.
        tool_frame: the frame of the last point.
        tool_speed_m_s: speed of that frame's origin; None where a velocity is not known.
        joint_speed_rad_s: of every judged joint, m/s of a prismatic one; None where it is not known.
        joint_position_rad: of every judged joint, m of a prismatic one; none in files of earlier versions.
    """

    time_s: float
    points_m: tuple[tuple[float, float, float], ...]
    tool_frame: str
    tool_speed_m_s: float | None
    joint_speed_rad_s: dict[str, float | None]
    joint_position_rad: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class AfterContact:
    """What the arm did in the second after a contact's onset; times count from the onset.

    Attributes:
        motion: of the tool: it went on; it slowed, below 70 % of its speed; it turned back, passing through standstill;
            it stopped, for 0.1 s or longer; it stood already; or positions and speeds are not known. A planned motion
            may do any of these.
        force_s: how long the residual was above gamma.
        load: ``quasi-static`` where that is longer than 0.5 s, else ``transient``; unknown where the joints stopped
            being judged before.
        speed_m_s: of the tool just before the onset; None where it is not known.
        slowest: least share of that speed in the second after.
        slowing_s: from when on it was below 90 % of that speed, on the way to its slowest.
        stopped_s: when it stopped.
        stopping_m: way of the tool from the onset until then.
    """

    motion: ToolMotion
    force_s: float
    load: LoadKind
    speed_m_s: float | None = None
    slowest: float | None = None
    slowing_s: float | None = None
    stopped_s: float | None = None
    stopping_m: float | None = None


@dataclass(frozen=True, slots=True)
class Contact:
    """One contact: alarms of several joints that belong together.

    Attributes:
        onset_s, detected_s, end_s: first sample above gamma, first alarm, last sample above gamma.
        joints: joints that alarmed, base to tip.
        link: the last link that explains them: the one moved by the outermost of them.
        link_note: what that does not exclude.
        force: the external force, None where it cannot be computed.
        kind: meant (commanded), accidental or undecided contact.
        evidence: why.
        least_force: what it is at least, also where ``force`` is not known, and from what; None where nothing stands
            out.
        scene: pose and speeds at the peak; None without a kinematic model.
        peak_nm: highest residual, without its sign, of each joint that alarmed, N·m (N if prismatic).
        id: a short name, by which ``collaudit accept`` knows it.
        state: ``new``; ``known`` from earlier nights; ``back`` after a night without it; ``accepted`` by a person.
        state_text: since when, or by whom; and why an acceptance that means it does not cover it.
        known_since, known_nights: first earlier night that had it (ISO date), and how many had.
        after: what the arm did after it; None in files of earlier versions.
    """

    onset_s: float
    detected_s: float
    end_s: float
    joints: tuple[str, ...]
    link: str
    link_note: str
    force: ContactForce | None
    kind: ContactKind
    evidence: tuple[str, ...]
    least_force: LeastForce | None = None
    scene: ContactScene | None = None
    peak_nm: dict[str, float] = field(default_factory=dict)
    id: str = ""
    state: ContactState = "new"
    state_text: str = ""
    known_since: str | None = None
    known_nights: int = 0
    after: AfterContact | None = None


@dataclass(frozen=True, slots=True)
class DisturbedJoint:
    """What one standing joint shows of a disturbance.

    Attributes:
        joint: its name.
        torque_step_nm: largest step of the drive's torque less the model's: a lower bound of the external torque's,
            as friction takes a part of it.
        deflection_rad: step of the position there, against the torque's; m if prismatic.
    """

    joint: str
    torque_step_nm: float
    deflection_rad: float


@dataclass(frozen=True, slots=True)
class RestDisturbance:
    """Standing joints were pushed, or something let go of them, below what alarms: its level is hidden by friction.

    Attributes:
        onset_s, end_s: first and last step.
        joints: those that show it, base to tip.
    """

    onset_s: float
    end_s: float
    joints: tuple[DisturbedJoint, ...]


@dataclass(frozen=True, slots=True)
class ControllerAlarmComparison:
    """A mark of somebody else's, an alarm of the controller or a label of the log, or a contact of ours without one.

    Attributes:
        flag_s: time of the controller's alarm, None when it missed ours.
        detected_s: time of our alarm, None when the controller's is spurious by our evidence.
        relation: agreed, missed (by the controller), spurious, or not-judged: where we could not tell.
        lead_s: controller minus ours: negative when it was earlier.
        label: its name in the log; None for a contact without one.
    """

    flag_s: float | None
    detected_s: float | None
    relation: Literal["agreed", "missed", "spurious", "not-judged"]
    lead_s: float | None
    label: str | None = None


@dataclass(frozen=True, slots=True)
class Score:
    """How right a detector was, on one joint or on all combined.

    Attributes:
        joint: name, or None for all joints combined (an event is found when any required joint alarms).
        events: events that had to be found.
        found: events found.
        not_observable: events not found while the joint rested, had just reversed, or was not judged: they hid
            behind friction or missing data, and are counted neither as found nor in the recall.
        alarms, false_alarms: alarms in all, and those that belong to no event.
        judged_h: hours judged.
        recall, precision, false_alarms_per_hour: None where undefined.
        delay_s: from crossing gamma to the alarm, one each found event, sorted.
        auc: area under the ROC of windows with an event against clean windows of one second, None without both.
        roc: (false positive share, true positive share) at falling thresholds.
    """

    joint: str | None
    events: int
    found: int
    not_observable: int
    alarms: int
    false_alarms: int
    judged_h: float
    recall: float | None
    precision: float | None
    false_alarms_per_hour: float | None
    delay_s: tuple[float, ...]
    auc: float | None
    roc: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class DetectionFacts:
    """What stands behind the events of an audit.

    Attributes:
        causal: whether the residual used only what a controller had at that instant.
        equation: what the detector computes.
        delay: its delay in parts.
        friction_level: by joint.
        flags: the controller's own alarms compared with ours; empty when none were given.
        scores: against known events, all joints combined first; empty when none are known.
        torque_zero: by joint, where thresholds are automatic.
    """

    causal: bool
    equation: str
    delay: DelayFacts
    friction_level: dict[str, LevelFacts]
    flags: tuple[ControllerAlarmComparison, ...]
    scores: tuple[Score, ...] = ()
    torque_zero: dict[str, ZeroFacts] = field(default_factory=dict)
