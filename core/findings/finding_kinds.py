"""The table of findings: what each code means, what it does to coverage and verdict, and what to do about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Severity = Literal["info", "warning", "error"]
#: What a finding does to coverage and verdict. With any ``not-judged-*`` the log does not pass.
#:
#: - ``excludes``: a kind of contact cannot be seen; a pass says that it does not cover it.
#: - ``doubts-alarms``: alarms of the joint may be errors of the model; the verdict says so.
#: - ``excludes-and-doubts``: both: a pass does not cover some contact, and an alarm may be an error of the model.
#: - ``not-judged-part``: a part of the log could not be judged; the rest is, and a contact in it counts.
#: - ``not-judged-joint``: nothing of the joint is judged, or of all where it names none.
#: - ``not-judged-log``: nothing of the log is judged.
Effect = Literal[
    "none",
    "excludes",
    "doubts-alarms",
    "excludes-and-doubts",
    "not-judged-part",
    "not-judged-joint",
    "not-judged-log",
]


@dataclass(frozen=True, slots=True)
class Kind:
    """What a finding's code stands for.

    Attributes:
        meaning: one sentence.
        remedy: what to do about it, one or two sentences.
        effects: the severities it comes with, and its effect with each.
        setting: key of the configuration, or table, that can mend it.
        of_format: it speaks of the file's format and not of the run: the same run in another format may lack it.
    """

    meaning: str
    remedy: str
    effects: Mapping[Severity, Effect]
    setting: str | None = None
    of_format: bool = False


_INFO: Mapping[Severity, Effect] = {"info": "none"}
_WARNING: Mapping[Severity, Effect] = {"warning": "none"}
_EITHER: Mapping[Severity, Effect] = {"info": "none", "warning": "none"}
_EXCLUDES: Mapping[Severity, Effect] = {"info": "none", "warning": "excludes"}
_DOUBTS: Mapping[Severity, Effect] = {"warning": "doubts-alarms"}
_LEVEL: Mapping[Severity, Effect] = {"info": "none", "warning": "doubts-alarms"}
_SPAN: Mapping[Severity, Effect] = {"warning": "not-judged-part"}
_PART: Mapping[Severity, Effect] = {"warning": "not-judged-part", "error": "not-judged-part"}
_JOINT: Mapping[Severity, Effect] = {"warning": "none", "error": "not-judged-joint"}
_ABSENT: Mapping[Severity, Effect] = {"error": "not-judged-joint"}
_LOG: Mapping[Severity, Effect] = {"error": "not-judged-log"}
_UNIT: Mapping[Severity, Effect] = {"warning": "doubts-alarms", "error": "not-judged-log"}
_DELAY: Mapping[Severity, Effect] = {"info": "none", "warning": "none", "error": "not-judged-log"}

#: Code of what is stated and leaves nothing to do.
FACT = "fact"

#: Every finding code; ``docs/findings.md`` is generated from this table.
#:
#: Time that cannot be judged for want of a signal, a friction law or a model has a state of its own and counts in the
#: coverage: findings that only report it have no effect beside that.
KINDS: dict[str, Kind] = {
    FACT: Kind(
        "A fact about the log, or a choice that was made: it changes no verdict.",
        "Nothing. collaudit inspect -v and the report list facts.",
        _INFO,
        of_format=True,
    ),
    "part-of-log": Kind(
        "Only a part of the log was read, as [log] from_s and to_s (--from, --to) ask for.",
        "Judge the other parts too; this verdict says nothing of them.",
        {"warning": "excludes"},
        setting="log.from_s",
    ),
    "log-partial": Kind(
        "The file is damaged or still being written; only the part before the damage was read.",
        "Record again, or repair or reindex the file. What was read is judged; what is lost cannot be.",
        _PART,
    ),
    "log-clock": Kind(
        "Stamps ran backwards, so samples were sorted or go on after a break; or two clocks of the log do not go "
        "alike: the header's drifts, was set or tells simulated time, or a signal has no stamps of the clock that "
        "times the joints.",
        "Synchronise the clocks of the machines that stamp and record; look for messages that overtake one "
        "another; or choose the other clock by [log] time.",
        _EITHER,
    ),
    "log-joints-missing": Kind(
        "The robot, a friction law or what was to be judged has joints that the log does not have.",
        "Record these joints too, or map differing names by [log] joint_names; state where joints stand by [robot] "
        "parked. Joints that are to be judged and missing (error) can also be left out of the fit.",
        _JOINT,
        setting="log",
    ),
    "log-publishers-conflict": Kind(
        "Two publishers, or two recordings in one, give different values of the same joints.",
        "Record each publisher on a topic (or in a table) of its own, and name one in [log] joint_states. Where only "
        "some samples of one stamp differ (warning), these alone are not judged.",
        {"warning": "not-judged-part", "error": "not-judged-log"},
    ),
    "log-label-missing": Kind(
        "Labels or phases were configured and do not fit the log: their topic or column is not available, they lie "
        "outside it, or force was commanded outside the contact phase.",
        "Correct the topic, field or column in [log], [log.csv] or [detect]; or [phases]: times count from the log's "
        "first sample, and force_control lies in the contact phase.",
        _WARNING,
    ),
    "log-left-out": Kind(
        "Parts of the file were left out: messages that could not be decoded, or arrays with another number of rows "
        "than most, which are no columns of the same table.",
        "Record the message definitions too, or give their folder by [log] msg_path; export signals of one length, "
        "each with the same stamps.",
        _WARNING,
    ),
    "log-velocity": Kind(
        "The logged velocity is not the derivative of the logged position, or the log has no usable one and it was "
        "derived from position.",
        "Record the drive's unfiltered velocity, and check its unit and sign in [log.units]; [conditioning] "
        "velocity chooses a source. Derived velocities are noisier.",
        _EITHER,
        setting="log",
    ),
    "log-effort-missing": Kind(
        "The log has no usable effort for a joint: no values, or one that never changes while the joint moves.",
        "Record the effort, and find out why the drive reports none; or leave the joint out of [robot] joints or "
        "[detect] watch.",
        _JOINT,
    ),
    "not-measured": Kind(
        "A signal is no measurement for a while. An effort stays at one extreme value, is a straight line, loses "
        "its noise in motion, or copies another stretch; a position stands still in motion, or jumps; or the "
        "logger repeated a sample.",
        "Look at the sensor, the drive's limit or bus, or the logger; log gaps as gaps, and fill in nothing. The "
        "stretch is not judged: a contact may hide there. A joint that jumps in more than 2 % of its steps is not "
        "judged at all.",
        {"warning": "not-judged-part", "error": "not-judged-joint"},
    ),
    "arm-stopped": Kind(
        "The arm was stopped: its controller says so (protective, emergency or user stop), or it braked and its drives "
        "went off. Nothing is judged from then on, until it runs again.",
        "Find out what stopped the arm; look for a contact just before. None can be seen in the log while it stands.",
        _SPAN,
    ),
    "arm-guided": Kind(
        "The arm was guided by hand (freedrive): the log says so (note), or the arm moves while its drives only hold "
        "its weight (warning). Not judged there.",
        "Nothing, if that was intended; with the mode in the log, or a label `freedrive`, a pass is possible. If "
        'nobody guided the arm, state [detect] hand_guiding = "off", and the stretch is judged.',
        {"info": "none", "warning": "not-judged-part"},
        setting="detect.hand_guiding",
    ),
    "effort-filtered": Kind(
        "The efforts are smoothed on their way into the log, or no motion shows how far (what would have been noticed "
        "counts what a push loses); or they come in steps that are coarse against their own noise.",
        "Log the drives' unfiltered effort, in finer steps. Alarms count as they are; contact shorter than the "
        "filter may not show. Where no motion shows it, let the log hold faster motion.",
        _EXCLUDES,
    ),
    "effort-spikes": Kind(
        "Alarms surround single samples of an effort that lie far off both of their neighbours.",
        "Look for faults of the channel (a bus, a driver, a logger), or for shocks of the arm. The alarms count.",
        _DOUBTS,
    ),
    "effort-switched": Kind(
        "A joint's effort changes its unit or its sign in the middle of the log.",
        "Look at what was set on the drive or recorder then; cut the log there, and judge each part with its unit.",
        _ABSENT,
    ),
    "payload-changed": Kind(
        "The weight at the tool changes during the log in all poses alike (error), or comes and goes (warning).",
        "Cut the log there, or judge what carries a load apart from what does not, each with its [robot.tool]; or "
        "look for what pulled at the arm. Until then alarms may come from the load.",
        {"warning": "none", "error": "not-judged-part"},
    ),
    "load-estimated": Kind(
        'The load at the tool was told by the judged log itself, as `mass_kg = "estimate"` asks.',
        "Compare it with what the arm carried, and state that in [robot.tool]: who hangs on the tool like a weight for "
        "the whole log is taken for a load.",
        {"warning": "excludes"},
        setting="robot.tool.mass_kg",
    ),
    "log-nan": Kind(
        "Some values or stamps are missing: they are not numbers, such as no arm can have, or no times of the "
        "recording.",
        "Look for the gaps at the signal's source. A row without a stamp or the position of every joint counts as "
        "lost, one without a watched joint's effort as a gap of what a pass needs.",
        _WARNING,
    ),
    "log-guessed": Kind(
        "Something was assumed, not stated: columns by their names, numbered joints by their order, or a unit.",
        "Check it, and state it in [log.csv] or [log.units], or record the joints' names.",
        _EITHER,
        setting="log.units",
        of_format=True,
    ),
    "log-unit-suspect": Kind(
        "Positions look like degrees while radians were stated, or the reverse, or like millimetres; or time is in "
        "another unit: its steps are too long, or most joints are far faster than the description allows.",
        'State the unit in [log.units]: position = "deg" or "rad"; length = "mm" or "m"; time = "s", "ms", "us" or '
        '"ns", or [log.csv] rate_hz for a column that counts rows. What is stated is then used.',
        _UNIT,
        setting="log.units",
    ),
    "fit-doubtful": Kind(
        "What was to be fitted could not be, or does not hold: a joint's friction (its residual is not judged then), "
        "or that of a motor that turns with several joints; inertials that explain held-out data worse than the "
        "robot's description or that no body can have; a tool whose mass differs between the halves of the motion.",
        "Fit on longer or more varied motion with one tool, each joint at several speeds both ways; or leave this "
        "out of [fit] estimate or the joint out of [detect] watch.",
        _WARNING,
    ),
    "log-wrench": Kind(
        "The wrench is missing, for a part of the time or all of it; its zero was taken from the log itself or "
        "from poses at rest, or drifts; it lags or leads the motion; or it follows gravity, so its sign, its frame "
        "or the tool is not as stated.",
        "Record the wrench over the whole run, or correct [log] wrench or [log.csv] wrench: time that lacks a part of "
        "it counts as not judged. Check that nothing touched the tool when its zero was taken: [log] wrench_bias "
        'states it, or takes that of a fit: "calibrated". Where it drifts, zero or warm up the sensor before '
        "recording. State [log] wrench_delay_ms as the finding says.",
        _EITHER,
    ),
    "time-duplicate": Kind(
        "Samples with the same stamp as another were left out: the same values again (note), or others, within noise "
        "and motion (warning).",
        "Look for a publisher or logger that writes samples twice, or for stamps that are coarser than the samples.",
        _EXCLUDES,
    ),
    "time-gap": Kind(
        "Samples were lost, or a table holds several runs: gaps, across which nothing is filtered or judged; "
        "stretches too short to be used; or many single samples, which were interpolated.",
        "Look for lost samples at the recorder. Gaps count against [policy] min_coverage. Runs of other robots or "
        "tools belong in files of their own.",
        _WARNING,
    ),
    "effort-sign-inverted": Kind(
        "Effort runs against the model's gravity torque, or along the motion where friction opposes it: its sign looks "
        "inverted.",
        "Check model, mounting ([robot] base_rpy_deg) and joint names; then state [log.units] effort_sign: -1 if it is "
        "inverted, 1 if not.",
        _JOINT,
        setting="log.units.effort_sign",
    ),
    "base-mounting": Kind(
        "By the efforts the base is mounted in another way than [robot] base_rpy_deg states.",
        "Look at the arm. If it is mounted so, paste the line; if not, look at joint names and description.",
        {"warning": "excludes", "error": "not-judged-log"},
        setting="robot.base_rpy_deg",
    ),
    "effort-gain": Kind(
        "A joint's effort and the model's torque differ in scale by more than a measured torque may be wrong: contact "
        "torques are not as large as they appear, or the model's masses are wrong.",
        'Check the unit in [log.units] and the payload in [robot.tool], or fit with [fit] estimate = ["gain"].',
        {"warning": "excludes-and-doubts", "error": "not-judged-joint"},
        setting="log.units",
    ),
    "effort-no-torque": Kind(
        "The effort is no measured torque of the joints in N·m: it differs from the model's in scale on several "
        "joints; it holds no gravity, since the controller took it out or it estimates external torque; it has neither "
        "noise nor friction, as what a controller computes; or it is a magnitude, without its sign.",
        'State what the effort is: [log.units] with torque constants, or [log] effort_kind ("gravity-compensated": the '
        "model leaves gravity out). Record what was measured, and choose it with [log] joint_states or [log.csv] "
        "effort; check model, tool and mounting in [robot]. An estimate of external torque cannot be judged.",
        _LOG,
        setting="log.units",
    ),
    "effort-kind": Kind(
        "The effort is not in N·m, and thresholds in N·m cannot be judged; or the motion does not load a joint enough "
        "to tell its gain.",
        "State what it is in [log.units]: effort, torque_constant_nm_per_a, effort_sign; or fit a motion that loads "
        "each joint by gravity, or with a known load: its gain is then identified.",
        _EITHER,
        setting="log.units",
    ),
    "judged-for-changes": Kind(
        "An arm that never moves, without a friction file, was judged for changes of its torque only.",
        "Fit friction on a log in which the arm moves, and judge with it: constant loads are judged then, too.",
        _SPAN,
    ),
    "effort-delay": Kind(
        "Effort lags or leads the motion.", "State [log] effort_delay_ms as the finding says, and fit again.", _DELAY
    ),
    "model-approximate": Kind(
        "The model has no inertials, or a property of it was left out or simplified. Of joints that carry a link "
        "without mass (error) no torque is known.",
        "Complete the robot's description: without masses and inertias friction can be fitted and nothing judged. "
        'State 1e-9 kg of a link that has no mass in truth; or fit it: [fit] estimate = ["friction", "inertials"].',
        {"info": "none", "warning": "none", "error": "not-judged-joint"},
        setting="robot",
    ),
    "model-joint-missing": Kind(
        "A joint of the model is not in the log, or is a gripper's by its name: it was held at zero, and is not "
        "watched. Of joints with such a joint between them (error) the model torque is not known.",
        "Record it, or state where it stood: [robot] parked. A gripper's joint is judged if [robot] joints names it.",
        {"info": "none", "warning": "excludes", "error": "not-judged-log"},
        setting="robot",
    ),
    "evidence-range": Kind(
        "The log leaves the range of motion, load or temperature of the evidence behind a threshold or a friction law.",
        "Recommend the threshold anew from logs that cover such motion (collaudit recommend), or fit at this "
        "temperature too: alarms out of the range may be false.",
        _LEVEL,
    ),
    "residual-level": Kind(
        "The residual is large all the time: compared with that of the fitted logs, with the threshold, with the "
        "scatter of friction points that it allows, or with the torque itself (several times as large: error).",
        "Check that the friction file is of this arm, tool, temperature and filter of the effort, and the effort's "
        "sign, gain and delay; correct model or tool, or fit again on more data.",
        {"warning": "doubts-alarms", "error": "not-judged-joint"},
    ),
    "rule-unfit": Kind(
        'The rule cannot show what it should: a threshold is missing (gamma_nm = "auto", and the friction file has '
        "none), lies far above the arm's torques or a joint's limit, or is large beside the joint's torques; or the "
        "detector's filter is slow, so that a push as long as n must exceed gamma by far.",
        "Missing: fit again on a log without contact with at least 10 s of motion of each joint, or state "
        "gamma_nm. Large: ask collaudit recommend; look for contact in the fit, a wrong scale, a missing tool. "
        'Slow filter: raise [conditioning] bandwidth_hz, or detector = "direct".',
        {"info": "none", "warning": "excludes", "error": "not-judged-joint"},
        setting="detect.gamma_nm",
    ),
    "fit-left-out": Kind(
        "Stretches of a log were left out of its fit: contact, a stop or a fault, found or labelled; or the whole log, "
        "since most of it is inconsistent with the rest.",
        'Nothing, if something did happen there. If the log is free of contact, state [fit] contact = "none". If '
        "nothing was fitted on it, check description, mounting, order of joints, signs and units first; else record "
        "motion without contact, or label the contacts: --truth, [detect] true_events.",
        _EITHER,
        setting="fit.contact",
    ),
    "fit-contact-suspected": Kind(
        "A log that is stated to be free of contact, or labelled, has stretches that look like contact.",
        "Look at these times. If something was touched, label it, or let the fit look for it.",
        {"warning": "excludes"},
        setting="fit.contact",
    ),
    "fit-exceeded": Kind(
        "In the fitted motion a residual passes its own threshold, or automatic thresholds are several times those "
        "of the friction file that this fit replaces: unrecognised contact, motion that the model does not "
        "explain, or an arm that changed.",
        "Judge the fitted log, and look at what alarms; find out what changed (the effort's scale or filter, a "
        'tool), and keep the earlier file until then. If nothing touched the arm, state [fit] contact = "none": '
        "the thresholds then cover it.",
        _DOUBTS,
        setting="fit.contact",
    ),
    "friction-not-physical": Kind(
        "A joint's friction gives power, in a log or as a law that was fitted, or fits best when it falls below a "
        "bound: no joint has such friction, and contact in it may go unseen.",
        "Check mounting ([robot] base_rpy_deg), sign, delay and unit of the effort, and the robot's inertials, and "
        "whether the arm was led by hand.",
        {"warning": "excludes-and-doubts"},
    ),
    "friction-same-log": Kind(
        "Friction, and thresholds with it, were fitted on the log that is judged: on it alone (error), on its other "
        "parts, or on other logs too.",
        "Fit on another log, without contact, and judge with that: --friction friction.json. Without another log, "
        '[policy] same_log = "folds" judges each part by a fit of the others; "allow" accepts a fit on the log alone.',
        {"warning": "excludes", "error": "not-judged-part"},
        setting="policy.same_log",
    ),
    "friction-other-model": Kind(
        "The friction was fitted with another robot model, tool or mounting.",
        "Nothing where tools alone differ, and each log carries the one that is stated for it. Else fit again with the "
        "robot and mounting of this configuration.",
        {"warning": "excludes"},
    ),
    "residual-position": Kind(
        "The residual repeats at the same positions: a spring, a cable, joints that yield, a wrong weight, or a "
        "contact at one place.",
        'Correct masses and tool ([fit] estimate = ["friction", "inertials"]); look for what pulls on the joint. '
        "Alarms at these positions are in doubt.",
        _LEVEL,
    ),
    "gamma-too-tight": Kind(
        "A stated threshold is below what the residual reaches without contact: that of the fitted logs, or a still "
        "joint's own torque noise.",
        'State [detect] gamma_nm = "auto", which takes the thresholds of the fit or of the log; for lower ones, '
        'correct the model (payload, springs, cables, [fit] estimate = ["friction", "inertials"]) and fit again.',
        _DOUBTS,
        setting="detect.gamma_nm",
    ),
    "coverage-low": Kind(
        "A joint's residual was not judged in a phase, and why; or less would have been noticed on it than the policy "
        "asks for, or for less of the time.",
        "Name the joint in [detect] watch if it is to be judged. See what friction hides and what was not judged: "
        "[policy] observable_nm, observable_share, max_hidden_s and min_coverage say what is asked.",
        _EITHER,
    ),
    "friction-level": Kind(
        "Friction, or the zero of a joint's torque, differed from its calibration, in its level or in the place of its "
        "gear ripple; it was followed (a zero at most by a quarter of an automatic threshold), or could not be. A "
        "ripple that is not in place raises the threshold.",
        "Where it is far off its calibration (warning), or the joint was opened or counts from another zero: fit the "
        "friction anew, bring the sensor's zero back, state a payload, or look for a lasting contact.",
        _LEVEL,
    ),
    "event-cut": Kind(
        "In time that is not judged an event may hide: a residual above the threshold ran into it, or the recorded "
        "efforts lie several thresholds beyond what model and friction allow at the nearest known motion.",
        "Inspect these times; avoid saturation, missing values and gaps in the next recording.",
        _SPAN,
    ),
    "disturbed-at-rest": Kind(
        "A standing joint was pushed or released: it gave way, and its drive pushed back.",
        "Inspect these times. [policy] max_disturbed_at_rest accepts as many as a cell's work makes.",
        {"warning": "excludes", "error": "not-judged-part"},
        setting="policy.max_disturbed_at_rest",
    ),
    "phases-unknown": Kind(
        "When contact is intended is not known, was found from the force alone, or is not known of all of the log.",
        'State phases in [phases] or [log] phase; [phases] find = "wrench" guesses them.',
        _EXCLUDES,
    ),
}

#: Codes of files that earlier versions wrote, and what stands for them.
RENAMED: Mapping[str, str] = {
    "clock-drift": "log-clock",
    "judged-joint-missing": "log-joints-missing",
    "log-message-skipped": "log-left-out",
    "log-velocity-derived": "log-velocity",
    "log-velocity-disagrees": "log-velocity",
    "log-effort-saturated": "not-measured",
    "effort-unmeasured": "not-measured",
    "position-frozen": "not-measured",
    "payload-carried": "payload-changed",
    "log-runs": "time-gap",
    "log-columns-guessed": "log-guessed",
    "log-arrays-left-out": "log-left-out",
    "log-units-guessed": "log-guessed",
    "friction-coupled": "fit-doubtful",
    "log-position-break": "not-measured",
    "log-stalled": "not-measured",
    "log-wrench-missing": "log-wrench",
    "log-wrench-bias": "log-wrench",
    "time-out-of-order": "log-clock",
    "time-bridged": "time-gap",
    "time-garbage": "log-nan",
    "effort-scale": "effort-no-torque",
    "effort-compensated": "effort-no-torque",
    "effort-computed": "effort-no-torque",
    "effort-quantised": "effort-filtered",
    "wrench-delay": "log-wrench",
    "effort-unit-raw": "effort-kind",
    "effort-sign-unknown": "effort-kind",
    "model-no-inertials": "model-approximate",
    "model-joint-locked": "model-joint-missing",
    "model-joint-between": "model-joint-missing",
    "identified-doubtful": "fit-doubtful",
    "friction-temperature-beyond": "evidence-range",
    "model-no-gain": "residual-level",
    "gamma-missing": "rule-unfit",
    "friction-gives-power": "friction-not-physical",
    "friction-scatter": "residual-level",
    "friction-missing": "fit-doubtful",
    "gamma-out-of-reach": "rule-unfit",
    "gamma-coarse": "rule-unfit",
    "gamma-rose": "fit-exceeded",
    "persistence-long": "rule-unfit",
    "joint-not-watched": "coverage-low",
    "torque-zero": "friction-level",
    "detector-slow": "rule-unfit",
    "unjudged-effort": "event-cut",
    "phases-outside": "log-label-missing",
    "tool-force-unusual": FACT,
}
