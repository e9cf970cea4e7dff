"""What ``recommend`` rests on: runs and logs with what is known of contact in each, or the nights of a store."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from collaudit.cli.console import progress, say, say_object, terminal_width
from collaudit.cli.fleet.precedents import robots_in
from collaudit.cli.log_arguments import audit_files, known_contact
from collaudit.cli.settings import load_settings
from collaudit.core.data.audit_result import Audit
from collaudit.core.errors import EXIT_NOT_JUDGED, EXIT_PASS, ConfigError
from collaudit.core.history.stored_thresholds import StoredRecommendation, stored_recommendation
from collaudit.core.recommend.arm_evidence import Times
from collaudit.reports.files.run_files import AUDIT_NAME, read_run

#: An audit, what is known of contact in its log, and whose it is.
Judged = tuple[Audit, Times | None, str | None]


def by_arm(evidence: Sequence[Judged], robot: str | None) -> dict[str, list[Judged]]:
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


def run_evidence(inputs: Sequence[str], truth: Sequence[Path]) -> list[Judged]:
    """Runs are read, everything else is judged as a log; with what is known of contact, and whose it is."""
    from collaudit.core.api import find_logs, open_log
    from collaudit.core.scoring.known_events import contact_times, label_times

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
    for k, files in enumerate(found):
        with progress(f"judging {files[0].name}") as report:
            audits.append(audit_files(files, loaded, report, truth[len(runs) + k] if files_known else None)[0])
        wanted = loaded.config.detect.true_events
        labelled.append(label_times(open_log(files, loaded).annotations, wanted) if wanted else None)
    if loaded.config.fit.contact == "none":
        labelled = [() for _ in audits]
    elif files_known:
        every = zip(files_known, audits, strict=True)
        labelled = [None if file is None else contact_times(file, a.signals.joint_names) for file, a in every]
    recorded = {folder: robots_in(folder) for folder in {run.parent for run in runs}}
    robots = [recorded[run.parent].get(run.name) for run in runs] + [None] * len(found)
    return list(zip(audits, labelled, robots, strict=True))


def _runs_and_logs(inputs: Sequence[str]) -> tuple[list[Path], list[str]]:
    """Runs, those inside the folders of audits included, and whatever else is to be judged as a log."""

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


def recommend_from_store(store: str, robot: str | None, per_hour: float, as_json: bool) -> int:
    """Print what the nights of a robot recommend.

    Args:
        store: folder or URL.
        robot: its name; None where the store holds one only.
        per_hour: false alarms of the arm that are accepted.
        as_json: print JSON.

    Raises:
        ConfigError: the store holds several robots and none is named.
    """
    from collaudit.reports.store.result_store import ResultStore

    records = ResultStore(store).records(evidence=True)
    names = sorted({record.robot for record in records})
    if robot is None and len(names) != 1:
        raise ConfigError(
            "the store holds several robots",
            where="--robot",
            found=", ".join(names[:10]) or "none",
            expected="the name of one",
        )
    found = stored_recommendation(records, robot or names[0], per_hour)
    if as_json:
        say_object("collaudit/recommend-store/1", asdict(found))
    else:
        say(_text(found, per_hour), nl=False)
    known = any(rule.gamma_nm is not None for rule in found.joints.values())
    return EXIT_PASS if known else EXIT_NOT_JUDGED


def _text(found: StoredRecommendation, per_hour: float) -> str:
    from collaudit.reports.terminal.text_table import table
    from collaudit.reports.values.numbers import significant, stated

    head = ("joint", "gamma N·m", "n", "clean h", "largest clean N·m", "set N·m")
    rows = [
        (
            joint,
            "–" if rule.gamma_nm is None else stated(rule.gamma_nm),
            str(rule.n),
            significant(rule.hours),
            "–" if rule.largest_clean_nm is None else significant(rule.largest_clean_nm),
            "–" if rule.set_nm is None else stated(rule.set_nm),
        )
        for joint, rule in found.joints.items()
    ]
    asked = f"{significant(per_hour)} false alarms of the arm an hour"
    lines = [
        f"{found.robot}: {found.logs} logs of {len(found.nights)} nights, {significant(found.rate.hours)} clean hours"
    ]
    lines.append(_since("recommended gamma", found.supported_since, asked, found.rate.more_hours))
    if found.rate_set is not None:
        lines.append(_since("gamma as set", found.set_supported_since, asked, found.rate_set.more_hours))
    if found.left_out:
        lines.append(
            f"{found.left_out} logs judged with another friction file, model, detector or persistence do not count"
        )
    return "\n".join(lines) + "\n" + table(head, rows, range(1, len(head)), terminal_width())


def _since(what: str, night: str | None, asked: str, more_hours: float) -> str:
    if night is not None:
        return f"{what}: at most {asked} supported since {night}"
    missing = f"; {more_hours:.3g} more clean hours are needed at least" if more_hours > 0 else ""
    return f"{what}: at most {asked} not supported yet{missing}"
