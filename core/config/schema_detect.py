"""[detect], [cycles], [near_miss] and [phases]: the rule, and when it applies."""

from typing import Annotated, Literal

from msgspec import Meta
from msgspec.structs import force_setattr

from collaudit.core.config.config_table import ConfigTable, Interval, KeyedError, Positive, about

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
