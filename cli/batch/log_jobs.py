"""The logs of an audit: whose each is, the settings and limits it is judged under, what became of it and is stored.

Which robots of a fleet a log is of is told by its path, its topics, or the names of its joints."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cached_property
from importlib.metadata import version
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

from collaudit.core.api import LogFiles, describe
from collaudit.core.config import LoadedConfig, config_sha256, load_config
from collaudit.core.config.schema import FleetConfig, FleetRobot
from collaudit.core.contacts.contact_states import Precedents, matches
from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.signals import CycleReference
from collaudit.core.errors import CollauditError, ConfigError, NotJudgedError
from collaudit.core.history.night_row import NightFrom, NightRow, rows_of_result
from collaudit.core.logs.log_reading import sha256_of
from collaudit.core.logs.log_summary import LogSummary
from collaudit.reports.values.entries import IndexEntry

#: In ``--robot``: the name of the folder that a log lies in.
FOLDER = "{folder}"


class LogJob(NamedTuple):
    """One log of an audit.

    Attributes:
        files: of the log; none where it was not found, or is remote.
        name: what all files of the audit call it, unique among its logs.
        folder: name of its run folder.
        loaded: its effective configuration.
        robot: whose log it is, by the fleet or by ``--robot``; None where neither says.
        problem: why it cannot be judged, where that is known beforehand.
        url: where a remote log is fetched from.
        known: what is known of its robot's contacts beforehand.
        earlier: what passed nights of the store say of its program's cycles, in their order.
    """

    files: LogFiles
    name: str
    folder: str
    loaded: LoadedConfig
    robot: str | None = None
    problem: CollauditError | None = None
    url: str | None = None
    known: Precedents | None = None
    earlier: tuple[CycleReference, ...] = ()

    @property
    def place(self) -> str:
        """Its path or URL as it was given."""
        return self.url or self.files[0].as_posix()


@dataclass(frozen=True, slots=True)
class Limits:
    """How logs may be judged: processes at a time, and seconds and GB (10⁹ bytes) a log, None for no limit.

    ``scheduler``: address of the cluster that they are judged on, None for this machine.
    """

    workers: int = 1
    time_s: float | None = None
    memory_gb: float | None = None
    scheduler: str | None = None


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one log: its line in the index, and its result unless it could not be judged."""

    entry: IndexEntry
    result: AuditResult | None


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


def robot_of(job: LogJob, stated: str | None) -> str | None:
    """Whose log it is in a store; None for one that cannot be judged because no robot is known for it.

    Args:
        job: the log.
        stated: whose it is, with :data:`FOLDER` for its folder; None: as a fleet's configuration says.

    Raises:
        ConfigError: nothing says whose it is.
    """
    name = stated or job.robot
    if not name and job.problem is not None:
        return None
    if not name:
        raise ConfigError(
            "a store must know whose logs these are",
            where=f"store, {job.name}",
            expected="a [fleet] in the configuration that this log belongs to, --robot NAME, or --robot '{folder}' "
            "where each robot's logs lie in a folder of its name",
        )
    return name.replace(FOLDER, job.files[0].absolute().parent.name if job.files else Path(job.name).parent.name)


def night_rows(
    jobs: Sequence[LogJob], outcomes: Sequence[Outcome], stated: str | None
) -> dict[str, tuple[NightRow, ...]]:
    """What a store keeps of each log whose robot is known, by name.

    Args:
        jobs, outcomes: of the audit, in one order.
        stated: ISO date of the night that they count to; None: of each log's first stamp in UTC, else today.
    """
    today, made = datetime.now(UTC).date().isoformat(), {}
    for job, one in zip(jobs, outcomes, strict=True):
        start = None if one.result is None else one.result.log.start
        night: tuple[str, NightFrom] = (start[:10], "log") if start else (today, "audit")
        if stated is not None:
            night = stated, "stated"
        if job.robot is not None and one.result is not None:
            made[one.entry.name] = rows_of_result(one.result, job.robot, *night)
        elif job.robot is not None:
            made[one.entry.name] = (_unread_row(job, one.entry, job.robot, *night),)
    return made


def _unread_row(job: LogJob, entry: IndexEntry, robot: str, night: str, night_from: NightFrom) -> NightRow:
    """The row of a log that could not be audited, and why: a night without evidence is no quiet night."""
    try:
        digest = sha256_of(job.files) if job.files else None
    except (CollauditError, OSError, ValueError):
        digest = None
    return NightRow(
        robot=robot,
        night=night,
        night_from=night_from,
        log=entry.name,
        log_sha256=digest,
        start=None,
        verdict="not_judged",
        why=(entry.error or "").partition("\n")[0],
        joint=None,
        tested=False,
        judged_s=0.0,
        level_nm=None,
        gamma_nm=None,
        friction_nm=None,
        near_misses=0,
        contacts=(),
        config_sha256=None,
        friction_sha256=None,
        collaudit=version("collaudit"),
    )
