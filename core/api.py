"""The front door: open a log, look at it, fit friction, judge, and take the results as tables.

What the commands do, without a shell: ``docs/python.md`` shows it. Files of results are read and written by
:mod:`collaudit.reports`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from collaudit.core.config import LoadedConfig, load_config
from collaudit.core.data.audit_result import Audit, FrictionFile, RecommendedRule
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.signals import State
from collaudit.core.errors import CollauditError, ConfigError
from collaudit.core.numeric.parallel import Progress, stage
from collaudit.core.scoring.detection_score import TruthFile

if TYPE_CHECKING:
    import pandas as pd

    from collaudit.core.contacts.contact_states import Precedents
    from collaudit.core.data.signals import CycleReference
    from collaudit.core.logs.log_summary import LogSummary
    from collaudit.core.prepare.calibration import KnownLoad
    from collaudit.core.prepare.prepared import Prepared
    from collaudit.core.recommend.arm_recommendation import ArmRecommendation
    from collaudit.core.robot.robot_model import RobotModel

__all__ = [
    "Files",
    "LogFiles",
    "Progress",
    "alarms",
    "audit",
    "audits",
    "contacts",
    "describe",
    "disturbances",
    "find_logs",
    "findings",
    "fit",
    "load_config",
    "load_robot",
    "log_name",
    "near_misses",
    "open_log",
    "overview",
    "prepare",
    "recommend",
    "recommend_arm",
    "residuals",
]

#: The files of one log: one, or several that are parts of the same recording.
LogFiles = tuple[Path, ...]
Files = str | Path | Sequence[str | Path]


def find_logs(arguments: Sequence[str], settings: LoadedConfig) -> list[LogFiles]:
    """Logs meant by files, folders and patterns; CSV parts of one recording are one log.

    Raises:
        LogError: nothing was found.
    """
    from collaudit.core.logs.inputs import expand_inputs, group_inputs

    return group_inputs(expand_inputs(arguments), settings.config.log)


def log_name(files: LogFiles) -> str:
    """A log's name as reports show it."""
    from collaudit.core.logs.log_formats import log_name as joined_names

    return joined_names(files)


def describe(files: Files, settings: LoadedConfig | None = None) -> LogSummary:
    """What is in a log: topics, types, joints, rates, findings. It is not read whole.

    Args:
        files: a log, or the parts of one.
        settings: topics and columns that are known already.

    Raises:
        LogError: it is no log.
    """
    from collaudit.core.logs.log_description import describe as summary_of

    return summary_of(_paths(files), (settings or load_config(None)).config.log)


def open_log(files: Files, settings: LoadedConfig, progress: Progress | None = None) -> JointLog:
    """Read one log: joint signals as recorded, in SI units, under the robot's joint names.

    Args:
        files: a log, or the parts of one.
        settings: robot, topics, columns, units.
        progress: of reading.

    Returns:
        Stamps (n,) in s from the first sample; position, velocity, effort (n, j).

    Raises:
        LogError: it cannot be read, or holds no joint states. ConfigError, RobotError: the settings do not fit.
    """
    from collaudit.core.conditioning.motor_side import at_joints
    from collaudit.core.logs.log_reading import read_log
    from collaudit.core.robot.robot_description import describe_robot

    description = describe_robot(settings.config.robot, settings.base_dir)
    movable = description.movable if description else None
    log = read_log(
        _paths(files),
        settings.config.log,
        robot_joints=movable,
        prismatic=[joint.name for joint in description.joints if joint.kind == "prismatic"] if description else (),
        judged=settings.config.robot.joints or (),
        progress=progress,
    )
    return at_joints(log, settings.config.robot, movable or ())


def load_robot(settings: LoadedConfig, joints: Sequence[str]) -> RobotModel:
    """The configured robot as a model in these joints.

    Raises:
        RobotError: the description, or a name in the configuration, cannot be used.
    """
    from collaudit.core.robot.robot_building import build_robot

    return build_robot(settings.config.robot, settings.base_dir, joints)


def prepare(
    files: Files,
    settings: LoadedConfig,
    friction: FrictionFile | None = None,
    progress: Progress | None = None,
) -> Prepared:
    """Read one log, build its robot, condition and check both.

    Args:
        files: a log, or the parts of one.
        settings: everything about log and robot.
        friction: what an earlier fit found of drives, arm and sensor; None for nothing.
        progress: of reading, conditioning and modelling.

    Returns:
        Uniform series, model torque (n, j) in N·m, phases, and findings on all of it.

    Raises:
        CollauditError: any of it cannot be done.
    """
    from collaudit.core.numeric.linear_algebra import settle_within_memory_limit

    settle_within_memory_limit()
    step = stage(progress, 0.0, 1.0)
    log = open_log(files, settings, stage(progress, 0.0, 0.4))
    from collaudit.core.prepare.calibration import Calibration  # a log that is refused here needs none of it
    from collaudit.core.prepare.preparation import conditioned, modelled

    robot = load_robot(settings, log.joint_names)
    calibration = None if friction is None else Calibration.of(friction, settings.config)
    step(4, 10)
    start = conditioned(log, robot, settings.config)
    del log  # what was recorded is not held beside what was made of it
    step(7, 10)
    made = modelled(start, settings.config, calibration)
    step(10, 10)
    return made


def fit(
    logs: Sequence[Files | Prepared],
    settings: LoadedConfig,
    progress: Progress | None = None,
    truth: Sequence[TruthFile | None] = (),
    loads: Sequence[KnownLoad] = (),
) -> FrictionFile:
    """Fit friction, and what else ``[fit] estimate`` asks for, from one or several logs together.

    Args:
        logs: one entry a log: its files, or the log as :func:`prepare` gives it.
        settings: robot, log, sections, friction law.
        progress: of reading the logs and of the fit.
        truth: for each log its known contacts, which are left out; without, the fit looks for contact.
        loads: for each log the known mass that its arm carries beyond the configured tool; none when empty.

    Returns:
        By joint: law, parameters with 95 % intervals, what the data cannot determine.

    Raises:
        CollauditError: a log cannot be read or fitted at all.
    """
    from collaudit.core.fitting import fit_logs
    from collaudit.core.prepare.prepared import Prepared

    unread = sum(not isinstance(log, Prepared) for log in logs)
    reading = 0.25 if unread else 0.0
    prepared: list[Prepared] = []
    for log in logs:
        part = stage(progress, reading * len(prepared) / len(logs), reading * (len(prepared) + 1) / len(logs))
        prepared.append(log if isinstance(log, Prepared) else prepare(log, settings, progress=part))
    if loads:
        from collaudit.core.prepare.preparation import loaded

        prepared = [loaded(log, load, settings.config) for log, load in zip(prepared, loads, strict=True)]
    provenance = settings.provenance(None, prepared[0].robot.sha256)
    return fit_logs(prepared, settings.config, provenance, truth, stage(progress, reading, 1.0))


def identified_description(friction: FrictionFile, settings: LoadedConfig, mjcf: bool = False) -> bytes:
    """The description of the arm as it was fitted, for simulators; its torque is that of the model, to 1e-9 N·m.

    Args:
        friction: what :func:`fit` found.
        settings: the robot, and the tool as it is now, which becomes part of it.
        mjcf: MuJoCo's MJCF instead of the robot's URDF.

    Raises:
        CollauditError: no URDF describes the robot, or the form cannot state the bodies that were identified.
    """
    from collaudit.core.friction.identified_description import identified_mjcf, identified_urdf

    write = identified_mjcf if mjcf else identified_urdf
    return write(friction, settings.config, settings.base_dir)


def audit(
    files: Files,
    settings: LoadedConfig,
    friction: FrictionFile | None = None,
    *,
    truth: TruthFile | None = None,
    friction_sha256: str | None = None,
    progress: Progress | None = None,
    known: Precedents | None = None,
    earlier: Sequence[CycleReference] = (),
) -> Audit:
    """Judge one log.

    Args:
        files: a log, or the parts of one.
        settings: robot, log, rule, policy.
        friction: as fitted before (``collaudit.reports.read_friction`` reads a file); None fits it on this very log,
            with a finding that says so.
        truth: known events to score against (:func:`collaudit.core.scoring.detection_score.read_truth`).
        friction_sha256: hash of the friction file, for the provenance.
        progress: of reading and judging.
        known: earlier contacts of the robot, and accepted ones; None for nothing.
        earlier: what passed nights of a store say of the program's cycles, in their order.

    Returns:
        The result as it stands in audit.json, and the signals (n, j) behind it.

    Raises:
        CollauditError: the log cannot be judged at all. ConfigError: the settings name a friction file and none is
            given.
    """
    if friction is None and settings.friction_path is not None:
        raise ConfigError(
            "the settings name a friction file, and none was given",
            where="[friction] file",
            found=str(settings.friction_path),
            hint="pass friction = collaudit.reports.read_friction(settings.friction_path)",
        )
    prepared = prepare(files, settings, friction, stage(progress, 0.0, 0.45))
    from collaudit.core.audit import audit_log  # a log that is refused while it is read needs none of it
    from collaudit.core.robot.robot_building import sibling_robots

    provenance = settings.provenance(friction_sha256, prepared.robot.sha256)
    siblings = sibling_robots(settings.config.robot, settings.base_dir, prepared.robot.joint_names)
    judging = stage(progress, 0.45, 0.95)
    judging(0, 1)
    return audit_log(prepared, settings.config, friction, provenance, truth, judging, known, earlier, siblings)


def audits(
    logs: Sequence[Files],
    settings: LoadedConfig,
    friction: FrictionFile | None = None,
    progress: Progress | None = None,
) -> list[Audit | CollauditError]:
    """Judge many logs, one after the other; one that cannot be judged does not end the others.

    Args:
        logs: one entry a log: its files.
        settings, friction: as of :func:`audit`.
        progress: over all logs.

    Returns:
        For each log its audit, or the error why there is none; :func:`overview` makes a table of them.

    Raises:
        ConfigError: the settings fit no log.
    """
    made: list[Audit | CollauditError] = []
    for k, log in enumerate(logs):
        try:
            part = stage(progress, k / len(logs), (k + 1) / len(logs))
            made.append(audit(log, settings, friction, progress=part))
        except ConfigError:
            raise
        except CollauditError as error:
            made.append(error)
    return made


def recommend(
    audits: Sequence[Audit],
    persistence_s: float | None = None,
    contact: Sequence[Sequence[tuple[float, float]] | None] = (),
) -> dict[str, RecommendedRule]:
    """Recommended gamma and n per joint over all given audits.

    Args:
        audits: judged logs.
        persistence_s: persistence in s; the longest the audits used when absent.
        contact: for each audit the start and end of all contacts, s; None where the alarms are to be taken for it.
    """
    return recommend_arm(audits, persistence_s, contact).joints


def recommend_arm(
    audits: Sequence[Audit],
    persistence_s: float | None = None,
    contact: Sequence[Sequence[tuple[float, float]] | None] = (),
    per_hour: float = 1e-3,
) -> ArmRecommendation:
    """Thresholds so that the arm's false alarms stay below a rate, the arm's bound, and what the evidence is.

    Args:
        audits, persistence_s, contact: as of :func:`recommend`.
        per_hour: false alarms of the arm that are accepted.
    """
    from collaudit.core.recommend.arm_recommendation import recommend_arm as over_all

    return over_all(audits, persistence_s, contact, per_hour)


def residuals(audit: Audit) -> pd.DataFrame:
    """Signals of an audit over time.

    Returns:
        (n, 6 j) table, index ``time_s`` in s from the log's first sample, columns (quantity, joint): position_rad,
        velocity_rad_s, measured_nm, model_nm, residual_nm, and state, the reason code of each sample.
    """
    import numpy as np
    import pandas as pd

    signals = audit.signals
    names = list(signals.joint_names)
    codes = pd.Index([state.code for state in State])
    parts: dict[str, pd.DataFrame] = {}
    for quantity in ("position_rad", "velocity_rad_s", "measured_nm", "model_nm", "residual_nm"):
        parts[quantity] = pd.DataFrame(np.asarray(getattr(signals, quantity)), columns=names)
    states = {
        name: pd.Categorical.from_codes(signals.state[:, j].tolist(), categories=codes) for j, name in enumerate(names)
    }
    parts["state"] = pd.DataFrame(states)
    table = pd.concat(parts, axis=1, names=["quantity", "joint"])
    table.index = pd.Index(signals.time_s, name="time_s")
    return table


def overview(audits: Sequence[Audit | CollauditError]) -> pd.DataFrame:
    """One row a log, as :func:`audits` gives them.

    Returns:
        log, verdict, start (UTC), duration_s, how many contacts and near misses, and why. A log that could not be
        judged is ``not_judged``, with its error.
    """
    rows: list[Mapping[str, object]] = []
    for one in audits:
        if isinstance(one, CollauditError):
            rows.append({"log": one.where or "", "verdict": "not_judged", "why": one.message})
            continue
        result = one.result
        row = {"log": result.log.name, "verdict": result.verdict, "start": result.log.start}
        counts = {"contacts": len(result.contacts), "near_misses": len(result.near_misses)}
        rows.append(row | counts | {"duration_s": result.log.duration_s, "why": "; ".join(result.reasons)})
    return _table(rows, _OVERVIEW)


def alarms(audit: Audit) -> pd.DataFrame:
    """Alarms of single joints, one a row, with the columns of audit.json's ``collisions``."""
    return _rows(audit.result.collisions, _COLLISION)


def near_misses(audit: Audit) -> pd.DataFrame:
    """Near misses, one a row, with the columns of audit.json's ``near_misses``."""
    return _rows(audit.result.near_misses, _NEAR_MISS)


def contacts(audit: Audit) -> pd.DataFrame:
    """Contacts, one a row: when, joints, link, kind, force (95 % interval, N, or its lower end alone), id, state."""
    rows = []
    for c in audit.result.contacts:
        force: dict[str, float | None] = {} if c.least_force is None else {"force_low_n": c.least_force.force_n}
        if c.force is not None:
            force = dict(zip(_FORCE, (c.force.size_n, *c.force.size_ci95_n), strict=True))
        rows.append({name: getattr(c, name) for name in _CONTACT if name not in _FORCE} | force)
    return _table(rows, _CONTACT)


def disturbances(audit: Audit) -> pd.DataFrame:
    """Disturbances of standing joints, one row a joint: when, by how much torque (N·m) and deflection (rad) stepped."""
    rows = [
        {"onset_s": one.onset_s, "end_s": one.end_s} | {name: getattr(joint, name) for name in _DISTURBED[2:]}
        for one in audit.result.disturbances
        for joint in one.joints
    ]
    return _table(rows, _DISTURBED)


def findings(of: Audit | FrictionFile | Prepared | JointLog) -> pd.DataFrame:
    """Findings, one a row: code, severity, text, where, joint, start_s, end_s."""

    found = of.result.findings if isinstance(of, Audit) else of.findings
    return _rows(found, ("code", "severity", "text", "where", "joint", "start_s", "end_s"))


_COLLISION = ("joint", "onset_s", "detected_s", "duration_s", "peak_nm", "gamma_nm", "phase")
_NEAR_MISS = ("joint", "onset_s", "duration_s", "peak_nm", "gamma_nm", "ratio", "kind", "phase")
_FORCE = ("force_n", "force_low_n", "force_high_n")
_CONTACT = ("onset_s", "detected_s", "end_s", "joints", "link", "kind", *_FORCE, "id", "state")
_DISTURBED = ("onset_s", "end_s", "joint", "torque_step_nm", "deflection_rad")
_OVERVIEW = ("log", "verdict", "start", "duration_s", "contacts", "near_misses", "why")
#: Columns that are no text and, by their names, no quantity.
_DTYPES = {"joints": "object", "ratio": "float64", "contacts": "Int64", "near_misses": "Int64"}


def _rows(items: Sequence[object], columns: Sequence[str]) -> pd.DataFrame:
    return _table([{name: getattr(item, name) for name in columns} for item in items], columns)


def _table(rows: Sequence[Mapping[str, object]], columns: Sequence[str]) -> pd.DataFrame:
    """A table whose columns have the same types without rows as with many: a unit in its name makes one a number."""
    import pandas as pd

    units = ("_s", "_n", "_nm", "_rad")
    types = {name: _DTYPES.get(name, "float64" if name.endswith(units) else "str") for name in columns}
    return pd.DataFrame(list(rows), columns=list(columns)).astype(types)


def _paths(files: Files) -> LogFiles:
    if isinstance(files, str | Path):
        return (Path(files),)
    return tuple(Path(file) for file in files)
