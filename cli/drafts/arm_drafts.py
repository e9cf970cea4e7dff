"""A log of several arms: a configuration for each, and the fleet's that names them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from collaudit.cli.drafts.config_text import Section, document
from collaudit.cli.drafts.draft import Known
from collaudit.core.config import load_config
from collaudit.core.errors import CollauditError
from collaudit.core.logs.arms_in_log import Arm, arms_of, same_arm

#: What chooses the signals of one arm: where it is stated, nothing is to be told apart.
_CHOSEN_LOG, _CHOSEN_ROBOT = {"joint_states", "joint_names"}, {"joints"}


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
        stated = frozenset(path for key in arm.keys for path in _paths(key, arm.keys[key]))
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


def _paths(key: str, value: object) -> list[tuple[str, ...]]:
    path = tuple(key.split("."))
    return [path, *((*path, name) for name in value)] if isinstance(value, Mapping) else [path]


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
