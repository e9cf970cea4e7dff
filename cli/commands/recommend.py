"""``collaudit recommend``: thresholds with their evidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from collaudit.cli.console import note, progress, terminal_width
from collaudit.cli.group import example_command
from collaudit.cli.settings import config_option, load_settings, robot_options, rule_options
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS

if TYPE_CHECKING:
    from collaudit.core.data.audit_result import Audit, RecommendedRule
    from collaudit.core.data.detection_result import DynamicThreshold

RECOMMEND_SCHEMA = "collaudit/recommend/1"


@example_command(
    "recommend",
    "collaudit recommend run/",
    "collaudit recommend out/monday out/tuesday --json",
    "collaudit recommend clean1.mcap clean2.mcap -c collaudit.toml --friction friction.json",
    "collaudit recommend run/ --dynamic >> collaudit.toml",
)
@click.argument("inputs", nargs=-1, required=True, metavar="RUN...|LOG...")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option(
    "--dynamic", "as_dynamic", is_flag=True, help="Print [detect.dynamic] tables: thresholds that grow with the motion."
)
@config_option
@robot_options
@rule_options
def command(inputs: tuple[str, ...], as_json: bool, as_dynamic: bool) -> int:
    """Recommend gamma and n per joint from collision-free residuals of finished runs, or of logs.

    All inputs count together. Each threshold comes with the hours it rests on, the false alarms they allow
    for, and the evidence that is missing. Collisions found in the inputs are left out. With --dynamic, what comes
    out goes into the configuration as it is, with gamma_nm = "dynamic".

    Exit code 3 when nothing could be recommended for any joint.
    """
    from collaudit.core.api import recommend
    from collaudit.reports.files.dynamic_toml import dynamic_toml
    from collaudit.reports.terminal.rules_text import rules_text

    audits = _audits(inputs)
    rules = recommend(audits, _persistence_s(audits))
    laws = _dynamic(audits)
    if as_dynamic and not as_json:
        click.echo(dynamic_toml(laws), nl=False)
    else:
        click.echo(_json(audits, rules, laws) if as_json else rules_text(rules, terminal_width()), nl=False)
    collisions = sum(len(audit.result.collisions) for audit in audits)
    if collisions:
        note(f"{collisions} collisions in the inputs were left out")
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


def _audits(inputs: Sequence[str]) -> list[Audit]:
    """Runs are read, everything else is judged as a log."""
    from collaudit.cli.log_arguments import audit_files
    from collaudit.core.api import find_logs
    from collaudit.reports.files.run_files import AUDIT_NAME, read_run

    runs = [Path(text) for text in inputs if (Path(text) / AUDIT_NAME).is_file()]
    logs = [text for text in inputs if Path(text) not in runs]
    audits = [read_run(run) for run in runs]
    loaded = load_settings()
    for files in find_logs(logs, loaded) if logs else []:
        with progress(f"reading {files[0].name}") as report:
            audits.append(audit_files(files, loaded, report)[0])
    return audits


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
    }
    return json_text(content, indent=2)
