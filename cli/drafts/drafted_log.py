"""One drafted configuration: what names and values of a log say, tried on the log, and what is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from collaudit.cli.drafts.catalogue import add_proposals
from collaudit.cli.drafts.choice_evidence import add_choice_evidence
from collaudit.cli.drafts.draft import Draft
from collaudit.cli.drafts.draft_evidence import (
    add_channel_facts,
    add_effort_kind,
    add_measurements,
    add_rest_threshold,
)
from collaudit.cli.drafts.torque_constants import add_torque_constants
from collaudit.cli.drafts.trial import Trial, try_again, try_log
from collaudit.cli.drafts.trial_words import missing
from collaudit.core.api import LogFiles
from collaudit.core.config import LoadedConfig, parse_config
from collaudit.core.config.schema import FleetConfig, PolicyConfig
from collaudit.core.config.toml_lines import KeyPath
from collaudit.core.logs.column_guess import ColumnGuess
from collaudit.core.logs.log_summary import LogSummary
from collaudit.core.robot.robot_description import Description


@dataclass(frozen=True, slots=True)
class Known:
    """What is known of a log and its robot before a configuration is drafted.

    Attributes:
        files: of the log.
        summary: of it.
        columns: what the names of a table's columns say.
        loaded: what file and flags state.
        robot: the description, None without one.
        paths: key to file as a flag gave it.
        guesses: keys that nobody has stated.
    """

    files: LogFiles
    summary: LogSummary
    columns: ColumnGuess | None
    loaded: LoadedConfig
    robot: Description | None
    paths: dict[str, str]
    guesses: frozenset[KeyPath]

    @property
    def prismatic(self) -> list[str]:
        """The robot's prismatic joints."""
        return [joint.name for joint in self.robot.joints if joint.kind == "prismatic"] if self.robot else []


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
    folder = output.parent if output is not None else Path()
    movable = known.robot.movable if known.robot else ()
    draft = Draft(summary, movable, loaded, folder, known.columns, known.prismatic, known.paths, known.guesses)
    if of_fleet:
        del draft.sections["policy"]
    place = output or Path("collaudit.toml")
    add_torque_constants(draft, files, place)
    trial = try_log(files, parse_config(draft.text(), place))
    if trial.obstacle is not None and not summary.csv_columns and not draft.problems:
        raise trial.obstacle  # no line of a configuration would mend this; naming columns or joints may
    if trial.obstacle is not None and summary.csv_columns and not draft.problems:
        draft.sections["log.csv"].remarks.append("MISSING: " + " ".join(trial.obstacle.render().split()))
    if draft.problems and known.robot is not None:
        add_choice_evidence(draft.sections, draft.text(), files, place)
    if trial.prepared is not None and add_effort_kind(draft.sections, trial.prepared):
        trial = try_again(trial, parse_config(draft.text(), place))
    add_measurements(draft.sections, trial)
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
