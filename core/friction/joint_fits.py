"""Friction of every judged joint from one or several logs, and the findings about it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Literal, assert_never

from collaudit.core.config.schema import Config
from collaudit.core.data.friction_result import FrictionFit, FrictionPoint
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.errors import ConfigError
from collaudit.core.findings import Finding
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.friction_points import friction_points
from collaudit.core.friction.law_candidates import FrictionUnits
from collaudit.core.friction.motion_points import any_motion_tells_more, motion_points, moving_speeds
from collaudit.core.friction.sections import SectionSet, find_sections
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import Progress, by_name, stage
from collaudit.core.prepare.effort_gain import EffortGain
from collaudit.core.prepare.prepared import Prepared

Motion = Literal["sections", "any", "sensors"]
#: A friction file may hold a joint without a law and without a reason.
_UNSTATED = "the friction file has no law for it and does not say why"
#: Sections that give no point of friction.
_ALONE = "without the other direction at that speed and place, and without a model"
_UNKNOWN = "torque or model unknown in a part of it"


def fit_joints(
    prepared: Sequence[Prepared],
    config: Config,
    progress: Progress | None = None,
    sections: Sequence[SectionSet] | None = None,
) -> dict[str, FrictionFit]:
    """Sections, points and fit of each judged joint, the points of all logs together.

    Args:
        prepared: the logs.
        config: how friction is fitted.
        progress: called with steps done and in all.
        sections: of each log; None to find them.

    Raises:
        ConfigError: the logs' efforts have different units.
    """
    units = {p.series.effort_unit for p in prepared}
    if len(units) > 1:
        raise ConfigError("the logs have efforts in different units", found=", ".join(sorted(units)))
    found = list(zip(prepared, sections or sections_of(prepared, config), strict=True))
    # Threads for the passes over all samples only: sections and fits are many small steps, in which they wait for each
    # other.
    joints = dict.fromkeys(joint for log in prepared for joint in log.judged)
    loose = by_name(partial(_loose_points, prepared=prepared, config=config), joints, stage(progress, 0.0, 0.75))
    return {
        joint: _fit_joint(joint, [(log, its) for log, its in found if joint in log.judged], points, config)
        for joint, points in loose.items()
    }


def sections_of(prepared: Sequence[Prepared], config: Config, progress: Progress | None = None) -> list[SectionSet]:
    """Constant-velocity sections of each log; ``progress`` is called with steps done and in all."""
    share = [k / len(prepared) for k in range(len(prepared) + 1)]
    return [
        find_sections(log.series, config.sections, stage(progress, share[k], share[k + 1]))
        for k, log in enumerate(prepared)
    ]


def refit_joints(
    prepared: Sequence[Prepared], kinds: Mapping[str, FrictionFit], sections: Sequence[SectionSet], config: Config
) -> dict[str, FrictionFit]:
    """The laws of earlier fits with values from fewer samples: the law, and where its points come from, are kept.

    Args:
        prepared: the logs.
        kinds: fits by joint; those without a law are left out.
        sections: of each log, when all of its samples counted.
        config: how friction is fitted.
    """
    known = {joint: fit for joint, fit in kinds.items() if fit.model is not None}
    sections = [found.known_in(log.series) for log, found in zip(prepared, sections, strict=True)]

    def refit(joint: str) -> FrictionFit:
        fit = known[joint]
        assert fit.model is not None
        logs = [(log, found) for log, found in zip(prepared, sections, strict=True) if joint in log.judged]
        match fit.motion:
            case "sections":
                points = [p for log, found in logs for p in _of_sections(joint, log, found)]
            case "any" | "sensors":
                points = _loose_points(joint, prepared, config)
            case _:
                assert_never(fit.motion)
        return _fitted(points, _units(joint, logs[0][0]), config, fit.model)

    return by_name(refit, known)


def _fit_joint(
    joint: str, logs: Sequence[tuple[Prepared, SectionSet]], loose: Sequence[FrictionPoint], config: Config
) -> FrictionFit:
    """Fit one joint from its sections; from arbitrary motion where that is asked for, or the sections are too few."""
    points, rejected, count = list[FrictionPoint](), Counter[str](), 0
    for log, found in logs:
        seen, own = _of_sections(joint, log, found), len(found.of(joint))
        alone = own - sum(2 if point.source == "pair" else 1 for point in seen)
        rejected.update(dict(found.rejected[joint].most_common()))
        rejected.update({_ALONE if log.rigid_nm is None else _UNKNOWN: alone} if alone else {})
        points, count = [*points, *seen], count + own
    units, prepared = _units(joint, logs[0][0]), [log for log, _ in logs]
    torque = _in_torque_units(prepared, joint)
    direct = bool(torque) and all(p.sensed(joint) for p in torque)
    sources: list[tuple[Motion, Sequence[FrictionPoint]]] = [("sections", points)]
    if config.fit.motion != "sections":
        sources.append(("sensors" if direct else "any", loose))
        if config.fit.motion == "any" or direct or any_motion_tells_more(points, loose, moving_speeds(prepared, joint)):
            sources.reverse()
    fits = (replace(_fitted(its, units, config), motion=motion) for motion, its in sources)
    fit = next((fit for fit in fits if fit.model is not None), None) or _fitted(points, units, config)
    robot = logs[0][0].robot
    rated = float(robot.effort_limit_nm[robot.joint_names.index(joint)])
    share = fit.rmse_nm / rated if fit.rmse_nm is not None and rated > 0 and units.effort != "raw" else None
    known = fit.identifiability
    if known is not None and known.motion_needed:
        needed = tuple(f"{text} on joint '{joint}'" for text in known.motion_needed)
        fit = replace(fit, identifiability=replace(known, motion_needed=needed))
    return replace(fit, section_count=count, rejected=dict(rejected.most_common()), rmse_share=share)


def _units(joint: str, log: Prepared) -> FrictionUnits:
    return FrictionUnits.of(log.robot.joint_types[log.robot.joint_names.index(joint)], log.series.effort_unit)


def _of_sections(joint: str, log: Prepared, found: SectionSet) -> tuple[FrictionPoint, ...]:
    """Points of a joint's constant speeds."""
    return friction_points(log.series, found.of(joint), _model_in_effort_unit(log, joint))


def _loose_points(joint: str, prepared: Sequence[Prepared], config: Config) -> list[FrictionPoint]:
    """Points of arbitrary motion, where they may be asked for."""
    if config.fit.motion == "sections":
        return []
    return list(motion_points(_in_torque_units(prepared, joint), joint))


def _in_torque_units(prepared: Sequence[Prepared], joint: str) -> list[Prepared]:
    return [log for log in prepared if log.series.effort_unit == "Nm" and joint in log.judged]


def _fitted(
    points: Sequence[FrictionPoint], units: FrictionUnits, config: Config, model: str | None = None
) -> FrictionFit:
    from collaudit.core.friction.friction_fitting import fit_friction  # an audit takes the law of a file

    ordered = sorted(points, key=lambda p: p.speed_rad_s)
    return fit_friction(ordered, units, model or config.friction.model)


def _model_in_effort_unit(log: Prepared, joint: str) -> FloatArray | None:
    """(n,) the model's torque in the unit of the log's effort: as it is in N·m, else by the estimated gain."""
    explained_nm = log.explained_nm(joint)
    if explained_nm is None or log.series.effort_unit == "Nm":
        return explained_nm
    gain = next((g.gain for g in log.gains if g.joint == joint), None)
    return None if gain is None else explained_nm * gain


def friction_findings(fits: Mapping[str, FrictionFit], gains: Sequence[EffortGain] = ()) -> list[Finding]:
    """What the fits could not do, one finding a joint and fact.

    Args:
        fits: by joint.
        gains: of the efforts that were fitted: where they tell a sign, negative friction does not tell another.
    """
    findings = []
    for joint, fit in fits.items():
        if fit.model is None:
            lost = "; ".join(f"{reason}: {count}" for reason, count in fit.rejected.items())
            text = f"The friction of joint '{joint}' could not be fitted: {fit.reason or _UNSTATED}."
            if lost:
                text += f" Stretches rejected: {lost}."
            findings.append(Finding("fit-doubtful", "warning", text, joint=joint))
            continue
        findings += _physics_findings(joint, fit, [gain for gain in gains if gain.joint == joint and gain.known])
    return findings


def _physics_findings(joint: str, fit: FrictionFit, known: Sequence[EffortGain]) -> list[Finding]:
    """What the points of one joint want against physics; nothing where its inverted effort is stated already."""
    if not fit.dissipates and any(gain.inverted for gain in known):
        return []
    if not fit.dissipates:
        cause = (
            "while its gravity torque has the right sign: sign and mounting ([robot] base_rpy_deg) are both wrong, or "
            "a delay, an error of the model's torque, or a hand that leads the arm."
            if known
            else "as an effort with inverted sign does, or one turned to suit a wrong mounting; see [log.units] "
            "effort_sign and [robot] base_rpy_deg."
        )
        text = (
            f"Friction of joint '{joint}' is negative at nearly every speed measured: it would drive the joint, "
            f"{cause} The law was fitted as the data say: contact may go unseen by it."
        )
        return [Finding("friction-not-physical", "warning", text, joint=joint)]
    if not fit.unphysical:
        return []
    text = (
        f"The data of joint '{joint}' ask for {', '.join(fit.unphysical)}, which friction cannot have; it was held "
        "at 0. An error of the model's torque, a delay, or too narrow a range of speeds can cause this."
    )
    return [Finding("friction-not-physical", "warning", text, joint=joint)]


def friction_models(
    fits: Mapping[str, FrictionFit], series: UniformSeries
) -> tuple[dict[str, FrictionModel], list[Finding]]:
    """Laws that can be used on this log: fitted, and in a torque unit."""
    laws: dict[str, FrictionModel] = {}
    findings = []
    for joint in series.joint_names:
        fit = fits.get(joint)
        law = None if fit is None else FrictionModel.of(fit)
        if fit is None:
            why = "is not in the friction file"
        elif law is None:  # friction_findings says why
            continue
        elif fit.effort_unit == "raw":
            why = "was fitted in the log's own unit, not in N·m"
        elif fit.effort_unit not in ("N·m", "N"):
            why = f"is in {fit.effort_unit!r}, not in N·m"
        else:
            laws[joint] = law
            continue
        findings.append(
            Finding(
                "fit-doubtful",
                "warning",
                f"The friction of joint '{joint}' {why}: its residual is not judged.",
                joint=joint,
            )
        )
    return laws, findings
