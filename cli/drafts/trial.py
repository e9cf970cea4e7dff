"""The trial of a drafted configuration: its own log is audited with it, or what stands in the way is kept.

``init`` ends with a few lines of what came of it, what is missing, and what is next.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from collaudit.cli.console import progress
from collaudit.cli.shared_steps import forbidding
from collaudit.core.api import LogFiles, load_robot, open_log
from collaudit.core.config import LoadedConfig
from collaudit.core.data.audit_result import AuditResult, FrictionFile, Provenance
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import CollauditError
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import Progress, stage
from collaudit.core.prepare.prepared import Prepared
from collaudit.reports.terminal.screen_text import verdict_text
from collaudit.reports.values.words import verdict_word

#: Longer logs are tried on a stretch of so many values of one channel (rows times joints): a few seconds of work.
MOST_VALUES = 1_500_000
#: Whether a log can be judged is seen from fewer folds than its fit should have.
_FOLDS = 3
_SHOWN = 6
_NO_ROBOT = (
    'a model of the robot: give --urdf arm.urdf, or write [robot] urdf = "arm.urdf" into the file (or dh_convention '
    "and [[robot.dh]] rows with masses)"
)


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """What came of it.

    Attributes:
        log: what was read, or the stretch of it that was tried; None where it cannot be read.
        whole_s: duration of the whole log.
        prepared: the log with its model; None where that failed.
        result: of the audit; None where it could not be made.
        findings: of reading and preparing, as ``inspect`` shows them.
        obstacle: the error that ended the trial.
        friction: fitted on the log; None where nothing was.
        unfitted: the error for which nothing was fitted on it.
        own_fit: whether friction and thresholds were fitted on the log itself, which no policy takes for evidence.
    """

    log: JointLog | None = None
    whole_s: float = 0.0
    prepared: Prepared | None = None
    result: AuditResult | None = None
    findings: tuple[Finding, ...] = ()
    obstacle: CollauditError | None = None
    friction: FrictionFile | None = None
    unfitted: CollauditError | None = None
    own_fit: bool = False

    @property
    def verdict(self) -> Literal["pass", "fail", "not_judged", "could_be_judged"] | None:
        """As ``detect`` would say it; what passed by its own fit, or in a part of the log, only could be judged."""
        if self.result is None:
            return None
        if self.result.verdict == "pass" and (self.own_fit or self.tried_s < self.whole_s):
            return "could_be_judged"
        return self.result.verdict

    @property
    def tried_s(self) -> float:
        """Duration of what was tried."""
        return _duration(self.log) if self.log is not None else 0.0


def try_log(files: LogFiles, loaded: LoadedConfig, *, audit: bool = True) -> Trial:
    """Read a log with a configuration and audit it, or a stretch of it; or only prepare it."""

    try:
        with progress("reading") as report:
            log = open_log(files, loaded, report)
    except CollauditError as error:
        return Trial(obstacle=error)
    phases = loaded.config.phases
    whole = phases.approach or phases.contact or phases.retreat  # they count from the beginning of the log
    return try_again(Trial(stretch_of(log, MOST_VALUES, moving=not whole), _duration(log)), loaded, audit=audit)


def try_again(trial: Trial, loaded: LoadedConfig, *, audit: bool = True) -> Trial:
    """Audit what an earlier trial read with other settings, which must read the log alike."""
    if trial.log is None:
        return trial
    with progress("trying the configuration") as report:
        return _tried(trial, trial.log, loaded, audit, report)


def _tried(trial: Trial, log: JointLog, loaded: LoadedConfig, audit: bool, report: Progress) -> Trial:
    from collaudit.core.audit import audit_log
    from collaudit.core.prepare.calibration import Calibration
    from collaudit.core.prepare.preparation import calibrated, prepare
    from collaudit.core.verdict.verdict import asked_findings
    from collaudit.reports.files.run_files import read_friction

    config = loaded.config
    trial = Trial(log, trial.whole_s)
    try:
        friction = read_friction(loaded.friction_path) if loaded.friction_path else None
        robot = load_robot(loaded, log.joint_names)
        known = None if friction is None else Calibration.of(friction, config)
        prepared = prepare(log, robot, config, known)
        trial = replace(trial, prepared=prepared, findings=tuple(asked_findings(prepared, config)))
        if not audit:
            return trial
        origin = loaded.provenance(None, robot.sha256)
        # a fit tells automatic thresholds, and the gain of an effort in a unit of its own
        own = friction is None and (config.detect.automatic or config.log.units.effort == "raw")
        report(2, 10)
        fitted = _own_fit(prepared, loaded, origin, stage(report, 0.2, 0.6)) if own else None
        if isinstance(fitted, CollauditError):
            trial = replace(trial, unfitted=fitted)
        elif fitted is not None:
            friction, prepared = fitted, calibrated(prepared, Calibration.of(fitted, config), config)
            trial = replace(trial, friction=fitted)
        report(6, 10)
        if loaded.friction_path is None:
            # What is fitted on the log itself is no evidence, and enough to see whether the log can be judged.
            trial = replace(trial, own_fit=True)
            config = config.changed({"policy": config.policy.changed({"same_log": "allow"})})
        causes = () if config.robot.tool.mass_kg == "estimate" else None  # a draft says none
        judged = audit_log(prepared, config, friction, origin, progress=stage(report, 0.6, 1.0), siblings=causes)
    except CollauditError as error:
        return replace(trial, obstacle=error)
    return replace(trial, result=judged.result)


def _own_fit(
    prepared: Prepared, loaded: LoadedConfig, origin: Provenance, report: Progress
) -> FrictionFile | CollauditError | None:
    """Friction and thresholds of the log that is tried; None where it shows no friction, as of an arm at rest.

    An error where it cannot be fitted at all.
    """
    from collaudit.core.fitting import fit_logs

    try:
        fit = loaded.config.fit
        config = loaded.config.changed({"fit": fit.changed({"blocks": min(fit.blocks, _FOLDS)})})
        fitted = fit_logs([prepared], config, origin, progress=report)
    except CollauditError as error:
        return error
    return fitted if any(fit.model is not None for fit in fitted.joints.values()) else None


def stretch_of(log: JointLog, most: int, *, moving: bool = True) -> JointLog:
    """The log, or of a longer one the stretch with the most motion.

    Args:
        log: as recorded.
        most: values of one channel to keep, rows times joints.
        moving: look for motion; otherwise the stretch is the beginning.
    """
    rows = max(1, most // max(1, len(log.joint_names)))
    if log.time_s.shape[0] <= rows:
        return log
    start = _liveliest(log.position_rad, rows) if moving else 0
    return log.samples(slice(start, start + rows))


def _liveliest(position: FloatArray, rows: int) -> int:
    """First row of the stretch in which joints move in the most samples; the first of equal ones."""
    steps = np.abs(np.diff(position, axis=0, prepend=position[:1]))
    usual = np.nanmax(np.nan_to_num(steps), axis=0) * 1e-3
    moves = np.cumsum(np.concatenate([[0], (steps > usual).sum(axis=1)]))
    return int(np.argmax(moves[rows:] - moves[:-rows]))


def _duration(log: JointLog) -> float:
    finite = log.time_s[np.isfinite(log.time_s)]
    return float(finite.max() - finite.min()) if finite.size else 0.0


def came_of_it(trial: Trial, result: AuditResult) -> str:
    """What was tried, how many joints have a residual, and the verdict as ``detect`` says it."""
    part = "" if trial.tried_s >= trial.whole_s else f"{trial.tried_s:.4g} s of the {trial.whole_s:.4g} s of "
    cover = result.coverage.joints
    seen = f"{sum(each.judged_s > 0 for each in cover.values())} of {len(cover)} joints"
    what = "have a residual" if result.verdict == "not_judged" else "judged"  # the log was not, for its reasons
    said = verdict_text(result, _SHOWN)
    if trial.verdict == "could_be_judged":
        said = "COULD BE JUDGED" + said.removeprefix(verdict_word(result.verdict, result.exclusions))
    return f"trial on {part}this log: {seen} {what}\n{said}".rstrip()


def missing(trial: Trial, questions: Sequence[str], *, robot: bool) -> list[str]:
    """What keeps the log from being judged with the drafted file; empty when it was judged.

    Args:
        trial: of the draft.
        questions: that stand open in the file.
        robot: whether a robot is stated.
    """
    out = [f"to be answered in the file: {question}" for question in questions]
    if trial.obstacle is not None:
        return [*out, trial.obstacle.render()]
    if not robot:
        return [*out, _NO_ROBOT]
    if (forbids := forbidding(trial.findings)) is not None:
        return [*out, forbids]
    result = trial.result
    if result is not None and result.verdict == "not_judged":
        out += list(result.reasons[:_SHOWN])
        if len(result.reasons) > _SHOWN:
            out.append(f"… and {len(result.reasons) - _SHOWN} more reasons, which collaudit detect lists")
        if trial.unfitted is not None:
            out.append(trial.unfitted.render())
        elif result.friction and all(fit.model is None for fit in result.friction.values()):
            out.append(
                "friction, which this log is too short or too still to show: fit it on a run in which the joints move, "
                "collaudit fit LOG -c FILE -o friction.json, and add --friction friction.json"
            )
    elif result is not None and not any(each.judged_s > 0 for each in result.coverage.joints.values()):
        out.append("no joint could be judged")
    return out


def next_step(trial: Trial, log: str, config: Path | None, *, fitted: bool) -> str:
    """The command that comes next once the log is judged.

    Args:
        trial: of the draft.
        log: as it was given.
        config: the file written; None when it went to stdout.
        fitted: whether the file names a friction file.
    """
    result = trial.result
    file = str(config) if config is not None else "collaudit.toml"
    if fitted or result is None:
        return f"next: collaudit detect {log} -c {file} -o run"
    if any(fit.model is not None for fit in result.friction.values()):
        own = "Friction and thresholds were" if result.rule.gamma_nm else "Friction was"
        alone = f"collaudit detect {log} -c {file} --set 'policy.same_log=\"folds\"'"
        why = (
            f"{own} fitted on the log that was judged, so contact in it may go unseen: detect asks for another log's.\n"
            f"  There is no other? {alone} -o run judges each part of it by a fit of the others."
        )
    else:
        why = "No friction could be fitted here; only changes of torque at rest were judged."
    return (
        f"next: record a run free of contact in which all joints move, then collaudit fit LOG -c {file} -o "
        "friction.json"
        f"\n  {why}"
    )
