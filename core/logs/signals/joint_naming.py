"""Joint names: the log's, the robot's, and which log names are meant by which."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from collaudit.core.errors import ConfigError, LogError
from collaudit.core.findings import Finding, fact
from collaudit.core.logs.signals.joint_guess import JointGuess, first_in_order, guess_joints, joints_line, mapping_line


@dataclass(frozen=True, slots=True)
class NameMap:
    """Which joints of a log are kept.

    Attributes:
        log: log names kept, in the order of ``model``.
        model: their names in the robot model.
        findings: joints ignored and joints missing.
    """

    log: tuple[str, ...]
    model: tuple[str, ...]
    findings: tuple[Finding, ...]


def matches(names: Sequence[str], mapping: Mapping[str, str], robot: Sequence[str]) -> int:
    """How many of the robot's joints a set of log names has."""
    return len({mapping.get(name, name) for name in names} & set(robot))


def map_names(
    names: Sequence[str],
    mapping: Mapping[str, str],
    robot: Sequence[str] | None,
    where: str,
    prismatic: Sequence[str] = (),
    *,
    numbered: bool = False,
    columns: bool = False,
    message_order: bool = False,
    judged: Sequence[str] = (),
) -> NameMap:
    """Decide which joints of a log are kept and what the robot calls them.

    Args:
        names: joint names of the log.
        mapping: log name to model name, ``[log] joint_names``.
        robot: the robot's joints; None keeps all of the log's.
        where: file and topic, for messages.
        prismatic: the robot's prismatic joints.
        columns: the names are those of numbered columns, and not of a message's joints.
        numbered, message_order, judged: as of :func:`collaudit.core.logs.signals.joint_guess.guess_joints`.

    Raises:
        ConfigError: two joints of the log are mapped to one of the robot. A stated name wins over the log's own.
        LogError: none of the log's joints is one of the robot's, or it is not sure which is which.
    """
    said: tuple[Finding, ...] = ()
    if robot is not None and not any(name in mapping for name in names):
        guess = guess_joints(names, robot, prismatic, numbered=numbered, message_order=message_order, judged=judged)
        said = _used(guess, names, robot, where, columns=columns)
        mapping = {**mapping, **guess.mapping}
    return _kept(names, mapping, robot, where, said)


def _used(
    guess: JointGuess, names: Sequence[str], robot: Sequence[str], where: str, *, columns: bool
) -> tuple[Finding, ...]:
    """What is said of a guess that is used.

    Raises:
        LogError: it is not sure enough to be used unasked.
    """
    if not guess.sure:
        proposed = [guess.mapping] if guess.mapping else list(guess.candidates.values()) or [dict.fromkeys(names, "…")]
        raise LogError(
            "none of the log's joints is a joint of the robot" if not guess.problem else guess.problem,
            where=where,
            found=listed(names),
            expected=listed(robot),
            hint=_joints_hint(guess) + "map them, " + ", or ".join(mapping_line(each) for each in proposed),
        )
    if all(log == model for log, model in guess.mapping.items()):
        return ()
    order = ", ".join(guess.mapping.values())
    said = "Numbered columns were taken as the robot's joints in its order"
    if not columns:
        said = "The log numbers its joints; they were taken as the robot's in its order"
    return (Finding("log-guessed", "info" if columns else "warning", f"{said}: {order}.", where=where),)


def _joints_hint(guess: JointGuess) -> str:
    """The lines that say of which of the robot's joints the log is, where their names show groups of as many."""
    lines = ", or ".join(joints_line(chain) for chain in guess.chains)
    return f"say which of the robot's joints they are, {lines}; or " if lines else ""


def _kept(
    names: Sequence[str],
    mapping: Mapping[str, str],
    robot: Sequence[str] | None,
    where: str,
    said: tuple[Finding, ...],
) -> NameMap:
    stated = {mapping[name] for name in names if name in mapping}
    namesakes = [name for name in names if name in stated and name not in mapping]  # of another arm in the same log
    mapped: dict[str, str] = {}
    for name in (name for name in names if name not in namesakes):
        target = mapping.get(name, name)
        if target in mapped and mapped[target] != name:
            raise ConfigError(
                f"the log's joints {mapped[target]!r} and {name!r} are both the robot's {target!r}",
                where=where,
                hint="correct [log] joint_names",
            )
        mapped[target] = name
    if robot is None:
        return NameMap(tuple(mapped.values()), tuple(mapped), ())
    kept = [name for name in robot if name in mapped]
    if not kept:
        raise LogError(
            "none of the log's joints is a joint of the robot",
            where=where,
            found=listed(names),
            expected=listed(robot),
            hint="map them, " + mapping_line(first_in_order(names, robot) or dict.fromkeys(names, "…")),
        )
    findings = list(said)
    ignored = [log for target, log in mapped.items() if target not in set(robot)]
    if namesakes:
        text = f"The log's own {listed(namesakes)}: left out, as [log] joint_names gives these names to other joints."
        findings.append(fact(text, where=where))
    missing = [name for name in robot if name not in mapped]
    if ignored:
        text = f"The log has joints that the robot does not have; they are left out: {listed(ignored)}."
        findings.append(fact(text, where=where))
    if missing:
        text = f"The robot has joints that the log does not have: {listed(missing)}."
        if absent := [name for name in mapping if name not in names]:
            text += f" Nor has the log these names of [log] joint_names: {listed(absent)}."
        findings.append(Finding("log-joints-missing", "warning", text, where=where))
    return NameMap(tuple(mapped[name] for name in kept), tuple(kept), tuple(findings))


def listed(names: Sequence[str], limit: int = 12) -> str:
    """Names for a message, not too many of them."""
    shown = ", ".join(repr(name) if name != name.strip() or " " in name else name for name in names[:limit])
    return shown + (f" and {len(names) - limit} more" if len(names) > limit else "") if names else "none"
