"""Findings: stated facts about data quality, each with a stable code."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Severity = Literal["info", "warning", "error"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One stated fact about the data or about a choice that was made for the user.

    Attributes:
        code: stable, kebab-case, listed in :data:`CODES`.
        severity: ``info`` is worth knowing, ``warning`` limits trust, ``error`` forbids judging.
        text: one sentence with quantities and units.
        where: file, topic, column or channel, when there is one.
        joint: the joint concerned, when there is one.
        start_s: start of the stretch concerned, seconds from the log's first sample.
        end_s: its end.
    """

    code: str
    severity: Severity
    text: str
    where: str | None = None
    joint: str | None = None
    start_s: float | None = None
    end_s: float | None = None

    def __post_init__(self) -> None:
        if self.code not in CODES:
            raise ValueError(f"unknown finding code {self.code!r}: add it to core.findings.CODES")


#: Every finding code with what it means; ``docs/findings.md`` is generated from this table.
CODES: dict[str, str] = {
    "log-partial": "The file is damaged or still being written; only the part before the damage was read.",
    "log-summary-only": "Only a file's summary was read; gaps and damage inside it were not looked for.",
    "log-time-source": "Which clock was used as the time of a sample (header or log), and why.",
    "clock-drift": "The header's clock runs faster or slower than the recording's.",
    "clock-publish": "The stamps of publishing differ from those of recording.",
    "clock-jump": "The header's clock jumps against the recording's, or wraps around.",
    "clock-simulated": "The header's stamps do not count from the epoch: simulated time, or time since start.",
    "log-joints-ignored": "The log has joints that the robot model does not have.",
    "log-joints-missing": "The robot has joints that the log does not have.",
    "judged-joint-missing": "A joint that was to be judged, or has a friction law, is not in the log.",
    "log-joints-merged": "Joints came from several publishers or files and were merged by name.",
    "log-publishers-conflict": "Publishers on one topic give different values of the same joints.",
    "log-joints-numbered": "Messages number the joints and do not name them; the robot's order was taken.",
    "log-label": "The robot's controller itself raised a flag (contact, collision) in this stretch.",
    "log-label-missing": "A topic or column of labels or phases was configured and cannot be had.",
    "log-message-skipped": "Messages were left out because they could not be decoded.",
    "log-velocity-derived": "The log has no usable velocity; it was derived from position.",
    "log-velocity-disagrees": "The logged velocity is not the derivative of the logged position.",
    "log-velocity-late": "The logged velocity lags behind the positions, as one that the drive filters does.",
    "log-effort-missing": "The log has no usable effort for a joint.",
    "log-effort-constant": "The effort of a moving joint never changes.",
    "log-effort-saturated": "The effort stays at one extreme value, as a saturated drive does.",
    "log-nan": "Some values are not numbers; these samples are not judged.",
    "log-columns-guessed": "CSV columns were recognised by their names, not by the configuration.",
    "log-units-guessed": "A unit was assumed, not stated.",
    "log-position-unit-suspect": "Positions look like degrees while radians were stated, or the reverse.",
    "log-stalled": "The logger repeated one sample while the arm moved; the repeats were left out.",
    "log-wrench-missing": "A wrench was configured and is not in the log.",
    "log-wrench-bias": "The zero offset of the wrench sensor was taken from the log itself.",
    "log-wrench-partial": "The wrench does not cover the whole log.",
    "time-duplicate": "Samples with the same stamp as another were left out.",
    "time-jump-back": "The clock was set back while recording; time goes on after a break.",
    "time-out-of-order": "Stamps ran backwards; samples were sorted.",
    "time-gap": "The log has gaps; nothing is judged across them.",
    "time-jitter": "Stamps are unevenly spaced; how the uniform time base was made.",
    "time-not-finite": "Stamps that are not numbers were left out.",
    "time-too-short": "A stretch between gaps is too short to be used.",
    "effort-sign-inverted": "Effort runs against the model's gravity torque: its sign looks inverted.",
    "effort-gain": "Effort and the model's gravity torque differ in scale: it may not be in N·m.",
    "effort-kind": "What the effort looks like (torque, current, inverted, doubled), from all joints together.",
    "effort-quantised": "The effort comes in steps that are coarse against its own noise.",
    "effort-delay": "Effort lags or leads the motion.",
    "wrench-delay": "The wrench lags or leads the motion.",
    "wrench-calibration": "Offset, tool weight and centre of mass of the wrist sensor from static poses.",
    "wrench-drift": "The zero of the wrist sensor drifts over the log.",
    "effort-sign-unknown": "The motion does not load this joint enough to check the sign of its effort.",
    "effort-unit-raw": "The effort is not in N·m; thresholds in N·m cannot be judged.",
    "model-no-inertials": "The robot model has no inertials; no model torque can be computed.",
    "model-joint-locked": "A joint of the model is not in the log and was held at zero.",
    "model-joint-between": "A joint between judged joints is not in the log: their model torque is not known.",
    "model-approximate": "A property of the model was left out or simplified.",
    "identified-used": "Gains, offsets, inertials or a tool from the friction file were used.",
    "identified-tool-changed": "The tool's mass differs between the halves of the motion.",
    "identified-worse": "What was identified explains time left out worse than the robot's description does.",
    "identified-not-possible": "Identified inertials belong to no physically possible body.",
    "friction-warm-up": "Friction changes with running time.",
    "friction-temperature": "Friction changes with the joint's temperature.",
    "friction-temperature-used": "Friction was taken at the joint's temperature, as the friction file knows it.",
    "friction-temperature-beyond": "A joint was colder or warmer than when its friction was fitted.",
    "friction-temperature-missing": "The friction file knows friction against temperature, and the log has none.",
    "friction-load": "Friction changes with the load on the gear.",
    "friction-ripple": "A ripple of the gear over position explains part of the residual.",
    "friction-any-motion": "Friction was read off any motion, for want of constant-velocity sections.",
    "friction-not-fitted": "A joint's friction could not be fitted.",
    "friction-not-identifiable": "The data cannot tell some friction parameters apart.",
    "friction-same-log": "Friction was fitted on the log that is judged with it.",
    "friction-model-points": "Friction points rest on the model's torque, not on a pair of directions.",
    "friction-scatter": "Friction points scatter about the fitted curve so much that it limits the threshold.",
    "friction-other-model": "The friction was fitted with another robot model, tool or mounting.",
    "friction-missing": "A joint has no friction model; its residual is not judged.",
    "residual-level": "The residual is large compared with the threshold all the time.",
    "persistence-rounded": "The persistence was rounded up to whole samples.",
    "joint-not-watched": "A joint's residual was not judged in a phase, and why.",
    "coverage-low": "A large part of the motion could not be judged.",
    "recommend-little-data": "A recommendation rests on little data.",
    "friction-level": "Friction was off its calibration; its level was followed, or could not be.",
    "detector-slow": "The detector's filter is slow: a push as long as n must exceed gamma by far.",
    "event-cut": "A residual above the threshold ran into a stretch that is not judged: an event may hide there.",
    "hidden-at-rest": "A standing joint hides external torque up to about its breakaway friction.",
    "phases-unknown": "No phases were given; the whole log is one free phase.",
    "phases-found": "Phases were found from the wrench or in the log, not configured.",
    "phases-outside": "Configured phases lie outside the log.",
    "tool-force-unusual": "The tool's force stood out of what was usual or allowed in contact; the excess was judged.",
    "force-outside-contact": "Force was commanded outside the contact phase (eq. 1).",
}
