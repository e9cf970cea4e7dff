"""The manifest of an audit: what its jobs read, what was decided of them, and what stands in its folder."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from collaudit.cli.batch.log_jobs import LogJob, Outcome
from collaudit.cli.fleet.night_policy import Decisions
from collaudit.core.config import LoadedConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.opening import data_files
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
        log_hash_of="file" if outcome.fetched is None else outcome.fetched.hash_of,
        config_sha256=job.loaded.sha256,
        friction_sha256=None if made is None else made.friction_sha256,
        model_sha256=None if made is None else made.model_sha256,
    )


def _log_files(job: LogJob, outcome: Outcome) -> Iterator[ManifestFile]:
    """The files of a log; the hash that its result has is not computed again."""
    if job.url is not None:
        digest = None if outcome.result is None else outcome.result.log.sha256
        size = None if outcome.fetched is None else outcome.fetched.size_bytes
        yield ManifestFile(job.url, digest, size, "log")
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
