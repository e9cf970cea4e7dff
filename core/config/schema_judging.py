"""How a log is judged: the rule and when it applies, [detect], [cycles], [near_miss] and [phases]; what makes an audit
fail or unable to judge, [policy]; and by what each robot's logs are judged, [fleet].
"""

from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta
from msgspec.structs import force_setattr

from collaudit.core.config.config_table import ConfigTable, Interval, KeyedError, NonNegative, Positive, about

#: Each has a line in ``core/residual/detector.py``.
DetectorName = Literal["direct", "momentum", "filtered", "eso"]
#: Persistence where neither time nor samples are stated, ms (paper, section 5).
DEFAULT_PERSISTENCE_MS = 25.0
#: Of a causal detector with automatic thresholds, ms: those of half the time are hardly higher, and it alarms sooner.
CAUSAL_PERSISTENCE_MS = 12.5


class DetectConfig(ConfigTable, frozen=True, kw_only=True):
    """Rule (6): |residual| above gamma for n samples is a collision."""

    detector: Annotated[DetectorName, about("How the residual is computed (see docs/method.md).")] = "direct"
    causal: Annotated[
        bool,
        about(
            "true: only what a controller had at that instant, with its delay; "
            "false: offline (non-causal), the best evidence a whole log gives."
        ),
    ] = False
    observer_gain_per_s: Annotated[
        float,
        Meta(ge=0.05),
        about("Gain K_O of momentum, filtered and eso, 1/s; the delay is about 1/K_O when causal."),
    ] = 60.0
    gamma_nm: Annotated[
        Positive | dict[str, Positive] | Literal["auto", "sharpest"],
        about(
            "Threshold, N·m (N if prismatic); one number, or by joint, constant as stated. `auto`: between "
            "what motion does by itself, as kept in the friction file, and what notices half of the force "
            "that the policy asks for; `sharpest`: what the fitted motion reached."
        ),
    ] = 4.0
    persistence_ms: Annotated[
        Positive | None,
        about(
            "Persistence, ms; rounded up to samples. 25 when neither is given; 12.5, and three samples, of a "
            "causal detector with automatic thresholds."
        ),
    ] = None
    n: Annotated[Annotated[int, Meta(ge=1)] | None, about("Persistence in samples, instead of persistence_ms.")] = None
    watch: Annotated[Literal["auto"] | list[str], about("Joints whose residual is judged.")] = "auto"
    hand_guiding: Annotated[
        Literal["found", "off"],
        about(
            "found: where a person guides the arm (finding `arm-guided`) nothing is judged; off: it is "
            "judged like any motion."
        ),
    ] = "found"
    true_events: Annotated[
        list[str],
        about(
            "Labels of the log (by name, topic or column) that mark what really happened; the detection is "
            "scored against them."
        ),
    ] = []

    def __post_init__(self) -> None:
        if self.persistence_ms is not None and self.n is not None:
            raise ValueError("give either persistence_ms or n, not both")

    @property
    def automatic(self) -> bool:
        """Whether thresholds are to be told, and not stated."""
        return isinstance(self.gamma_nm, str)

    @property
    def short_persistence(self) -> bool:
        """Whether the persistence is not stated, and that of a causal detector with automatic thresholds."""
        return self.causal and self.automatic and self.persistence_ms is None and self.n is None

    @property
    def asked_persistence_ms(self) -> float:
        """Persistence where it is not stated in samples, ms: as stated, or what stands for it."""
        return self.persistence_ms or (CAUSAL_PERSISTENCE_MS if self.short_persistence else DEFAULT_PERSISTENCE_MS)


class CyclesConfig(ConfigTable, frozen=True, kw_only=True):
    """Programs repeat: each cycle is judged against the same place of others, too."""

    find: Annotated[
        Literal["auto", "off"],
        about("auto: cycles are those that are stated, else found by the measured path; off: none are compared."),
    ] = "auto"
    label: Annotated[
        str | None, about("Label or phase of the log (by name, topic or column) whose stretches are the cycles.")
    ] = None
    spans_s: Annotated[list[Interval], about("Start and end of each cycle, s from the log's first sample.")] = []

    def __post_init__(self) -> None:
        for start, end in self.spans_s:
            if not start < end:
                raise KeyedError("spans_s", f"interval [{start:g}, {end:g}] does not run forward")


class NearMissConfig(ConfigTable, frozen=True, kw_only=True):
    """What counts as a near miss: beyond what motion does and short of an alarm."""

    amplitude: Annotated[
        float,
        Meta(gt=0, lt=1),
        about("Share of gamma; where thresholds are automatic it is no less than what motion does by itself."),
    ] = 0.8
    persistence: Annotated[float, Meta(gt=0, lt=1), about("Share of n.")] = 0.5


class PhasesConfig(ConfigTable, frozen=True, kw_only=True):
    """When the tool was meant to do what; seconds from the log's first sample."""

    find: Annotated[
        Literal["off", "wrench"],
        about(
            "wrench: where no phase is given, find approach, contact and retreat from the measured force. It "
            "stays an exclusion, for a collision of the tool looks the same."
        ),
    ] = "off"
    values: Annotated[
        dict[str, Literal["free", "approach", "contact", "retreat"]],
        about("Phase meant by each value of the log's phase topic or column, where that is not the phase's name."),
    ] = {}
    force_limit_n: Annotated[
        Positive | None,
        about(
            "Largest tool force that is commanded, N; what exceeds it is judged. When absent: what is usual "
            "in the contact."
        ),
    ] = None
    approach: Annotated[list[Interval], about("No contact yet (t1).")] = []
    contact: Annotated[list[Interval], about("Force-controlled contact (t2).")] = []
    retreat: Annotated[list[Interval], about("No contact any more (t3).")] = []
    force_control: Annotated[
        list[Interval], about("When force was commanded (t_c); must lie within the contact phase.")
    ] = []

    def __post_init__(self) -> None:
        for name in ("approach", "contact", "retreat", "force_control"):
            for start, end in getattr(self, name):
                if not start < end:
                    raise KeyedError(name, f"interval [{start:g}, {end:g}] does not run forward")
            force_setattr(self, name, sorted(getattr(self, name)))


#: A push that must alarm lasts so long, s.
PUSH_S = 0.2


class PolicyConfig(ConfigTable, frozen=True, kw_only=True):
    """What makes an audit fail, and what makes it unable to judge."""

    max_collisions: Annotated[
        int,
        Meta(ge=0),
        about("The audit fails if there are more contacts than this; alarms of several joints are one contact."),
    ] = 0
    max_near_misses_per_hour: Annotated[
        NonNegative | None,
        about("The audit fails if the lower 95 % bound of the near misses an hour exceeds this."),
    ] = None
    max_disturbed_at_rest: Annotated[
        int,
        Meta(ge=0),
        about("Pushes of standing joints, too weak to alarm, that a log may have; with more it is not judged."),
    ] = 0
    observable_n: Annotated[
        dict[str, Positive],
        about(
            "Contact force that must alarm within 0.2 s, N, by place: `tool`, `forearm` (its outer end), or a link's "
            "name. Of a place that is absent: 100 at the tool, 150 at the forearm, at most half of what the arm can "
            "exert there. None is asked where the table is absent and `observable_nm` covers every watched joint."
        ),
    ] = {}
    observable_share: Annotated[
        float,
        Meta(gt=0, le=1),
        about(
            "Least share of the time in motion in which the force of `observable_n` would have alarmed, from 80 % of "
            "the directions that load a watched joint, and each torque of `observable_nm`; with less the log is not "
            "judged. If the arm never moves, of all time."
        ),
    ] = 0.9
    observable_nm: Annotated[
        Positive | dict[str, Positive] | None,
        about("External torque that must alarm, N·m (N if prismatic); one number, or by joint. Absent: none is asked."),
    ] = None
    same_log: Annotated[
        Literal["refuse", "folds", "allow"],
        about(
            "refuse: a log is not judged by friction and thresholds that were fitted on it alone; folds: each of its "
            "parts is, by a fit of the others, and the verdict names what that cannot see; allow: it is, and the "
            "verdict excludes that."
        ),
    ] = "refuse"
    max_hidden_s: Annotated[
        Positive,
        about(
            "Longest stretch in which the force of `observable_n`, or a torque of `observable_nm`, may go unnoticed, "
            "at rest and in gaps too, s; with a longer one the log is not judged."
        ),
    ] = 1800.0
    min_coverage: Annotated[
        float,
        Meta(ge=0, le=1),
        about(
            "Least share of a watched joint's time in motion that could be judged, and of the log that must "
            "hold its values; with less the log is not judged. Gaps and missing values count as motion, "
            "unless the joint rested at one place before and after."
        ),
    ] = 0.8
    known: Annotated[
        Literal["break", "allow"],
        about(
            "break: a contact that earlier nights had, too, breaks the policy like a new one; allow: the "
            "verdict says it. One that is clearly harder, or comes back after a night without it, always "
            "breaks it."
        ),
    ] = "break"
    other_files: Annotated[
        Literal["not_judged", "list", "ignore"],
        about(
            "Files in a folder of logs that are no logs by name: not_judged: each counts as not judged; "
            "list: they are named only; ignore: not even that. What a recorder left behind, and archives "
            "that may hold logs, always count as not judged."
        ),
    ] = "not_judged"


class FleetRobot(ConfigTable, frozen=True, kw_only=True):
    """One robot of a fleet: whose logs are its own, and what differs for it."""

    paths: Annotated[
        list[str],
        about(
            "Patterns of its logs' paths or URLs, with `*`, `?` and `[…]`; one that does not begin with `/` or "
            "a scheme matches the end of a path from a folder on."
        ),
    ] = []
    topics: Annotated[list[str], about("Topics, one of which its logs have.")] = []
    joints: Annotated[list[str], about("Joint names, or columns, that its logs have, all of them.")] = []
    config: Annotated[
        Path | None,
        about(
            "Configuration of this robot, in place of the common one but for `[fleet]`; of `[policy]` what it states "
            "differs. Relative to the file that names it, as is the next."
        ),
    ] = None
    friction: Annotated[Path | None, about("friction.json to judge with.")] = None
    gamma_nm: Annotated[
        Positive | str | dict[str, Positive] | None,
        about('Threshold, as in `[detect]`: one number, by joint, or "auto".'),
    ] = None

    def __post_init__(self) -> None:
        if not (self.paths or self.topics or self.joints):
            raise ValueError("no rule tells which logs are this robot's: give paths, topics or joints")
        if isinstance(self.gamma_nm, str) and self.gamma_nm not in ("auto", "sharpest"):
            raise ValueError('gamma_nm is a number, a table by joint, "auto" or "sharpest"')


class FleetConfig(ConfigTable, frozen=True, kw_only=True):
    """Many robots: whose a log is, and with what it is judged."""

    robots: Annotated[
        dict[str, FleetRobot],
        about(
            "A robot of the fleet. A log is its own where every kind of rule that is given holds. A log of two is "
            "judged once for each where they have topics, or joints, of their own in it; else it is not judged, as "
            "is a log of none."
        ),
    ] = {}
