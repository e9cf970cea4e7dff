"""What a trial showed, as the few lines that ``init`` ends with: what came of it, what is missing, what is next."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from collaudit.cli.drafts.trial import Trial
from collaudit.cli.exit_codes import forbidding
from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.signals import State
from collaudit.reports.values.words import plural, reason_text, verdict_word

_SHOWN = 6
_FEW = 3
_NO_ROBOT = (
    'a model of the robot: give --urdf arm.urdf, or write [robot] urdf = "arm.urdf" into the file (or dh_convention '
    "and [[robot.dh]] rows with masses)"
)


def came_of_it(trial: Trial, result: AuditResult) -> str:
    """What was tried, the verdict with what it does not speak of, the joints judged, and why others were not."""
    part = "" if trial.tried_s >= trial.whole_s else f"{trial.tried_s:.4g} s of the {trial.whole_s:.4g} s of "
    cover = result.coverage.joints
    judged = [name for name, each in cover.items() if each.judged_s > 0]
    modelled = trial.prepared is None or trial.prepared.rigid_nm is not None
    causes: dict[str, list[str]] = {}
    for name in cover:
        if name not in judged:
            causes.setdefault(_why(result, name, modelled), []).append(name)
    others = [f"{_named(names)}: {why}" for why, names in causes.items()]
    silent = f" ({'; '.join(others)})" if others else ""
    found = f"; {plural(len(result.contacts), 'contact')}" if judged else ""
    excluded = result.exclusions if result.verdict == "pass" else ()
    more = [f"… and {len(excluded) - _SHOWN} more"] if len(excluded) > _SHOWN else []
    listed = "".join(f"\n- excluded: {each}" for each in excluded[:_SHOWN]) + "".join(f"\n- {each}" for each in more)
    word = verdict_word(result.verdict, result.exclusions)
    what = "have a residual" if result.verdict == "not_judged" else "judged"  # the log was not, for the reasons below
    return f"trial on {part}this log: {word}, {len(judged)} of {len(cover)} joints {what}{silent}{found}{listed}"


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
        if result.friction and all(fit.model is None for fit in result.friction.values()):
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
        why = f"{own} fitted on the log that was judged, so contact in it may go unseen: detect asks for another log's."
    else:
        why = "No friction could be fitted here; only changes of torque at rest were judged."
    return (
        f"next: record a run free of contact in which all joints move, then collaudit fit LOG -c {file} -o "
        "friction.json"
        f"\n  {why}"
    )


def _named(joints: Sequence[str]) -> str:
    return ", ".join(joints) if len(joints) <= _FEW else f"{len(joints)} joints"


def _why(result: AuditResult, joint: str, modelled: bool) -> str:
    """Why a joint was not judged: a finding on it, else what most of its time was."""

    cover = result.coverage.joints[joint]
    if modelled:
        for finding in result.findings:
            if finding.joint == joint and finding.effect == "not-judged-joint":
                return finding.code
    if not cover.watched:
        return cover.why if modelled else reason_text(State.NO_MODEL.code)
    if not cover.not_judged_s:
        return "at rest"
    return reason_text(max(cover.not_judged_s, key=lambda reason: cover.not_judged_s[reason]))
