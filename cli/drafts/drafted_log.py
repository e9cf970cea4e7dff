"""One drafted configuration, tried on its log, with what is missing; and of a log of several arms one for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from collaudit.cli.drafts.catalogue import add_proposals
from collaudit.cli.drafts.config_text import Line, Section, document
from collaudit.cli.drafts.draft import Draft, Known
from collaudit.cli.drafts.draft_evidence import (
    add_channel_facts,
    add_effort_kind,
    add_rest_threshold,
)
from collaudit.cli.drafts.trial import Trial, missing, try_again, try_log
from collaudit.core.api import LogFiles
from collaudit.core.config import load_config, parse_config
from collaudit.core.config.schema import FleetConfig, PolicyConfig
from collaudit.core.errors import CollauditError
from collaudit.core.logs.log_guess import Arm, arms_of, same_arm
from collaudit.core.prepare.effort_kind import smooth_joints
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.small_files import KeyPath

_SOURCE = "gravity and inertia of the robot's description"
_TELLS = "motion that lifts what the joint carries, from a pose where gravity loads it, or a known load at the tool"
#: Answers that are tried, each of which reads the log once more.
_MOST = 6
#: What chooses the signals of one arm: where it is stated, nothing is to be told apart.
_CHOSEN_LOG, _CHOSEN_ROBOT = {"joint_states", "joint_names"}, {"joints"}


@dataclass(frozen=True, slots=True)
class Drafted:
    """A configuration, its trial, and what keeps the log from being judged with it."""

    text: str
    trial: Trial
    missing: Sequence[str]


def drafted(known: Known, output: Path | None, *, of_fleet: bool = False) -> Drafted:
    """A configuration for a log.

    Args:
        known: of log and robot.
        output: file that it will be written to.
        of_fleet: whether another file names this one, which then holds the policy.

    Raises:
        CollauditError: no line of a configuration would make the log readable.
    """
    loaded, files, summary = known.loaded, known.files, known.summary
    if of_fleet:
        loaded = replace(loaded, config=loaded.config.changed({"policy": PolicyConfig(), "fleet": FleetConfig()}))
    draft = Draft(replace(known, loaded=loaded), output.parent if output is not None else Path())
    if of_fleet:
        del draft.sections["policy"]
    place = output or Path("collaudit.toml")
    efforts = known.columns is not None and {*known.columns.open} == {"effort"}  # those are told apart without a robot
    if draft.problems and (efforts or known.robot is not None):
        _try_choices(draft, files, place)
    currents = _leave_currents(draft.sections["log.units"])
    trial = try_log(files, parse_config(draft.text(), place))
    if currents is not None and _add_torque_constants(draft, currents, trial):
        trial = try_log(files, parse_config(draft.text(), place))
    if trial.obstacle is not None and not summary.csv_columns and not draft.problems:
        raise trial.obstacle  # no line of a configuration would mend this; naming columns or joints may
    if trial.obstacle is not None and summary.csv_columns and not draft.problems:
        draft.sections["log.csv"].remarks.append("MISSING: " + " ".join(trial.obstacle.render().split()))
    if trial.prepared is not None and add_effort_kind(draft.sections, trial.prepared):
        trial = try_again(trial, parse_config(draft.text(), place))
    if trial.prepared is not None:
        delays = add_channel_facts(draft.sections, trial.prepared, loaded.config)
        resting = add_rest_threshold(draft.sections, trial.prepared)
        if delays or resting:
            trial = try_again(trial, parse_config(draft.text(), place))
    proposed = add_proposals(draft, trial) if known.robot is None else []
    draft.remark(trial.findings)
    text = draft.text()
    parse_config(text, output)
    return Drafted(text, trial, [*missing(trial, draft.problems, robot=known.robot is not None), *proposed])


def _try_choices(draft: Draft, files: LogFiles, place: Path) -> None:
    """Try each answer by itself and write beside it what the model says of the effort.

    That decides nothing: a heavy tool or a strange scale may speak against the right answer. Only of several groups of
    efforts the one that is measured is taken, where the others lack a sensor's noise and any friction.

    Args:
        draft: with questions.
        files: of the log.
        place: where the file will lie.
    """
    text, measured, computed = draft.text(), list[object](), list[object]()
    choices = [(name, section, k) for name, section in draft.sections.items() for k in range(len(section.lines))]
    choices = [(name, section, k) for name, section, k in choices if section.lines[k].choice]
    for name, section, k in choices[:_MOST]:
        line = section.lines[k]
        trial = try_log(files, parse_config(text, place, {f"{name}.{line.key}": line.value}), audit=False)
        prepared, words = trial.prepared, "not enough by itself"
        if prepared is not None:
            words = _evidence(prepared)
            smooth = smooth_joints(prepared.series) >= {*prepared.judged} and not prepared.upright
            (computed if smooth else measured).append(line.value)
        elif trial.obstacle is not None:
            words = f"then: {trial.obstacle.message}"
        section.lines[k] = replace(line, why=f"{line.why}: {words}" if line.why else words)
    tried = len(measured) + len(computed) == len(choices)
    if tried and len(measured) == 1 and {section.lines[k].key for _, section, k in choices} == {"effort"}:
        why = f"measured: {', '.join(map(str, computed))} has neither a sensor's noise nor friction"
        draft.answer("log.csv", "effort", measured[0], why)


def _leave_currents(units: Section) -> Line | None:
    """Leave currents without torque constants in their unit; the line that says what they are, None where none is."""
    live = {line.key: line for line in units.lines if line.active}
    if "effort" not in live or live["effort"].value != "A" or "torque_constant_nm_per_a" in live:
        return None
    units.put(
        Line(
            "effort",
            "raw",
            "currents without torque constants: collaudit fit identifies the gains that it can",
            guess=True,
        )
    )
    return live["effort"]


def _add_torque_constants(draft: Draft, currents: Line, trial: Trial) -> bool:
    """Constants by the gains that the trial's fit found; whether they are those of all joints, and count from now on.

    Args:
        draft: whose ``[log.units]`` is completed.
        currents: the line that says what the effort is.
        trial: with the effort in its own unit.
    """
    units, prepared = draft.sections["log.units"], trial.prepared
    if prepared is None or not prepared.robot.has_inertials:
        units.put(currents)  # nothing could be tried: what is missing is said of that line
        return True
    gains = {}
    identified = None if trial.friction is None else trial.friction.identified
    for joint, found in ({} if identified is None else identified.joints).items():
        low, high = found.gain_ci95 or (None, None)
        if joint in prepared.judged and found.gain and low is not None and high is not None:
            gains[joint] = (found.gain, low, high)
    if not gains:
        return False
    silent = [joint for joint in prepared.judged if joint not in gains]
    spans = "; ".join(f"{joint} {_constant(*gains[joint])}" for joint in gains)
    units.remarks.append(f"Torque constants by {_SOURCE}, N·m/A [95 %]: {spans}.")
    if silent:
        units.remarks.append(f"This motion does not tell those of {', '.join(silent)}. What would: {_TELLS}.")
        return False
    units.put(currents)
    constants = {joint: float(f"{1.0 / abs(gain):.4g}") for joint, (gain, _, _) in gains.items()}
    units.put(Line("torque_constant_nm_per_a", constants, f"by {_SOURCE}", guess=True))
    inverted = {joint: -1 for joint, (gain, _, _) in gains.items() if gain < 0.0}
    if inverted and not any(line.key == "effort_sign" and line.active for line in units.lines):
        units.put(Line("effort_sign", inverted, "these run against the model", guess=True))
    return True


def _constant(gain: float, low: float, high: float) -> str:
    """1/gain with its interval; open above where the gain may be nothing."""
    least, most = sorted((abs(low), abs(high)))
    above = "∞" if low <= 0.0 <= high else f"{1.0 / least:.3g}"
    return f"{1.0 / abs(gain):.4g} [{1.0 / most:.3g} to {above}]"


def _evidence(prepared: Prepared) -> str:
    """How much of the effort's variance the model torque explains, and by which gains."""
    gains = [gain for gain in prepared.gains if gain.joint in prepared.judged]
    if not gains:
        return "no evidence: the robot has no masses, or the log too little motion"
    shares = [100 * gain.explained for gain in gains]
    known = [gain.gain for gain in gains if gain.known]
    size = f"effort per N·m of model torque {min(known):.2g} to {max(known):.2g}" if known else "no gain is shown"
    return (
        f"the model explains {np.median(shares):.0f} % of the effort (median of {len(gains)} joints, {min(shares):.0f} "
        f"to {max(shares):.0f} %), {size}"
    )


def arms_in(known: Known, flags: Mapping[str, object]) -> dict[str, tuple[Arm, Known]]:
    """The arms of a log and what is known of each; empty where it is of one, or one has been chosen.

    Args:
        known: of the log.
        flags: settings given as flags.
    """
    config = known.loaded.config
    if known.robot is None or _CHOSEN_LOG & config.log.given or _CHOSEN_ROBOT & config.robot.given:
        return {}
    if "position" in config.log.csv.given:
        return {}
    from collaudit.core.logs.tables.column_faults import sides_of

    columns = sides_of(known.summary.csv_columns) if known.columns is None else {}
    arms = arms_of(known.summary, known.robot.movable, known.prismatic, columns)
    out = {}
    for name, arm in arms.items():
        loaded = load_config(known.loaded.path, {**flags, **arm.keys})
        stated = key_paths(arm.keys)
        out[name] = (arm, replace(known, loaded=loaded, guesses=known.guesses | stated))
    return {} if _one_arm(out) else out


def fleet_text(log: str, arms: Mapping[str, Arm], files: Mapping[str, Path]) -> str:
    """The configuration that names the arms of a log and holds what they share.

    Args:
        log: its name.
        arms: by name.
        files: of each arm's configuration, beside this one.
    """
    head = [
        f"collaudit configuration, written by collaudit init for {log}, a log of {len(arms)} arms.",
        "Each arm is judged with its own configuration and friction file; the policy here holds for all.",
    ]
    sections = {"policy": Section("policy")}
    sections["policy"].add("max_collisions", 0)
    for name, arm in arms.items():
        section = sections[f"fleet.robots.{name}"] = Section(f"fleet.robots.{name}")
        for key, values in (("topics", arm.topics), ("joints", arm.joints)):
            if values:
                section.add(key, list(values), "tells this arm's part of a log", guess=True)
        section.add("config", files[name].name)
        section.add("friction", friction_of(files[name]).name, "by collaudit fit with that configuration")
    return document(head, sections)


def friction_of(config: Path) -> Path:
    """Where the fleet's file looks for the friction that is fitted with an arm's configuration."""
    return config.with_name(f"{config.stem}.friction.json")


def key_paths(keys: Mapping[str, object]) -> frozenset[KeyPath]:
    """The paths of dotted keys, and of the names in those that are tables."""
    tables = {key: value for key, value in keys.items() if isinstance(value, Mapping)}
    inner = {(*key.split("."), name) for key, table in tables.items() for name in table}
    return frozenset({tuple(key.split(".")) for key in keys} | inner)


def _one_arm(arms: Mapping[str, tuple[Arm, Known]]) -> bool:
    """Whether some topics report on the same arm, as a measured and a commanded one do."""
    from collaudit.core.api import open_log

    logs = []
    for arm, known in arms.values():
        if not arm.topics:
            continue
        try:
            logs.append(open_log(known.files, known.loaded))
        except CollauditError:
            return True
    return any(same_arm(one, other) for k, one in enumerate(logs) for other in logs[k + 1 :])
