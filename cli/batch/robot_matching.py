"""Which robots of a fleet a log is of, by path, topics, or joint names, and the settings it then has."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from functools import cached_property
from itertools import combinations

from collaudit.core.api import LogFiles, describe
from collaudit.core.config import LoadedConfig, config_sha256, load_config
from collaudit.core.config.schema import FleetConfig, FleetRobot
from collaudit.core.contacts.contact_states import matches
from collaudit.core.errors import ConfigError, NotJudgedError
from collaudit.core.logs.log_summary import LogSummary


class LogTraits:
    """What rules look at; the log is opened only when a rule asks for its content."""

    def __init__(self, place: str, files: Callable[[], LogFiles], loaded: LoadedConfig) -> None:
        self.place = place
        self._files = files
        self._loaded = loaded

    @cached_property
    def _summary(self) -> LogSummary:

        return describe(list(self._files()), self._loaded)

    @property
    def topics(self) -> set[str]:
        """Names of the log's topics."""
        return {topic.name for topic in self._summary.topics}

    @property
    def joints(self) -> set[str]:
        """Names of all joints in it, and of a table its columns."""
        named = {joint for topic in self._summary.topics for joint in topic.joints}
        return named | {column.strip() for column in self._summary.csv_columns}


def robots_of(traits: LogTraits, robots: Mapping[str, FleetRobot]) -> list[str]:
    """Names of the robots whose rules all hold: one, or the arms of a log that has several.

    Raises:
        NotJudgedError: there is none, or more than one that topics or joints do not tell apart. LogError: the log
            cannot be looked into.
    """
    found = [name for name, robot in robots.items() if _is_of(traits, robot)]
    apart = all(_apart(robots[one], robots[other], traits) for one, other in combinations(found, 2))
    if found and apart:
        return found
    raise NotJudgedError(
        "no robot of the fleet is this log's" if not found else "the log may be of several robots of the fleet",
        where=traits.place,
        found=", ".join(found) or None,
        expected="one robot whose rules match, or several with topics or joints of their own",
        hint="add or narrow a rule in [fleet.robots.NAME]",
    )


def _apart(one: FleetRobot, other: FleetRobot, traits: LogTraits) -> bool:
    """Whether two robots of a log have no topic, or no joint of it in common: then each has its own part of it."""
    if one.joints and other.joints and not _shared(one.joints, other.joints):
        return True
    topics = [set(robot.topics) & traits.topics for robot in (one, other) if robot.topics]
    return len(topics) == 2 and not topics[0] & topics[1]


def _is_of(traits: LogTraits, robot: FleetRobot) -> bool:
    """Paths first, which cost nothing."""
    if robot.paths and not matches(traits.place, robot.paths):
        return False
    if robot.topics and not _shared(robot.topics, traits.topics):
        return False
    return not robot.joints or set(robot.joints) <= traits.joints


def _shared(asked: Collection[str], there: Collection[str]) -> bool:
    return not set(asked).isdisjoint(there)


def robot_settings(
    common: LoadedConfig, flags: Mapping[str, object], robots: Mapping[str, FleetRobot]
) -> dict[str | None, LoadedConfig]:
    """The settings of every robot by its name.

    Args:
        common: the configuration, flags applied.
        flags: the flags alone: they win over what a robot has.
        robots: of the fleet.

    Raises:
        ConfigError: a robot's configuration cannot be used.
    """
    return {name: _of_robot(common, flags, name, robot) for name, robot in robots.items()}


def _of_robot(common: LoadedConfig, flags: Mapping[str, object], name: str, robot: FleetRobot) -> LoadedConfig:
    """The robot's own configuration, or the common one; then what the fleet states of it; then the flags."""
    policy = common.config.policy
    if robot.config is not None:
        own = load_config(robot.config).config
        if "fleet" in own.given:
            raise ConfigError(
                f"the configuration of robot {name!r} holds what is common to the fleet",
                where=str(robot.config),
                found="[fleet]",
                hint="put it into the configuration that names the fleet",
            )
        policy = policy.changed({key: getattr(own.policy, key) for key in own.policy.given})
    stated = {"friction.file": robot.friction, "detect.gamma_nm": robot.gamma_nm}
    own_keys = {
        key: str(value.absolute()) if hasattr(value, "absolute") else value
        for key, value in stated.items()
        if value is not None
    }
    of_robot = {key: value for key, value in flags.items() if not key.startswith(("policy.", "fleet."))}
    made = load_config(robot.config or common.path, {**own_keys, **of_robot})
    config = made.config.changed({"policy": policy, "fleet": FleetConfig()})
    return replace(made, config=config, sha256=config_sha256(config))
