"""Reading a baseline: a store of nights, an earlier audit's folder, a run's folder, or one ``audit.json``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from collaudit.core.data.audit_result import AUDIT_SCHEMA, AuditResult
from collaudit.core.data.policy_result import POLICY_SCHEMA, PolicyFile
from collaudit.core.errors import ConfigError
from collaudit.core.policy.baseline import Baseline, BaselineLog
from collaudit.reports.files.json_files import read_result
from collaudit.reports.files.run_files import AUDIT_NAME

#: What makes a folder a store.
STORE_NAME = "store.json"
#: The decision over an audit, in its folder.
POLICY_NAME = "policy.json"


def is_store(place: str) -> bool:
    """Whether a baseline is a store of nights: a URL, or a folder that says so."""
    return "://" in place or (Path(place) / STORE_NAME).is_file()


def read_baseline(place: str) -> Baseline:
    """What an audit is to be compared with.

    Args:
        place: folder or URL of a store, folder of an audit or a run, or an ``audit.json``.

    Raises:
        ConfigError: there is no audit. CollauditError: a file of it is damaged.
    """
    if is_store(place):
        from collaudit.core.policy.baseline import baseline_of_records
        from collaudit.reports.store.result_store import ResultStore, records_of

        return baseline_of_records(place, records_of(ResultStore(place).table().to_pylist()))
    path = Path(place)
    logs = tuple(_log(read_result(file, AuditResult, AUDIT_SCHEMA), robot) for file, robot in _files(path))
    if not logs:
        raise ConfigError(
            "there is no audit to compare with",
            where=str(path),
            expected=f"a store of nights, the folder of an audit or a run, or an {AUDIT_NAME}",
            hint="collaudit audit LOGS -c collaudit.toml -o BASELINE makes one",
        )
    return Baseline(path.name, logs)


def robots_in(out: Path) -> dict[str, str | None]:
    """Whose each run folder of an audit is, by its name, as the audit's policy.json says; empty without one."""
    if not (out / POLICY_NAME).is_file():
        return {}
    return {log.folder: log.robot for log in read_result(out / POLICY_NAME, PolicyFile, POLICY_SCHEMA).logs}


def _files(path: Path) -> Iterator[tuple[Path, str | None]]:
    """Every ``audit.json``, and whose log it is about; run folders of the audit's policy.json, else all there are."""
    if path.is_file():
        yield path, None
        return
    if (path / AUDIT_NAME).is_file():
        yield path / AUDIT_NAME, None
        return
    robots = robots_in(path)
    for audit in sorted(path.glob(f"*/{AUDIT_NAME}")):
        if not robots or audit.parent.name in robots:
            yield audit, robots.get(audit.parent.name)


def _log(result: AuditResult, robot: str | None) -> BaselineLog:
    return BaselineLog(
        robot=robot,
        sha256=result.log.sha256,
        start=result.log.start,
        judged=result.verdict != "not_judged",
        recorded_s=result.coverage.recorded_s,
        near_misses=len(result.near_misses),
        contacts=tuple((c.onset_s, c.end_s, c.joints) for c in result.contacts),
        rms_nm={joint: stats.rms_nm for joint, stats in result.residual.items() if stats.rms_nm is not None},
        friction=result.friction,
        findings=frozenset((finding.code, finding.joint) for finding in result.findings),
    )
