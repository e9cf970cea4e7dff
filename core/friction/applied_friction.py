"""The friction a log is judged with: of a friction file, or fitted on the log itself; and what that leaves in doubt."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.findings import Finding
from collaudit.core.friction.friction_model import FrictionModel, corrected_laws
from collaudit.core.friction.friction_variation import laws_at_temperature
from collaudit.core.friction.joint_fits import fit_joints, friction_findings, friction_models
from collaudit.core.identification.log_cleaning import cleaned, times_text
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.prepare.quiet_level import QuietLevel, quiet_levels

_THRESHOLDS = ' and the thresholds (gamma_nm = "auto")'


@dataclass(frozen=True, slots=True)
class AppliedFriction:
    """Friction as it is applied to one log.

    Attributes:
        fits: by joint, as in the friction file or as fitted here.
        laws: those that can be used on this log, at its joints' temperatures.
        findings: where the friction came from and what is missing.
        quiet: level of still joints: these are judged for changes of their torque, with a law or without.
    """

    fits: dict[str, FrictionFit]
    laws: dict[str, FrictionModel]
    findings: tuple[Finding, ...]
    quiet: Mapping[str, QuietLevel]


def applied_friction(prepared: Prepared, friction: FrictionFile | None, config: Config) -> AppliedFriction:
    """The friction of a file, or of this very log where there is none.

    Args:
        prepared: the log to be judged.
        friction: as fitted before; None to fit it here, with a finding that says so.
        config: how friction is fitted.
    """
    series = prepared.judged_series
    if friction is None:
        clean = cleaned([prepared], config)
        fits = fit_joints(clean.logs, config)
        said = [_circular(config, auto=False)] if any(fit.model for fit in fits.values()) else []
        findings = [*said, *clean.findings]
    else:
        fits = {joint: fit for joint, fit in friction.joints.items() if joint in series.joint_names}
        findings = [
            *_same_log(friction, prepared, config),
            *_mismatch(friction, prepared),
            *_left_out(friction),
            *_errors(friction, prepared),
        ]
    laws, missing = friction_models(fits, series)
    if friction is not None:
        laws = corrected_laws(laws, friction.corrections)
        laws, more = laws_at_temperature(laws, friction.trends, series)
        missing += more
    quiet = quiet_levels(prepared)
    if quiet and not laws:
        findings = []
    lawless = quiet.keys() - laws.keys()
    fitted = {joint: fit for joint, fit in fits.items() if joint not in lawless}
    missing = [finding for finding in missing if finding.joint not in lawless]
    gains = prepared.gains if friction is None else ()
    return AppliedFriction(fits, laws, (*findings, *friction_findings(fitted, gains), *missing), quiet)


def _same_log(friction: FrictionFile, prepared: Prepared, config: Config) -> list[Finding]:
    """A friction file that was fitted on the log to be judged, among others or alone."""
    logs, auto = friction.provenance.logs.values(), config.detect.automatic
    others = set(logs) - {prepared.series.source.sha256}
    if len(others) == len(set(logs)):
        return []
    if fitted_alone(friction, prepared):
        return [_circular(config, auto)]
    text = (
        f"Friction{_was(auto)} fitted on the log that is judged and {len(others)} more: what touched the arm in it "
        "counts as friction in part, and may go unseen."
    )
    return [Finding("friction-same-log", "warning", text)]


def fitted_alone(friction: FrictionFile, prepared: Prepared) -> bool:
    """Whether a friction file was fitted on the log that is judged, and on no other."""
    return set(friction.provenance.logs.values()) == {prepared.series.source.sha256}


def _was(auto: bool) -> str:
    return f"{_THRESHOLDS} were" if auto else " was"


def _circular(config: Config, auto: bool) -> Finding:
    """That nothing but the judged log says what it looks like without contact: no evidence, unless that is accepted."""
    if config.policy.same_log == "folds":
        text = (
            f"Each part of the log was judged by friction{' and thresholds' if auto else ''} fitted on the others: "
            "a touch that lasts through the log, or comes back in the same motion in every part, counts as friction "
            "and may go unseen."
        )
        return Finding("friction-same-log", "warning", text)
    text = (
        f"Friction{_was(auto)} fitted on the judged log alone: what touched the arm in it counts as friction"
        f"{', has raised the thresholds,' if auto else ''} and may go unseen."
    )
    if config.policy.same_log == "allow":
        return Finding("friction-same-log", "warning", text)
    return Finding(
        "friction-same-log",
        "error",
        f'{text} Fit on another log, free of contact (collaudit fit); or state [policy] same_log = "folds", which '
        "judges each part of the log by a fit of the others.",
    )


def _left_out(friction: FrictionFile) -> list[Finding]:
    """What looks like contact in the fitted logs, and was fitted as a person stated."""
    out = []
    for name, facts in friction.left_out.items():
        if facts.spans and facts.by == "stated":
            text = (
                f"The friction was fitted on {name}, stated to be free of contact, with {len(facts.spans)} stretches "
                f"that look like contact: {times_text(facts.spans)}. If they are, friction and thresholds from it are "
                "wrong, and such contacts can go unseen."
            )
            out.append(Finding("fit-contact-suspected", "warning", text, where=name))
    return out


def _errors(friction: FrictionFile, prepared: Prepared) -> list[Finding]:
    """Joints that the fit could not judge: identified inertials may have taken in what was wrong, and hide it."""
    known = {(finding.code, finding.joint) for finding in prepared.findings}
    return [
        replace(finding, text=f"In the fitted logs: {finding.text}", where="friction file", start_s=None, end_s=None)
        for finding in friction.findings
        if finding.effect == "not-judged-joint"
        and finding.joint in (None, *prepared.judged)
        and (finding.code, finding.joint) not in known
    ]


def _mismatch(friction: FrictionFile, prepared: Prepared) -> list[Finding]:
    """A friction file of another model, and friction of joints that this log lacks."""
    findings = []
    fitted_with = friction.provenance.model_sha256
    if fitted_with is not None and fitted_with != prepared.robot.sha256:
        text = (
            "The friction was fitted with another robot model, tool or mounting than this log is judged with "
            f"(model hash {fitted_with[:12]}, here {prepared.robot.sha256[:12]})."
        )
        if friction.identified is not None and friction.identified.masses:
            text += (
                " What that fit found beyond its description is added to this one: a tool that only one of the two "
                "states must have been carried in its logs alone."
            )
        findings.append(Finding("friction-other-model", "warning", text))
    for joint, fit in friction.joints.items():
        if fit.model is not None and joint not in prepared.series.joint_names:
            text = f"Joint '{joint}' has a friction law but is not in this log: it was not judged."
            findings.append(Finding("log-joints-missing", "error", text, joint=joint))
    return findings
