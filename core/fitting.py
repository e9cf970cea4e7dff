"""Composition of the stages of a fit: logs to one friction file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import (
    FRICTION_SCHEMA,
    FrictionFile,
    Provenance,
)
from collaudit.core.data.joint_log import log_facts
from collaudit.core.detection.fitted_rule import exceeded_findings
from collaudit.core.findings import Finding, in_joint_units
from collaudit.core.friction.arm_fit import ArmFit, fit_arm, without_samples
from collaudit.core.friction.friction_variation import correction_findings
from collaudit.core.friction.joint_fits import fit_joints, friction_findings
from collaudit.core.identification.channel_audit import audit_channels
from collaudit.core.identification.estimate_choice import choose, wanted
from collaudit.core.identification.identification import identified_findings
from collaudit.core.identification.log_cleaning import cleaned, refuse_if_nothing_is_left
from collaudit.core.identification.motion_sums import gathered
from collaudit.core.identification.solved_problem import Candidate
from collaudit.core.numeric.arrays import BoolArray
from collaudit.core.numeric.parallel import Progress, stage
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.preparation import calibrated
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.recommend.fitted_thresholds import fitted_thresholds, settled_motion
from collaudit.core.recommend.held_out_residual import held_out_residuals
from collaudit.core.scoring.detection_score import TruthFile
from collaudit.core.scoring.known_events import known_contact_times
from collaudit.core.torque_table.log_samples import fold_count, fold_of_sample


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """A fit with its file: the logs as they were fitted, and what was chosen."""

    file: FrictionFile
    logs: Sequence[Prepared]
    taken: Candidate
    arm: ArmFit


def fit_logs(
    prepared: Sequence[Prepared],
    config: Config,
    provenance: Provenance,
    truth: Sequence[TruthFile | None] = (),
    progress: Progress | None = None,
) -> FrictionFile:
    """Fit the friction of every judged joint from one or several logs, and identify what else was asked for.

    Args:
        prepared: the logs, without a calibration: what they tell of sensor, drives and arm is found here.
        config: what is identified, and how friction is fitted.
        provenance: versions and hashes.
        truth: for each log a file of its contacts, which are left out; None where there is none.
        progress: called with steps done and in all.

    Raises:
        NotJudgedError: the logs are mostly contact. LogError, ConfigError: known contacts cannot be understood.
    """
    return _fit(prepared, config, provenance, truth, progress).file


def _fit(
    prepared: Sequence[Prepared],
    config: Config,
    provenance: Provenance,
    truth: Sequence[TruthFile | None],
    progress: Progress | None,
) -> _Fit:
    """As :func:`fit_logs`."""
    audited = []
    for log in prepared:
        audited.append(audit_channels(log, config))
        stage(progress, 0.0, 0.07)(len(audited), len(prepared))
    times = known_contact_times(prepared, config, truth)
    clean = cleaned(prepared, config, times, stage(progress, 0.07, 0.37))
    refuse_if_nothing_is_left(clean)
    channels = {log.series.source.name: facts for log, (facts, _) in zip(prepared, audited, strict=True)}
    sensor = Calibration.of_sensor(channels, config)
    if wanted(config) == "auto" or {"tool", "inertials"} & set(wanted(config)):
        sensor = replace(sensor, tool=None)  # the joint torques are to tell the tool
    known = [calibrated(log, sensor, config) for log in clean.logs]
    sums = gathered(known, config.fit.blocks)
    taken, choice = choose(known, config, sums)
    arm = fit_arm(known, taken, config, sums=sums, progress=stage(progress, 0.4, 0.55))
    settled = settled_motion(arm.logs, arm.fits, stage(progress, 0.55, 0.65))
    residuals = held_out_residuals(known, arm, taken, settled.variation, config, stage(progress, 0.65, 0.95))
    thresholds = fitted_thresholds(residuals, arm.fits, config)
    stage(progress, 0.95, 1.0)(1, 1)
    findings = [
        f
        for log, made, (_, found) in zip(clean.logs, arm.logs, audited, strict=True)
        for f in _of_log(log, (*_findings(log, made), *found), prepared)
    ]
    findings += clean.findings
    findings += arm.findings
    findings += [
        f for log, found in zip(arm.logs, settled.patterns, strict=True) for f in _of_log(log, found, prepared)
    ]
    gains = [gain for log in arm.logs for gain in log.gains]
    findings += identified_findings(arm.identified) + friction_findings(arm.fits, gains)
    findings += correction_findings(settled.corrections)
    findings += exceeded_findings(thresholds, arm.fits)
    file = FrictionFile(
        schema=FRICTION_SCHEMA,
        joints=dict(arm.fits),
        findings=in_joint_units(findings, prepared[0].sliding),
        provenance=replace(
            provenance,
            logs=_hashes(prepared),
            model_sha256=prepared[0].robot.sha256,
        ),
        identified=arm.identified,
        channels=channels,
        trends=settled.variation,
        left_out=clean.left_out,
        coupled=dict(arm.coupled),
        thresholds=thresholds,
        corrections=settled.corrections,
        recorded=_recorded(prepared),
        choice=choice,
    )
    return _Fit(file, known, taken, arm)


def fit_by_parts(
    prepared: Prepared, config: Config, provenance: Provenance, progress: Progress | None = None
) -> tuple[FrictionFile, list[tuple[BoolArray, FrictionFile]]]:
    """The fit of a log, and for each part of the log its samples (n,) and what the other parts tell.

    What contact is left out and what is identified is chosen on all of the log, and which law a joint has, unless the
    rest of a part does not determine it. All values and thresholds of a part are told without it.

    Args:
        prepared: the log, without a calibration.
        config, provenance, progress, and errors: as of :func:`fit_logs`.
    """
    whole = _fit([prepared], config, provenance, (), stage(progress, 0.0, 0.6))
    count, step = fold_count([prepared.series], config.fit.blocks), stage(progress, 0.6, 1.0)
    fold, parts = fold_of_sample(prepared.series, count), []
    for k in range(count):
        own = fold == k
        rest = fit_arm(whole.logs, whole.taken, config, [own], whole.arm)
        unsure = [joint for joint, fit in rest.fits.items() if fit.identifiable < whole.arm.fits[joint].identifiable]
        if unsure:
            anew = fit_joints([without_samples(log, own) for log in rest.logs], config)
            rest = replace(rest, fits={**rest.fits, **{joint: anew[joint] for joint in unsure}})
        residuals = held_out_residuals(whole.logs, rest, whole.taken, whole.file.trends, config, left_out=[own])
        fitted = replace(
            whole.file,
            joints=dict(rest.fits),
            identified=rest.identified,
            coupled=dict(rest.coupled),
            thresholds=fitted_thresholds(residuals, rest.fits, config),
            corrections={},  # thresholds are told from residuals without them
        )
        parts.append((own, fitted))
        step(k + 1, count)
    return whole.file, parts


def _findings(log: Prepared, made: Prepared) -> list[Finding]:
    """What is said of a log; of its efforts' scale what is left to say beside what the fit identified."""
    return [f for f in log.findings if f not in log.scale] + list(made.scale)


def _of_log(log: Prepared, findings: Sequence[Finding], logs: Sequence[Prepared]) -> list[Finding]:
    """Findings of one log; among several logs they name it."""
    if len(logs) == 1:
        return list(findings)
    name = log.series.source.name
    return [replace(f, where=name if f.where in (None, name) else f"{name}, {f.where}") for f in findings]


def _hashes(prepared: Sequence[Prepared]) -> dict[str, str]:
    """Hash of each log by its name; logs of one name are counted, so that none is lost."""
    out: dict[str, str] = {}
    for log in prepared:
        source = log.series.source
        same = sum(name.partition(" (")[0] == source.name for name in out)
        out[f"{source.name} ({same + 1})" if source.name in out else source.name] = source.sha256
    return out


def _recorded(prepared: Sequence[Prepared]) -> tuple[str, str] | None:
    """When the first and the last log began; None where one does not tell."""
    starts = [log_facts(log.series).start for log in prepared]
    known = sorted(start for start in starts if start is not None)
    return (known[0], known[-1]) if known and len(known) == len(starts) else None
