"""``collaudit recommend``: thresholds with their evidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from collaudit.cli.console import note, progress, say, say_object, terminal_width
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, friction_option, load_settings, overrides
from collaudit.cli.shared_steps import audit_files, known_contact, truth_option
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS, ConfigError

if TYPE_CHECKING:
    from collaudit.core.data.audit_result import Audit
    from collaudit.core.data.recommendation_result import PersistenceReason
    from collaudit.core.recommend.arm_evidence import Times
    from collaudit.core.recommend.arm_recommendation import ArmRecommendation

    #: An audit, what is known of contact in its log, and whose it is.
    Judged = tuple[Audit, Times | None, str | None]

#: False alarms of the whole arm per hour that the hours should show; it moves no threshold.
_PER_HOUR = 0.1


@example_command(
    "recommend",
    "collaudit recommend run/",
    "collaudit recommend out/ --json",
    "collaudit recommend clean1.mcap clean2.mcap -c collaudit.toml --friction friction.json",
    "collaudit recommend run/ --set detect.n=9",
    "collaudit recommend run/ --write collaudit.toml",
    "collaudit recommend run/ --plot planes.html",
    "collaudit recommend hits.mcap -c collaudit.toml --truth contacts.csv",
)
@click.argument("inputs", nargs=-1, required=True, metavar="RUN...|LOG...")
@click.option("--robot", metavar="NAME", help="The robot, where runs are of several.")
@click.option(
    "--write",
    "target",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Write the thresholds into this configuration; comments and all else in it stay.",
)
@click.option("-v", "--verbose", is_flag=True, help="Print the evidence: tables, what is left out, what to confirm.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON: every assumption, the hours, what to confirm.")
@click.option(
    "--plot",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Write a page (HTML): each joint's alarms over gamma and persistence, drawn and as a table.",
)
@truth_option
@config_option
@friction_option
def recommend_command(
    inputs: tuple[str, ...],
    robot: str | None,
    target: Path | None,
    verbose: bool,
    as_json: bool,
    plot: Path | None,
    truth: tuple[Path, ...],
) -> int:
    """Recommend gamma per joint, between what motion does and what must be noticed, with what it rests on.

    All inputs count together, all runs of an audit's folder included; the same log twice counts once. What the clean
    hours show of false alarms is counted, with its bound (95 %), and how many more hours would show the rate asked
    for. Alarms and near misses of all joints, and what lies far beyond the usual, are left out and listed to be
    confirmed: --truth or [detect] true_events say what was contact, and --set fit.contact=none that nothing touched the
    arm.

    Three lines say what to set, what it rests on, and what it notices; -v prints the evidence. Of a fleet,
    each robot gets an answer.

    The persistence stays as it was set; --set detect.n states another. How many alarms other thresholds and
    persistences would have given in the clean time, --plot shows for each joint.

    Exit code 3 when nothing could be recommended for any joint of a robot.
    """
    arms = _by_arm(_run_evidence(inputs, truth), robot)
    if len(arms) > 1 and as_json:
        names = ", ".join(arms)
        raise ConfigError("these are runs of several robots", where="--robot", found=names, expected="the name of one")
    answers = {}
    for name, judged in arms.items():
        audits = [audit for audit, *_ in judged]
        with progress("recommending") as report:
            found = _found(judged)
            report(8, 10)
        answers[name] = found
        if as_json:
            say_object("collaudit/recommend/1", _answer(found))
        else:
            say(f"Robot {name}\n" if len(arms) > 1 else "", nl=False)
            _say(audits, found, verbose)
        if found.to_confirm and not (verbose and not as_json):
            count = len(found.to_confirm)
            note(f"{count} stretch{' was' if count == 1 else 'es were'} left out as possible contact: please confirm")
    if target is not None:
        _write(target, answers, named=robot is not None)
    if plot is not None:
        from collaudit.reports.files.written_files import atomic_write
        from collaudit.reports.page.matter_pages import plane_page

        atomic_write(plot, plane_page(answers))
        note(f"alarms over gamma and persistence: {plot}")
    known = [any(rule.gamma_nm is not None for rule in found.joints.values()) for found in answers.values()]
    return EXIT_PASS if all(known) else EXIT_NOT_JUDGED


def _by_arm(evidence: Sequence[Judged], robot: str | None) -> dict[str, list[Judged]]:
    """The evidence by robot; where none is stated by the joints, since two arms are never judged as one.

    Raises:
        ConfigError: nothing is of the robot asked for.
    """
    arms: dict[str, list[Judged]] = {}
    for one in evidence:
        arms.setdefault(one[2] or ", ".join(one[0].signals.joint_names), []).append(one)
    if robot is not None and robot not in arms:
        raise ConfigError("nothing here is of this robot", where="--robot", found=robot, expected=", ".join(arms))
    return arms if robot is None else {robot: arms[robot]}


def _run_evidence(inputs: Sequence[str], truth: Sequence[Path]) -> list[Judged]:
    """Runs are read, everything else is judged as a log; with what is known of contact, and whose it is."""
    from collaudit.cli.batch.precedents import SUMMARY_NAME, audits_in
    from collaudit.core.api import find_logs, open_log
    from collaudit.core.scoring.known_events import contact_times, label_times
    from collaudit.reports.files.run_files import AUDIT_NAME, read_run

    runs: list[tuple[Path, str | None]] = []
    logs = []
    for text in inputs:
        folder = Path(text)
        ours = (folder / AUDIT_NAME).is_file() or (folder / SUMMARY_NAME).is_file()
        found = [(file.parent, robot) for file, robot in audits_in(folder)] if ours else []
        runs += found
        logs += [] if found else [text]
    audits = []
    with progress("reading runs") as report:
        for k, (run, _) in enumerate(runs, 1):
            audits.append(read_run(run))
            report(k, len(runs))
    loaded = load_settings()
    of_logs = find_logs(logs, loaded) if logs else []
    files_known = known_contact(truth, len(runs) + len(of_logs))
    labelled: list[Times | None] = [None] * len(audits)
    for k, files in enumerate(of_logs):
        with progress(f"judging {files[0].name}") as report:
            audits.append(audit_files(files, loaded, report, truth[len(runs) + k] if files_known else None)[0])
        wanted = loaded.config.detect.true_events
        labelled.append(label_times(open_log(files, loaded).annotations, wanted) if wanted else None)
    if loaded.config.fit.contact == "none":
        labelled = [() for _ in audits]
    elif files_known:
        every = zip(files_known, audits, strict=True)
        labelled = [None if file is None else contact_times(file, a.signals.joint_names) for file, a in every]
    robots = [robot for _, robot in runs] + [None] * len(of_logs)
    return list(zip(audits, labelled, robots, strict=True))


def _found(judged: Sequence[Judged]) -> ArmRecommendation:
    from collaudit.core.api import recommend_arm

    audits = [audit for audit, *_ in judged]
    persistence_s, why = _persistence(audits)
    found = recommend_arm(audits, persistence_s, [times for _, times, _ in judged], _PER_HOUR)
    return replace(found, chosen_by=why)


def _say(audits: Sequence[Audit], found: ArmRecommendation, verbose: bool) -> None:
    from collaudit.reports.terminal.recommendation_text import recommendation_text
    from collaudit.reports.values.words import noticed_brief, noticed_n

    worst = max((a.result for a in audits), key=lambda result: noticed_n(result) or float("inf"))
    say(recommendation_text(found, noticed_brief(worst), terminal_width(), verbose), nl=False)


def _write(target: Path, answers: Mapping[str, ArmRecommendation], named: bool) -> None:
    """Write thresholds into a configuration, of named or several robots into their tables; checked before that.

    Raises:
        ConfigError: the file cannot be read, or would not be a configuration any more.
    """
    from collaudit.core.config import load_config, parse_config
    from collaudit.reports.files.written_files import atomic_write
    from collaudit.reports.terminal.recommendation_text import written_into

    load_config(target)
    text = target.read_text(encoding="utf-8")
    supported = {name: a for name, a in answers.items() if any(r.gamma_nm is not None for r in a.joints.values())}
    for name, found in supported.items():
        text = written_into(text, found, name if named or len(answers) > 1 else None)
    if not supported:
        note(f"nothing was written into {target}: the evidence supports no threshold")
        return
    parse_config(text, target)
    atomic_write(target, text)
    note(f"thresholds of {', '.join(supported)} written into {target}")


def _persistence(audits: Sequence[Audit]) -> tuple[float, PersistenceReason]:
    """The persistence, s, in whole samples of the slowest log, and why."""
    from collaudit.core.detection.rule import persistence_samples

    flags, period_s = overrides(), max(audit.result.log.sample_period_s for audit in audits)
    detect = load_settings().config.detect
    rules = [audit.result.rule for audit in audits]
    if "detect.n" in flags and detect.n is not None:
        return detect.n * period_s, "stated"
    if "detect.persistence_ms" in flags and detect.persistence_ms is not None:
        return persistence_samples(detect.persistence_ms / 1e3, period_s) * period_s, "stated"
    asked_ms = {rule.persistence_requested_ms for rule in rules}
    first_ms = rules[0].persistence_requested_ms if len(asked_ms) == 1 else None
    set_s = max(rule.persistence_s for rule in rules) if first_ms is None else first_ms / 1e3  # not as it was rounded
    return set_s, "set"


def _answer(found: ArmRecommendation) -> dict[str, object]:
    return {
        "logs": [asdict(log) for log in found.logs],
        "persistence_s": found.persistence_s,
        "persistence_by": found.chosen_by,
        "arm": asdict(found.rate),
        "joints": {joint: asdict(rule) for joint, rule in found.joints.items()},
        "set": {joint: asdict(opinion) for joint, opinion in found.set_rules.items()},
        "ranges": {joint: asdict(known) for joint, known in found.ranges.items()},
        "to_confirm": [asdict(stretch) for stretch in found.to_confirm],
        "counted": [asdict(stretch) for stretch in found.counted],
        "if_clean_nm": found.if_clean_nm,
        "highest": {joint: [asdict(peak) for peak in peaks] for joint, peaks in found.highest.items()},
        "units": found.units,
        "assumptions": found.assumptions,
        "planes": {joint: asdict(plane) for joint, plane in found.planes.items()},
    }
