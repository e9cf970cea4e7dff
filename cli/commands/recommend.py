"""``collaudit recommend``: thresholds with their evidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from collaudit.cli.console import note, say, say_json, terminal_width
from collaudit.cli.contact_arguments import contact_options, known_contact
from collaudit.cli.group import example_command
from collaudit.cli.progress_bar import progress
from collaudit.cli.settings import config_option, load_settings, robot_options, rule_options
from collaudit.cli.study_output import say_studies
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS

if TYPE_CHECKING:
    from collaudit.core.data.audit_result import Audit, RecommendedRule
    from collaudit.core.data.detection_result import DynamicThreshold
    from collaudit.core.recommend.arm_evidence import Times

RECOMMEND_SCHEMA = "collaudit/recommend/1"


@example_command(
    "recommend",
    "collaudit recommend run/",
    "collaudit recommend out/monday out/tuesday --json",
    "collaudit recommend clean1.mcap clean2.mcap -c collaudit.toml --friction friction.json",
    "collaudit recommend run/ --dynamic >> collaudit.toml",
    "collaudit recommend hits.mcap -c collaudit.toml --truth contacts.csv",
)
@click.argument("inputs", nargs=-1, required=True, metavar="RUN...|LOG...")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option(
    "--dynamic", "as_dynamic", is_flag=True, help="Print [detect.dynamic] tables: thresholds that grow with the motion."
)
@contact_options
@config_option
@robot_options
@rule_options
def command(inputs: tuple[str, ...], as_json: bool, as_dynamic: bool, truth: tuple[Path, ...]) -> int:
    """Recommend gamma and n per joint from contact-free residuals of finished runs, or of logs.

    All inputs count together. Each threshold comes with the hours that support it, the false alarms they allow
    for, and the evidence that is missing. Alarms found in the inputs are left out; where --truth or --labels says
    what was contact, that is left out instead, and with --free-of-contact nothing is. With --dynamic, what comes
    out goes into the configuration as it is, with gamma_nm = "dynamic".

    Exit code 3 when nothing could be recommended for any joint.
    """
    from collaudit.core.api import recommend
    from collaudit.reports.files.dynamic_toml import dynamic_toml
    from collaudit.reports.terminal.rules_text import rules_text

    audits, known = _audits(inputs, truth)
    with progress("recommending"):
        rules = recommend(audits, _persistence_s(audits), known)
        laws = _dynamic(audits)
    if as_json:
        say_json(_json(audits, rules, laws))
    elif as_dynamic:
        say(dynamic_toml(laws), nl=False)
    else:
        say(rules_text(rules, terminal_width()), nl=False)
        say_studies(audits)
    collisions = sum(len(audit.result.collisions) for audit in audits)
    if collisions:
        stated = any(times is not None for times in known)
        note(f"{collisions} alarms in the inputs: " + ("what is known of contact decided" if stated else "left out"))
    return EXIT_PASS if any(rule.gamma_nm is not None for rule in rules.values()) else EXIT_NOT_JUDGED


def _persistence_s(audits: Sequence[Audit]) -> float | None:
    """The persistence asked for, in whole samples of the slowest log; None leaves it to the runs."""
    from collaudit.core.detection.rule import persistence_samples

    detect = load_settings().config.detect
    period_s = max(audit.result.log.sample_period_s for audit in audits)
    if detect.n is not None:
        return detect.n * period_s
    if detect.persistence_ms is None:
        return None
    return persistence_samples(detect.persistence_ms / 1e3, period_s) * period_s


def _audits(inputs: Sequence[str], truth: Sequence[Path]) -> tuple[list[Audit], list[Times | None]]:
    """Runs are read, everything else is judged as a log; and what is known of contact in each."""
    from collaudit.cli.log_arguments import audit_files
    from collaudit.cli.study_output import with_study
    from collaudit.core.api import find_logs, open_log
    from collaudit.core.scoring.known_events import contact_times, label_times
    from collaudit.reports.files.run_files import AUDIT_NAME, read_run

    runs = [Path(text) for text in inputs if (Path(text) / AUDIT_NAME).is_file()]
    logs = [text for text in inputs if Path(text) not in runs]
    audits = [read_run(run) for run in runs]
    loaded = load_settings()
    found = find_logs(logs, loaded) if logs else []
    files_known = known_contact(truth, len(runs) + len(found))
    labelled: list[Times | None] = [None] * len(audits)
    for files in found:
        with progress(f"judging {files[0].name}") as report:
            audits.append(audit_files(files, with_study(loaded), report)[0])
        wanted = loaded.config.detect.true_events
        labelled.append(label_times(open_log(files, loaded).annotations, wanted) if wanted else None)
    if loaded.config.fit.contact == "none":
        return audits, [() for _ in audits]
    if files_known:
        every = zip(files_known, audits, strict=True)
        return audits, [None if file is None else contact_times(file, a.signals.joint_names) for file, a in every]
    return audits, labelled


def _dynamic(audits: Sequence[Audit]) -> dict[str, DynamicThreshold]:
    """The dynamic threshold of each joint that covers all the runs."""
    from collaudit.core.detection.threshold import pooled_dynamic

    learnt = [audit.result.detection.dynamic for audit in audits if audit.result.detection]
    joints = dict.fromkeys(joint for laws in learnt for joint in laws)
    pooled = {joint: pooled_dynamic([laws.get(joint) for laws in learnt]) for joint in joints}
    return {joint: law for joint, law in pooled.items() if law is not None}


def _json(audits: Sequence[Audit], rules: Mapping[str, RecommendedRule], laws: Mapping[str, DynamicThreshold]) -> str:
    from collaudit.reports.files.json_writer import json_text

    content = {
        "schema": RECOMMEND_SCHEMA,
        "logs": [{"name": a.result.log.name, "sha256": a.result.log.sha256} for a in audits],
        "joints": {joint: asdict(rule) for joint, rule in rules.items()},
        "dynamic": {joint: asdict(law) for joint, law in laws.items()},
        "studies": [asdict(a.study) for a in audits if a.study is not None],
    }
    return json_text(content, indent=2)
