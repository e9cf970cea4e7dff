"""``collaudit recommend``: thresholds with their evidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from collaudit.cli.console import note, say, say_json, terminal_width
from collaudit.cli.contact_arguments import contact_options, known_contact
from collaudit.cli.group import example_command
from collaudit.cli.progress_bar import progress
from collaudit.cli.settings import clean_option, config_option, load_settings, overrides, robot_options, rule_options
from collaudit.cli.study_output import say_studies
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS, ConfigError

if TYPE_CHECKING:
    from collaudit.core.data.audit_result import Audit
    from collaudit.core.data.detection_result import DynamicThreshold
    from collaudit.core.data.recommendation_result import PersistenceReason
    from collaudit.core.data.rule_study_result import JointPlane, PersistenceChoice
    from collaudit.core.recommend.arm_evidence import Times
    from collaudit.core.recommend.arm_recommendation import ArmRecommendation

#: False alarms of the arm per hour; as in core/recommend, which is not imported for --help.
DEFAULT_PER_HOUR = 0.001
RECOMMEND_SCHEMA = "collaudit/recommend/1"


@example_command(
    "recommend",
    "collaudit recommend run/",
    "collaudit recommend out/ --json",
    "collaudit recommend clean1.mcap clean2.mcap -c collaudit.toml --friction friction.json",
    "collaudit recommend run/ --per-hour 0.01 --max-delay-ms 40",
    "collaudit recommend run/ --snippet config >> collaudit.toml",
    "collaudit recommend hits.mcap -c collaudit.toml --truth contacts.csv",
)
@click.argument("inputs", nargs=-1, metavar="RUN...|LOG...")
@click.option("--store", metavar="STORE", help="Use the nights of a store as evidence instead (docs/history.md).")
@click.option("--robot", metavar="NAME", help="The robot, where the store holds several.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON: every assumption, the hours, what to confirm.")
@click.option(
    "--per-hour",
    type=click.FloatRange(min=0.0, min_open=True),
    default=DEFAULT_PER_HOUR,
    show_default=True,
    help="False alarms of the whole arm per hour that are accepted.",
)
@click.option(
    "--max-delay-ms",
    type=click.FloatRange(min=0.0, min_open=True),
    help="Longest delay to the alarm: a persistence that takes longer, by filter and samples or with contacts added "
    "to the logs, is not chosen.",
)
@click.option(
    "--snippet",
    type=click.Choice(["config", "franka", "ur"]),
    help="Print text to paste: the configuration's [detect] table, or a controller's call.",
)
@click.option(
    "--dynamic", "as_dynamic", is_flag=True, help="Print [detect.dynamic] tables: thresholds that grow with the motion."
)
@clean_option
@contact_options
@config_option
@robot_options
@rule_options
def command(
    inputs: tuple[str, ...],
    store: str | None,
    robot: str | None,
    as_json: bool,
    per_hour: float,
    max_delay_ms: float | None,
    snippet: str | None,
    as_dynamic: bool,
    truth: tuple[Path, ...],
) -> int:
    """Recommend gamma and n per joint so that the arm's false alarms stay below a rate, with the evidence.

    All inputs count together, all runs of an audit's folder included; the same log twice counts once. The bound
    (95 %) carries the error of the counts and how far minutes and logs differ. Where the hours do not support the
    rate asked for, it says so, and how many more would. Alarms and near misses of all joints, and what lies far
    beyond the usual, are left out and listed to be confirmed: --truth or --labels say what was contact, and --clean
    that nothing touched the arm.

    The persistence is the one that notices the least force, of contacts added to the logs; --n or
    --persistence-ms fix it. Runs have been studied where they were judged with `collaudit detect --study`; runs
    without a study keep the persistence that they were judged with.

    With --store, the clean hours of all nights of a robot count, and it says since when they support the rate.

    Exit code 3 when nothing could be recommended for any joint.
    """
    if store is not None and not inputs:
        from collaudit.cli.fleet.stored_evidence import recommend_from_store

        return recommend_from_store(store, robot, per_hour, as_json)
    if store is not None or not inputs:
        raise click.UsageError("Name runs or logs, or a store with --store; not both.")
    from collaudit.core.api import recommend_arm
    from collaudit.reports.files.dynamic_toml import dynamic_toml
    from collaudit.reports.files.rule_snippets import snippet as text_to_paste
    from collaudit.reports.terminal.recommendation_text import recommendation_text
    from collaudit.reports.terminal.study_text import planes_text

    audits, known = _audits(inputs, truth, per_hour, max_delay_ms)
    with progress("recommending") as report:
        persistence_s, why, compared = _persistence(audits, max_delay_ms)
        report(1, 10)
        found = recommend_arm(audits, persistence_s, known, per_hour)
        report(8, 10)
        found = replace(found, chosen_by=why, compared=compared)
        laws = _dynamic(audits)
    if as_json:
        say_json(_json(audits, found, laws))
    elif as_dynamic:
        say(dynamic_toml(laws), nl=False)
    elif snippet is not None:
        say(text_to_paste(snippet, found), nl=False)
    else:
        say(recommendation_text(found, terminal_width()), nl=False)
        say(planes_text(_planes(audits), found.units, terminal_width()) if len(audits) > 1 else "", nl=False)
        say_studies(audits, answer=False)
    if found.to_confirm and (as_json or as_dynamic or snippet is not None):
        count = len(found.to_confirm)
        note(f"{count} stretch{' was' if count == 1 else 'es were'} left out as possible contact: please confirm")
    return EXIT_PASS if any(rule.gamma_nm is not None for rule in found.joints.values()) else EXIT_NOT_JUDGED


def _persistence(
    audits: Sequence[Audit], max_delay_ms: float | None
) -> tuple[float, PersistenceReason, tuple[PersistenceChoice, ...]]:
    """The persistence, s, in whole samples of the slowest log; why; and those that were compared.

    Raises:
        ConfigError: no persistence reacts as soon as wanted.
    """
    from collaudit.core.detection.rule import persistence_samples
    from collaudit.core.rule_study.persistence_choice import pooled_choices

    flags, period_s = overrides(), max(audit.result.log.sample_period_s for audit in audits)
    longest_s = None if max_delay_ms is None else _longest_s(audits, max_delay_ms, period_s)
    detect = load_settings().config.detect
    rules = [audit.result.rule for audit in audits]
    if "detect.n" in flags and detect.n is not None:
        return _no_longer(detect.n * period_s, longest_s), "stated", ()
    if "detect.persistence_ms" in flags and detect.persistence_ms is not None:
        asked_s = persistence_samples(detect.persistence_ms / 1e3, period_s) * period_s
        return _no_longer(asked_s, longest_s), "stated", ()
    studied = [audit.study.choices for audit in audits if audit.study is not None]
    delay_s = None if max_delay_ms is None else max_delay_ms / 1e3
    compared = pooled_choices(studied, max(rule.n for rule in rules), delay_s, longest_s)
    for choice in compared:
        if choice.chosen:
            return choice.persistence_s, "chosen", compared
    return _no_longer(max(rule.persistence_s for rule in rules), longest_s), "set", compared


def _no_longer(persistence_s: float, longest_s: float | None) -> float:
    return persistence_s if longest_s is None else min(persistence_s, longest_s)


def _longest_s(audits: Sequence[Audit], max_delay_ms: float, period_s: float) -> float:
    """The longest persistence that alarms in time, by the filter's delay and one sample of jitter.

    Raises:
        ConfigError: none does.
    """
    facts = [audit.result.detection for audit in audits]
    filter_s = max((known.delay.filter_s for known in facts if known is not None), default=0.0)
    most = int((max_delay_ms / 1e3 - filter_s) / period_s + 1e-9) - 1
    if most < 1:
        raise ConfigError(
            "no persistence reacts as soon as that",
            where="--max-delay-ms",
            found=f"{max_delay_ms:g} ms",
            expected=f"at least {1e3 * (filter_s + 2 * period_s):.3g} ms: the filter's delay and two samples",
        )
    return most * period_s


def _audits(
    inputs: Sequence[str], truth: Sequence[Path], per_hour: float, max_delay_ms: float | None
) -> tuple[list[Audit], list[Times | None]]:
    """Runs are read, everything else is judged as a log and studied; and what is known of contact in each."""
    from collaudit.cli.log_arguments import audit_files
    from collaudit.cli.study_output import with_study
    from collaudit.core.api import find_logs, open_log
    from collaudit.core.scoring.known_events import contact_times, label_times
    from collaudit.reports.files.run_files import read_run

    runs, logs = _runs_and_logs(inputs)
    audits = []
    with progress("reading runs") as report:
        for k, run in enumerate(runs, 1):
            audits.append(read_run(run))
            report(k, len(runs))
    loaded = load_settings()
    found = find_logs(logs, loaded) if logs else []
    files_known = known_contact(truth, len(runs) + len(found))
    labelled: list[Times | None] = [None] * len(audits)
    studied = with_study(loaded, per_hour, max_delay_ms)
    for k, files in enumerate(found):
        with progress(f"judging {files[0].name}") as report:
            audits.append(audit_files(files, studied, report, truth[len(runs) + k] if files_known else None)[0])
        wanted = loaded.config.detect.true_events
        labelled.append(label_times(open_log(files, loaded).annotations, wanted) if wanted else None)
    if loaded.config.fit.contact == "none":
        return audits, [() for _ in audits]
    if files_known:
        every = zip(files_known, audits, strict=True)
        return audits, [None if file is None else contact_times(file, a.signals.joint_names) for file, a in every]
    return audits, labelled


def _runs_and_logs(inputs: Sequence[str]) -> tuple[list[Path], list[str]]:
    """Runs, those inside the folders of audits included, and whatever else is to be judged as a log."""
    from collaudit.reports.files.run_files import AUDIT_NAME

    runs, logs = [], []
    for text in inputs:
        folder = Path(text)
        inside = sorted(path.parent for path in folder.glob(f"*/{AUDIT_NAME}"))
        if (folder / AUDIT_NAME).is_file():
            runs.append(folder)
        elif inside and (folder / "summary.json").is_file():
            runs += inside
        else:
            logs.append(text)
    return runs, logs


def _dynamic(audits: Sequence[Audit]) -> dict[str, DynamicThreshold]:
    """The dynamic threshold of each joint that covers all the runs."""
    from collaudit.core.detection.threshold import pooled_dynamic

    learnt = [audit.result.detection.dynamic for audit in audits if audit.result.detection]
    joints = dict.fromkeys(joint for laws in learnt for joint in laws)
    pooled = {joint: pooled_dynamic([laws.get(joint) for laws in learnt]) for joint in joints}
    return {joint: law for joint, law in pooled.items() if law is not None}


def _planes(audits: Sequence[Audit]) -> dict[str, JointPlane]:
    """The planes of all logs that were studied, as one."""
    from collaudit.core.rule_study.pooled_planes import pooled_planes

    return pooled_planes([audit.study for audit in audits if audit.study is not None])


def _json(audits: Sequence[Audit], found: ArmRecommendation, laws: Mapping[str, DynamicThreshold]) -> str:
    from collaudit.reports.files.json_writer import json_text

    content = {
        "schema": RECOMMEND_SCHEMA,
        "logs": [asdict(log) for log in found.logs],
        "persistence_s": found.persistence_s,
        "persistence_by": found.chosen_by,
        "persistences": [asdict(choice) for choice in found.compared],
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
        "dynamic": {joint: asdict(law) for joint, law in laws.items()},
        "planes": {joint: asdict(plane) for joint, plane in _planes(audits).items()},
        "studies": [asdict(a.study) for a in audits if a.study is not None],
    }
    return json_text(content, indent=2)
