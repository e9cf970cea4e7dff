"""What ``recommend`` rests on: runs and logs, with what is known of contact in each."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from collaudit.cli.console import progress
from collaudit.cli.fleet.precedents import SUMMARY_NAME, audits_in
from collaudit.cli.settings import load_settings
from collaudit.cli.shared_steps import audit_files, known_contact
from collaudit.core.data.audit_result import Audit
from collaudit.core.errors import ConfigError
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
