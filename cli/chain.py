"""The steps commands share: from files and settings to prepared logs, friction and audits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from collaudit.cli.provenance import make_provenance
from collaudit.core.errors import ConfigError

if TYPE_CHECKING:
    from collaudit.core.audit import Prepared
    from collaudit.core.config import LoadedConfig
    from collaudit.core.data.audit_result import Audit, FrictionFile

LogFiles = tuple[Path, ...]
Progress = Callable[[int, int], None]


def log_name(files: LogFiles) -> str:
    """A log's name as reports show it."""
    return "+".join(path.name for path in files)


def find_logs(arguments: Sequence[str], loaded: LoadedConfig) -> list[LogFiles]:
    """Logs meant by files, folders and patterns; CSV parts of one recording are one log.

    Raises:
        LogError: nothing was found.
    """
    from collaudit.core.logs import expand_inputs, group_inputs

    return group_inputs(expand_inputs(arguments), loaded.config.log)


def one_log(arguments: Sequence[str], loaded: LoadedConfig) -> LogFiles:
    """The one log meant by the arguments, which may be several parts of it.

    Raises:
        LogError: nothing was found.
        ConfigError: the arguments are several logs.
    """
    logs = find_logs(arguments, loaded)
    if len(logs) != 1:
        raise ConfigError(
            "this command judges one log",
            found=f"{len(logs)}: {', '.join(log_name(files) for files in logs[:5])}",
            expected="one log (several files only when they are CSV parts of one recording)",
            hint="collaudit audit takes any number of logs",
        )
    return logs[0]


def prepare_log(files: LogFiles, loaded: LoadedConfig, progress: Progress | None = None) -> Prepared:
    """Read one log, build its robot, condition and check both.

    Raises:
        CollauditError: any of it cannot be done.
    """
    from collaudit.core.audit import prepare
    from collaudit.core.logs import read_log
    from collaudit.core.robot import load_robot
    from collaudit.core.robot.robot_description import describe_robot

    robot, base_dir = loaded.config.robot, loaded.base_dir
    description = describe_robot(robot, base_dir)
    log = read_log(
        files,
        loaded.config.log,
        robot_joints=description.movable if description else None,
        prismatic=[joint.name for joint in description.joints if joint.kind == "prismatic"] if description else (),
        progress=progress,
        cache=loaded.cache,
    )
    return prepare(log, load_robot(robot, base_dir, log.joint_names), loaded.config)


def friction_path(loaded: LoadedConfig) -> Path | None:
    """The friction file of the settings, from the folder they lie in."""
    file = loaded.config.friction.file
    return None if file is None else loaded.base_dir / file


def judge(
    files: LogFiles, loaded: LoadedConfig, progress: Progress | None = None, truth: Path | None = None
) -> tuple[Audit, FrictionFile | None]:
    """Audit one log with the settings' friction, or with friction fitted on the log itself.

    Args:
        files: of the log.
        loaded: settings.
        progress: of reading.
        truth: file of known events to score the detection against.

    Returns:
        The audit, and the friction file it was judged with (None: fitted on the log).

    Raises:
        CollauditError: the log cannot be judged at all.
    """
    from collaudit.core.audit import audit_log
    from collaudit.reports.files import read_friction

    path = friction_path(loaded)
    friction = read_friction(path) if path else None
    prepared = prepare_log(files, loaded, progress)
    provenance = make_provenance(loaded, path, prepared.robot.sha256)
    return audit_log(prepared, loaded.config, friction, provenance, truth), friction
