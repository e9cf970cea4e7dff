"""The decision over the logs of an audit, by policy, baseline and waivers; the manifest of what it read and wrote."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime
from functools import cache
from pathlib import Path

from collaudit.cli.batch.log_jobs import LogJob, Outcome
from collaudit.core.config import LoadedConfig
from collaudit.core.config.schema import PolicyConfig
from collaudit.core.data.audit_result import AuditResult, Verdict
from collaudit.core.data.policy_result import POLICY_SCHEMA, LogDecision, PolicyFile
from collaudit.core.errors import LogError
from collaudit.core.findings import findings_with_level
from collaudit.core.logs.opening import data_files
from collaudit.core.policy.baseline import Baseline
from collaudit.core.policy.decision import WaiverBook, decide_log
from collaudit.core.policy.rule_outcomes import LogInQuestion, NightOfRobot
from collaudit.core.provenance import versions
from collaudit.reports.files.manifest_file import (
    MANIFEST_SCHEMA,
    Manifest,
    ManifestFile,
    ManifestLog,
    Role,
    file_entry,
    written_files,
)
from collaudit.reports.values.entries import IndexEntry


@dataclass(frozen=True, slots=True)
class Decisions:
    """What was decided over an audit.

    Attributes:
        entries: a line for every log, with its decided verdict.
        results: of the logs that were audited, with their decided verdicts.
        verdicts: what the exit code follows from.
        file: ``policy.json``.
    """

    entries: tuple[IndexEntry, ...]
    results: tuple[AuditResult, ...]
    verdicts: tuple[Verdict, ...]
    file: PolicyFile


@dataclass(frozen=True, slots=True)
class NightPolicy:
    """Policy, baseline and waivers of one audit.

    Attributes:
        policy: of the common configuration.
        baseline: what is compared with, None for nothing.
        fail_on: what else than an error fails.
        as_of: day on which waivers are looked at.
        came: logs that have come so far, where each is decided on as it comes.
    """

    policy: PolicyConfig
    baseline: Baseline | None
    fail_on: tuple[str, ...] = ()
    as_of: date = field(default_factory=lambda: datetime.now(UTC).date())
    came: list[tuple[LogJob, Outcome]] = field(default_factory=list)

    def verdict_of(self, job: LogJob, outcome: Outcome) -> Verdict:
        """The decided verdict on one log, as it comes: its near misses count with those of the logs before it."""
        self.came.append((job, outcome))
        waivers = WaiverBook(self.policy.waivers, self.as_of)
        return self._decision(job, outcome, _nights(self.came)[job.robot], waivers).verdict

    def decide(self, jobs: Sequence[LogJob], outcomes: Sequence[Outcome]) -> Decisions:
        """Decide on all logs.

        Args:
            jobs: the logs.
            outcomes: in their order.
        """
        waivers = WaiverBook(self.policy.waivers, self.as_of)
        every = list(zip(jobs, outcomes, strict=True))
        nights = _nights(every)
        decisions = [self._decision(job, outcome, nights[job.robot], waivers) for job, outcome in every]
        pairs = list(zip(outcomes, decisions, strict=True))
        findings = waivers.findings()
        verdicts = [decision.verdict for decision in decisions]
        fails = {"error", "warn"} if "warn" in self.fail_on else {"error"}
        if any(level in fails for _, level in findings_with_level(findings, self.policy.findings)):
            verdicts.append("fail")
        if "not-judged" in self.fail_on and "not_judged" in verdicts:
            verdicts.append("fail")
        return Decisions(
            entries=tuple(self._entry(o, d) for o, d in pairs),
            results=tuple(replace(o.result, verdict=d.verdict, reasons=d.reasons) for o, d in pairs if o.result),
            verdicts=tuple(verdicts),
            file=PolicyFile(
                schema=POLICY_SCHEMA,
                as_of=self.as_of.isoformat(),
                baseline=None if self.baseline is None else self.baseline.name,
                fail_on=self.fail_on,
                logs=tuple(decisions),
                findings=tuple(findings),
            ),
        )

    def _entry(self, outcome: Outcome, decision: LogDecision) -> IndexEntry:
        """The line of a log as decided; with a baseline, the rule on contacts has counted those that are new."""
        new = [int(one.value or 0) for one in decision.rules if one.rule == "contacts" and self.baseline is not None]
        entry, count = outcome.entry, new[0] if new else None
        return replace(entry, verdict=decision.verdict, reasons=decision.reasons, new_contacts=count)

    def _decision(self, job: LogJob, outcome: Outcome, night: NightOfRobot, waivers: WaiverBook) -> LogDecision:
        entry, place = outcome.entry, job.url or job.files[0].as_posix()
        if outcome.result is None:
            return LogDecision(entry.name, job.robot, place, job.folder, "not_judged", entry.reasons, ())
        path = job.loaded.friction_path
        log = LogInQuestion(
            outcome.result,
            job.loaded.config.policy,
            job.robot,
            place,
            job.folder,
            None if path is None else _fitted_until(path),
            path is None,
            night,
            outcome.record,
        )
        return decide_log(log, waivers, self.baseline, self.fail_on)


def _nights(came: Sequence[tuple[LogJob, Outcome]]) -> dict[str | None, NightOfRobot]:
    results: dict[str | None, list[AuditResult]] = {job.robot: [] for job, _ in came}
    for job, outcome in came:
        results[job.robot] += [] if outcome.result is None else [outcome.result]
    return {robot: NightOfRobot.of(found) for robot, found in results.items()}


@cache
def _fitted_until(path: Path) -> str | None:
    from collaudit.reports.files.run_files import read_friction

    recorded = read_friction(path).recorded
    return None if recorded is None else recorded[1]


def night_manifest(
    out: Path,
    jobs: Sequence[LogJob],
    outcomes: Sequence[Outcome],
    decisions: Decisions,
    settings: Sequence[LoadedConfig],
    top: Sequence[str],
) -> Manifest:
    """The manifest of an audit whose other files stand.

    Args:
        out: its folder.
        jobs, outcomes: its logs and what became of them.
        decisions: over them.
        settings: the common ones and those of every robot.
        top: names of the audit's own files in ``out``.
    """
    from importlib.metadata import version

    verdicts = [entry.verdict for entry in decisions.entries]
    logs = [_log(*item) for item in zip(jobs, outcomes, verdicts, strict=True)]
    named = dict.fromkeys(file for one in settings for file in _settings_files(one))
    inputs = [file_entry(path, path.as_posix(), role) for path, role in named]
    inputs += [entry for job, outcome in zip(jobs, outcomes, strict=True) for entry in _log_files(job, outcome)]
    return Manifest(
        schema=MANIFEST_SCHEMA,
        collaudit=version("collaudit"),
        packages=versions(),
        inputs=tuple(inputs),
        logs=tuple(logs),
        outputs=written_files(out, top, [job.folder for job in jobs]),
    )


def _log(job: LogJob, outcome: Outcome, verdict: str) -> ManifestLog:
    made = None if outcome.result is None else outcome.result.provenance
    return ManifestLog(
        log=outcome.entry.name,
        robot=job.robot,
        folder=job.folder,
        verdict=verdict,
        log_sha256=None if outcome.result is None else outcome.result.log.sha256,
        config_sha256=job.loaded.sha256,
        friction_sha256=None if made is None else made.friction_sha256,
        model_sha256=None if made is None else made.model_sha256,
    )


def _log_files(job: LogJob, outcome: Outcome) -> Iterator[ManifestFile]:
    """The files of a log; the hash that its result has is not computed again."""
    if job.url is not None:
        digest = None if outcome.result is None else outcome.result.log.sha256
        yield ManifestFile(job.url, digest, None, "log")
    for path in job.files:
        try:
            files = data_files(path)
        except LogError:
            files = ()
        if len(job.files) == len(files) == 1 and outcome.result is not None and files[0].is_file():
            yield ManifestFile(files[0].as_posix(), outcome.result.log.sha256, files[0].stat().st_size, "log")
            continue
        yield from (file_entry(file, file.as_posix(), "log") for file in files or (path,))


def _settings_files(loaded: LoadedConfig) -> Iterator[tuple[Path, Role]]:
    config = loaded.config
    if loaded.path is not None:
        yield loaded.path, "configuration"
    if config.fleet.file is not None:
        yield config.fleet.file, "fleet"
    if config.friction.file is not None:
        yield config.friction.file, "friction"
    if loaded.urdf_path is not None:
        yield loaded.urdf_path, "robot"
