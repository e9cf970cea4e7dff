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
        "Only a part of the log was read, as --from and --to ask for.",
        "Judge the other parts too; this verdict says nothing of them.",
        {"warning": "excludes"},
        setting="log.from_s",
    ),
    "log-partial": Kind(
        "The file is damaged or still being written; only the part before the damage was read.",
        "Record again, or repair or reindex the file. What was read is judged; what is lost cannot be.",
        _PART,
    ),
    "clock-drift": Kind(
        "Two clocks of the log do not go alike: the header's drifts, was set or tells simulated time; or a signal has "
        "no stamps of the clock that times the joints.",
        "Synchronise the clocks of the machines that stamp and record, or choose one by [log] time.",
        _EITHER,
    ),
    "log-joints-missing": Kind(
        "The robot has joints that the log does not have.",
        "Map differing names by [log] joint_names; state where joints stand by [robot] parked.",
        _WARNING,
        setting="log",
    ),
    "judged-joint-missing": Kind(
        "A joint that was to be judged, or has a friction law, is not in the log.",
        "Record this joint too, or fit friction on logs without it.",
        _ABSENT,
    ),
    "log-publishers-conflict": Kind(
        "Two publishers, or two recordings in one, give different values of the same joints.",
        "Record each publisher on a topic (or in a table) of its own, and name one in [log] joint_states. Where only "
        "some samples of one stamp differ (warning), these alone are not judged.",
        {"warning": "not-judged-part", "error": "not-judged-log"},
    ),
    "log-label-missing": Kind(
        "A topic or column of labels or phases was configured and is not available.",
        "Correct the topic, field or column in [log], [log.csv] or [detect].",
        _WARNING,
    ),
    "log-message-skipped": Kind(
        "Messages were left out because they could not be decoded.",
        "Record the message definitions too, or give their folder by [log] msg_path.",
        _WARNING,
    ),
    "log-velocity-derived": Kind(
        "The log has no usable velocity (none, none of a joint, values missing, or one that a filter of the drive "
        "makes late); it was derived from position.",
        "Record the drive's unfiltered velocity. Derived velocities are noisier, and friction near rest is less "
        "certain.",
        _EITHER,
    ),
    "log-velocity-disagrees": Kind(
        "The logged velocity is not the derivative of the logged position.",
        "Check unit and sign of the velocity in [log.units]; [conditioning] velocity chooses a source.",
        _WARNING,
        setting="log",
    ),
    "log-effort-missing": Kind(
        "The log has no usable effort for a joint: no values, or one that never changes while the joint moves.",
        "Record the effort, and find out why the drive reports none; or leave the joint out of [robot] joints or "
        "[detect] watch.",
        _JOINT,
    ),
    "log-effort-saturated": Kind(
        "The effort stays at one extreme value, as a saturated drive does.",
        "Look at the drive's limit. Saturated time counts as not judged: a contact may hide there.",
        _SPAN,
    ),
    "effort-unmeasured": Kind(
        "The effort is no measurement for a while: it is constant or a straight line, has less than its usual noise "
        "while the joint moves, or is the exact copy of another stretch.",
        "Look at the sensor, the drive's bus or the logger; log gaps as gaps, and fill in nothing. The stretch is not "
        "judged: a contact may hide there.",
        _SPAN,
    ),
    "position-frozen": Kind(
        "A joint's position repeats one value while the joint moves.",
        "Look at the encoder or the logger. No joint's torque is known then; the stretch counts as not judged.",
        _SPAN,
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
        "The efforts are smoothed on their way into the log, or no motion shows how far; what would have been noticed "
        "counts what a push loses.",
        "Log the drives' unfiltered effort. Alarms count as they are; contact shorter than the filter may not show. In "
        "a log of little else than contact, a controller that yields to it looks the same. Where no motion shows it, "
        "let the log hold faster motion.",
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
        "The weight at the tool changes during the log, in all poses alike.",
        "Cut the log there, and judge each part with its [robot.tool]; or look for what pulled at the arm.",
        _SPAN,
    ),
    "payload-carried": Kind(
        "The weight at the tool comes and goes during the log.",
        "Judge what carries a load apart from what does not, each with its [robot.tool]; until then alarms may come "
        "from the load, and thresholds fitted on such motion hold it.",
        _WARNING,
    ),
    "log-nan": Kind(
        "Some values are missing: they are not numbers, or such as no arm can have.",
        "Look for the signal's gaps at its source, and at what writes the values. A row without the position of every "
        "joint counts as lost, one without a watched joint's effort as a gap of what a pass needs.",
        _WARNING,
    ),
    "log-runs": Kind(
        "A table holds several runs one after the other; each follows after a break.",
        "Nothing is filtered or judged across a break. Runs of other robots or tools belong in files of their own.",
        _WARNING,
    ),
    "log-columns-guessed": Kind(
        "Columns were recognised by their names, or numbered joints by their order, not by the configuration.",
        "Check the columns and the order of the joints; state them in [log.csv], or record the joints' names.",
        _EITHER,
        of_format=True,
    ),
    "log-arrays-left-out": Kind(
        "A file of arrays holds some with another number of rows than most: no columns of the same table.",
        "Export signals of one length, each with the same stamps.",
        _WARNING,
    ),
    "log-units-guessed": Kind(
        "A unit was assumed, not stated.", "Check the unit, and state it in [log.units].", _EITHER, setting="log.units"
    ),
    "log-unit-suspect": Kind(
        "Positions look like degrees while radians were stated, or the reverse, or like millimetres; or time is in "
        "another unit: its steps are too long, or most joints are far faster than the description allows.",
        'State the unit in [log.units]: position = "deg" or "rad"; length = "mm" or "m"; time = "s", "ms", "us" or '
        '"ns", or [log.csv] rate_hz for a column that counts rows. What is stated is then used.',
        _UNIT,
        setting="log.units",
    ),
    "friction-coupled": Kind(
        "A motor turns with several joints, and its friction could not be separated from theirs.",
        "Let the joints of the wrist move at different speeds in the fitting run.",
        _WARNING,
    ),
    "log-position-break": Kind(
        "A position goes on further than a joint can move in a step: rows are missing there whatever the stamps say, "
        "or an encoder was zeroed anew. The log is cut there.",
        "Look for a lost stretch: a contact may hide in it. Nothing is judged or filtered across the jump; a joint "
        "that jumps in more than 2 % of its steps is not judged at all.",
        {"warning": "not-judged-part", "error": "not-judged-joint"},
    ),
    "log-stalled": Kind(
        "The logger repeated one sample while the arm moved; the repeats were left out.",
        "Look at the logger: it fell behind. The repeats are no measurement: they count as a gap, in which a contact "
        "may hide.",
        _SPAN,
    ),
    "log-wrench-missing": Kind(
        "A wrench was configured, or a contact phase that needs one, and the log has none for all or a part of its "
        "time.",
        "Record the wrench over the whole run, or correct [log] wrench or [log.csv] wrench. Time that lacks a part of "
        "it counts as not judged.",
        _WARNING,
    ),
    "log-wrench-bias": Kind(
        "The zero offset of the wrench sensor: taken from the log itself, or known from poses at rest, or drifting; or "
        "what the sensor reads follows gravity, so its sign, its frame or the tool is not as stated.",
        'Check that nothing touched the tool then. [log] wrench_bias states it, or takes that of a fit: "calibrated". '
        "Where it drifts, zero or warm up the sensor before recording.",
        _EITHER,
    ),
    "time-duplicate": Kind(
        "Samples with the same stamp as another were left out: the same values again (note), or others, within noise "
        "and motion (warning).",
        "Look for a publisher or logger that writes samples twice, or for stamps that are coarser than the samples.",
        _EXCLUDES,
    ),
    "time-out-of-order": Kind(
        "Stamps ran backwards: samples were sorted, or go on after a break where the clock was set back.",
        "Look for messages that overtake one another; keep the clock from being set while recording; [log] time "
        "chooses the other clock.",
        _WARNING,
    ),
    "time-gap": Kind(
        "The log has gaps, across which nothing is judged, or stretches between gaps that are too short to be used.",
        "Look for lost samples at the recorder. Gaps count against [policy] min_coverage.",
        _WARNING,
    ),
    "time-bridged": Kind(
        "Many single lost samples were interpolated, short against the filter.",
        "Look for lost samples at the recorder; [conditioning] bridge_lost = false makes gaps of them.",
        _WARNING,
    ),
    "time-garbage": Kind(
        "Stamps that are not numbers, or no times of the recording, were left out with their rows or messages.",
        "Check what writes the stamps. What was left out counts as missing.",
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
    "effort-gain": Kind(
        "A joint's effort and the model's torque differ in scale by more than a measured torque may be wrong: contact "
        "torques are not as large as they appear, or the model's masses are wrong.",
        'Check the unit in [log.units] and the payload in [robot.tool], or fit with [fit] estimate = ["gain"].',
        {"warning": "excludes-and-doubts", "error": "not-judged-joint"},
        setting="log.units",
    ),
    "effort-scale": Kind(
        "Effort and the model's torque differ in scale on several joints: the effort is no torque in N·m, or the model "
        "is wrong.",
        "State what the effort is in [log.units], with torque constants; or check model, tool and mounting in [robot].",
        _LOG,
        setting="log.units",
    ),
    "effort-kind": Kind(
        "What the effort looks like (torque, current, inverted, doubled), from all joints together.",
        "State what it is in [log.units]: effort, torque_constant_nm_per_a, effort_sign.",
        _EITHER,
        setting="log.units",
    ),
    "effort-compensated": Kind(
        "The effort holds no gravity: the controller took it out, or it is an estimate of external torque.",
        'State [log] effort_kind = "gravity-compensated", and the model leaves gravity out. An estimate of external '
        "torque cannot be judged.",
        _LOG,
        setting="log.effort_kind",
    ),
    "effort-computed": Kind(
        "The efforts have neither noise nor friction: a controller seems to have computed them from its model.",
        "Record what was measured, and choose it with [log] joint_states or [log.csv] effort; or state [log] "
        "effort_kind if these are measured.",
        _LOG,
        setting="log.effort_kind",
    ),
    "judged-for-changes": Kind(
        "An arm that never moves, without a friction file, was judged for changes of its torque only.",
        "Fit friction on a log in which the arm moves, and judge with it: constant loads are judged then, too.",
        _SPAN,
    ),
    "effort-quantised": Kind(
        "The effort comes in steps that are coarse against its own noise.",
        "Record the effort with finer steps. A threshold of few steps is not reliable.",
        _WARNING,
    ),
    "effort-delay": Kind(
        "Effort lags or leads the motion.", "State [log] effort_delay_ms as the finding says, and fit again.", _DELAY
    ),
    "wrench-delay": Kind(
        "The wrench lags or leads the motion.", "State [log] wrench_delay_ms as the finding says.", _EITHER
    ),
    "effort-sign-unknown": Kind(
        "The motion does not load this joint enough to check the sign of its effort.",
        "Move the joint against gravity, with longer or faster strokes, to show its sign.",
        _EITHER,
    ),
    "effort-unit-raw": Kind(
        "The effort is not in N·m; thresholds in N·m cannot be judged.",
        "State unit or torque constants in [log.units]; or fit a motion that loads each joint by gravity, or with a "
        "known load: its gain is then identified.",
        _WARNING,
    ),
    "model-no-inertials": Kind(
        "The robot model has no inertials; no model torque can be computed.",
        "Configure a robot with masses and inertias. Until then friction can be fitted and nothing judged.",
        _WARNING,
        setting="robot",
    ),
    "model-joint-locked": Kind(
        "A joint of the model is not in the log, or is a gripper's by its name: it was held at zero, and is not "
        "watched.",
        "Record it, or state where it stood: [robot] parked. A gripper's joint is judged if [robot] joints names it.",
        _EXCLUDES,
        setting="robot",
    ),
    "model-joint-between": Kind(
        "A joint between judged joints is not in the log: their model torque is not known.",
        "Record this joint, or state where it stood: [robot] parked.",
        _LOG,
    ),
    "model-approximate": Kind(
        "A property of the model was left out or simplified. Of joints that carry a link without mass (error) no "
        "torque is known.",
        "Complete the robot's description if the torque matters. State 1e-9 kg of a link that has no mass in truth; or "
        'fit it: [fit] estimate = ["friction", "inertials"].',
        {"info": "none", "warning": "none", "error": "not-judged-joint"},
    ),
    "identified-doubtful": Kind(
        "What was identified does not hold: held-out data are explained worse than by the robot's description, no body "
        "can have the inertials, or the tool's mass differs between the halves of the motion.",
        "Fit on longer or more varied motion with one tool; trust the description more by a smaller [fit] cad_sd; or "
        "leave this out of [fit] estimate.",
        _WARNING,
    ),
    "friction-temperature-beyond": Kind(
        "A joint was colder or warmer than when its friction was fitted.",
        "Fit on a log at this temperature too.",
        _WARNING,
    ),
    "model-no-gain": Kind(
        "Subtracting model and friction does not make a joint's torque smaller (warning), or makes it several times as "
        "large (error): the effort shows neither.",
        "Check sign and gain of the effort, its delay and smoothing, inertials and tool, and the filter's bandwidth.",
        {"warning": "doubts-alarms", "error": "not-judged-joint"},
    ),
    "gamma-missing": Kind(
        'gamma_nm = "auto", and the friction file has no threshold for a joint.',
        "Fit again on a log without contact, with the same [detect] table and at least 10 s of motion of each joint; "
        "or state gamma_nm.",
        {"warning": "excludes", "error": "not-judged-joint"},
        setting="detect.gamma_nm",
    ),
    "fit-left-out": Kind(
        "Stretches of a log were left out of its fit: contact, a stop or a fault, found or labelled; or the whole log, "
        "since most of it is inconsistent with the rest.",
        'Nothing, if something did happen there. If the log is free of contact, state [fit] contact = "none". If '
        "nothing was fitted on it, check description, mounting, order of joints, signs and units first; else record "
        "motion without contact, or label the contacts: --truth, --labels.",
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
        "In the fitted motion a residual passes its own threshold: contact that was not recognised, or motion that the "
        "model does not explain.",
        'Judge the fitted log, and look at what alarms. If nothing touched the arm, state [fit] contact = "none": the '
        "thresholds then cover it; and fit more motion at the speeds concerned.",
        _DOUBTS,
        setting="fit.contact",
    ),
    "friction-not-physical": Kind(
        "The data fit best with physically impossible friction, which falls below a bound.",
        "Check sign, delay and unit of the effort and the robot's inertials. The fit was held at the bound.",
        _DOUBTS,
    ),
    "friction-gives-power": Kind(
        "A joint's friction gives power, in a log or as a law that was fitted: no joint has such friction, and contact "
        "in it may go unseen.",
        "Check mounting ([robot] base_rpy_deg), sign, delay and unit of the effort, and the robot's inertials, and "
        "whether the arm was led by hand.",
        {"warning": "excludes-and-doubts"},
    ),
    "friction-same-log": Kind(
        "Friction, and thresholds with it, were fitted on the log that is judged: on it alone (error) or among others.",
        "Fit on another log, without contact, and judge with that: --friction friction.json. "
        '[policy] same_log = "allow" accepts a fit on the log alone.',
        {"warning": "excludes", "error": "not-judged-part"},
        setting="policy.same_log",
    ),
    "friction-scatter": Kind(
        "Friction points scatter about the fitted curve so much that it limits the threshold.",
        "Fit on more or warmer data, correct the model, or raise the threshold of this joint.",
        _DOUBTS,
    ),
    "friction-other-model": Kind(
        "The friction was fitted with another robot model, tool or mounting.",
        "Fit again with the robot, tool and mounting of this configuration.",
        {"warning": "excludes"},
    ),
    "friction-missing": Kind(
        "A joint has no friction model: it could not be fitted, or the friction file lacks it. Its residual is not "
        "judged.",
        'Record this joint moving at several speeds both ways, or set [fit] motion = "any", and fit it; or leave it '
        "out of [detect] watch.",
        _WARNING,
    ),
    "residual-level": Kind(
        "The residual is large compared with that of the fitted logs, or with the threshold, all the time.",
        "Check that the friction file is of this arm, tool, temperature and filter of the effort; correct model or "
        "tool, or fit again.",
        _DOUBTS,
    ),
    "residual-position": Kind(
        "The residual repeats at the same positions: a spring, a cable, joints that yield, a weight that is wrong, "
        "or a contact that is made at the same place each time.",
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
    "gamma-out-of-reach": Kind(
        "A threshold lies above the joint's torque limit, or above its largest torque on record: hardly anything, or "
        "nothing, could exceed it.",
        "Lower it: collaudit recommend says what the data support; check the unit of [detect] gamma_nm.",
        {"warning": "excludes", "error": "not-judged-joint"},
        setting="detect.gamma_nm",
    ),
    "gamma-coarse": Kind(
        "A threshold is large beside the torques that the joint exerts in the log.",
        "Look at the fitted residual: contact in the fit, a wrong scale of the effort, a tool that is not configured. "
        "Fit on more motion.",
        _EXCLUDES,
        setting="detect.gamma_nm",
    ),
    "gamma-rose": Kind(
        "Automatic thresholds are several times those of the friction file that this fit replaces.",
        "Find out what changed: contact in the fitted log, the effort's scale or filter, a tool. Keep the earlier file "
        "until then.",
        _WARNING,
        setting="detect.gamma_nm",
    ),
    "persistence-long": Kind(
        "The persistence is longer than many contacts.",
        "Shorten it: [detect] persistence_ms or n; 25 ms is usual.",
        {"warning": "excludes"},
        setting="detect.n",
    ),
    "joint-not-watched": Kind(
        "A joint's residual was not judged in a phase, and why.",
        "Nothing, if that is intended; else name the joint in [detect] watch.",
        _EITHER,
    ),
    "coverage-low": Kind(
        "Less would have been noticed on a joint than the policy asks for, or for less of the time.",
        "See what friction hides and what was not judged. [policy] observable_nm, min_observable, max_hidden_s and "
        "min_coverage say what is asked.",
        _WARNING,
    ),
    "evidence-range": Kind(
        "The log leaves the range of motion, load, temperature or phase of the evidence behind a threshold.",
        "Recommend the threshold anew from logs that cover such motion (collaudit recommend): alarms out of the range "
        "may be false.",
        _LEVEL,
        setting="detect.evidence",
    ),
    "friction-level": Kind(
        "Friction differed from its calibration, in its level or in the place of its gear ripple; it was followed, or "
        "could not be. A ripple that is not in place raises the threshold.",
        "Fit the friction anew when it is far off its calibration, or the joint was opened or counts from another "
        "zero.",
        _LEVEL,
    ),
    "torque-zero": Kind(
        "The zero of a joint's torque is not where the fit had it: it was followed, at most by a quarter of an "
        "automatic threshold.",
        "Where it is further off (warning): bring the sensor's zero back, state a payload, or look for a lasting "
        "contact.",
        _EITHER,
    ),
    "detector-slow": Kind(
        "The detector's filter is slow: a push as long as n must exceed gamma by far.",
        'Raise [detect] observer_gain_per_s or [conditioning] bandwidth_hz, or, with another detector, use "direct".',
        _WARNING,
    ),
    "event-cut": Kind(
        "A residual above the threshold ran into a stretch that is not judged: an event may hide there.",
        "Inspect this stretch; avoid saturation and gaps in the next recording.",
        _SPAN,
    ),
    "unjudged-effort": Kind(
        "In time that is not judged the recorded efforts lie several thresholds beyond what model and friction allow "
        "at the nearest known motion.",
        "Inspect these times. A recording without missing values and with every row judges them.",
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
        'State phases in [phases] or [log] phase_topic; [phases] find = "wrench" guesses them.',
        _EXCLUDES,
    ),
    "phases-outside": Kind(
        "Configured phases do not fit the log: they lie outside it, or force was commanded outside the contact phase.",
        "Correct [phases]: times count from the log's first sample, and force_control lies in the contact phase.",
        _WARNING,
    ),
    "tool-force-unusual": Kind(
        "The tool's force exceeded what was usual or allowed in contact; the excess was judged, or all of a contact "
        "that was found and is unlike others.",
        "Look at what the tool met; [phases] force_limit_n states what is allowed, contact when it is intended.",
        _WARNING,
    ),
}
