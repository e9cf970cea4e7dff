"""Files of results: those of a run (``audit.json``, ``signals.parquet``, ``friction.json``, …) and ``plan.json``."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from collaudit.core.data.audit_result import AUDIT_SCHEMA, FRICTION_SCHEMA, Audit, AuditResult, FrictionFile
from collaudit.core.data.plan_result import PlanFile
from collaudit.core.errors import CollauditError, similar_file
from collaudit.core.numeric.arrays import LARGEST
from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.files.json_files import json_text, read_result

if TYPE_CHECKING:
    from collaudit.core.data.rule_study_result import RuleStudy
    from collaudit.reports.files.signals_file import StoredSignals

AUDIT_NAME = "audit.json"
SIGNALS_NAME = "signals.parquet"
FRICTION_NAME = "friction.json"
STUDY_NAME = "study.json"
#: Runs named in a message.
_OFFERED = 6


#: The last fit and its text: logs that are judged with one file in turn all keep a copy of it.
_written: tuple[FrictionFile, str] | None = None
AUDITS_SCHEMA = "collaudit/audits/1"


def result_json(result: AuditResult | FrictionFile | RuleStudy | PlanFile) -> str:
    """The file of a result; the same result gives the same text.

    Raises:
        ValueError: the result breaks its own types (a required number is not finite, say): a bug.
    """
    text = json_text(result)
    try:
        msgspec.json.decode(text, type=type(result))
    except msgspec.ValidationError as error:
        raise ValueError(f"{type(result).__name__} breaks its own types: {error}") from error
    return text


def friction_json(file: FrictionFile) -> str:
    """``friction.json`` of a fit, as of :func:`result_json`."""
    global _written
    if _written is None or _written[0] is not file:
        _written = file, result_json(file)
    return _written[1]


def write_friction(path: Path, file: FrictionFile) -> None:
    """Write a friction file whole or not at all.

    Raises:
        CollauditError: the file cannot be written.
    """
    atomic_write(path, friction_json(file))


def read_friction(path: Path) -> FrictionFile:
    """Read and check a friction file.

    Raises:
        CollauditError: it is missing, damaged, of another kind or version, does not fit, or holds numbers that no fit
            gives.
    """
    from collaudit.core.friction.friction_model import unusable

    file = read_result(path, FrictionFile, FRICTION_SCHEMA)
    wrong = {f"$.joints.{joint}": unusable(fit) for joint, fit in file.joints.items()}
    thresholds = {} if file.thresholds is None else file.thresholds.joints
    for joint, known in thresholds.items():
        levels = [level.gamma_nm for level in known.levels if not 0.0 < level.gamma_nm <= LARGEST]
        wrong |= {f"$.thresholds.joints.{joint}": f"a threshold of {levels[0]:g} N·m"} if levels else {}
    for place, found in wrong.items():
        if found is not None:
            hint = "make the file again; it may have been edited"
            raise CollauditError("this is nothing that a fit gives", where=f"{path}: {place}", found=found, hint=hint)
    return file


def earlier_friction(path: Path) -> FrictionFile | None:
    """The friction file that is about to be replaced; None where there is none, or none that can be read."""
    try:
        return read_friction(path) if path.exists() else None
    except CollauditError:
        return None


def no_run(folder: Path) -> CollauditError:
    """The error for a folder that is no run; it offers the runs inside, where there are any."""
    inside = sorted(path.parent for path in folder.glob(f"*/{AUDIT_NAME}"))
    found = "nothing of that name" if not folder.exists() else f"no {AUDIT_NAME} in it"
    hint = similar_file(folder) or "make one with: collaudit detect LOG -c collaudit.toml -o RUN/"
    if inside:
        names = [str(run) for run in inside[:_OFFERED]]
        more = f" and {len(inside) - _OFFERED} more" if len(inside) > _OFFERED else ""
        found = f"{len(inside)} run folder{'s' if len(inside) > 1 else ''} inside: {', '.join(names)}{more}"
        hint = f"collaudit report {shlex.join(names) if not more else shlex.quote(str(folder)) + '/*/'} -o report.html"
    return CollauditError(
        "this is not a run folder",
        where=str(folder),
        found=found,
        expected=f"a folder with {AUDIT_NAME} and {SIGNALS_NAME}",
        hint=hint,
    )


def read_run(run_dir: Path) -> Audit:
    """Read a run's folder back.

    Args:
        run_dir: a folder made by :func:`~collaudit.reports.files.run_folder.write_run`.

    Returns:
        The result as written, and its signals.

    Raises:
        CollauditError: no run there, or a file is damaged, of another version, or of another log.
    """
    from collaudit.reports.files.signals_file import read_signals

    result = _result(run_dir)
    return Audit(result, read_signals(run_dir / SIGNALS_NAME, result.log.sha256), _study(run_dir))


def _result(run_dir: Path) -> AuditResult:
    if not (run_dir / AUDIT_NAME).is_file():
        raise no_run(run_dir)
    return read_result(run_dir / AUDIT_NAME, AuditResult, AUDIT_SCHEMA)


def _study(run_dir: Path) -> RuleStudy | None:
    if not (run_dir / STUDY_NAME).is_file():
        return None
    from collaudit.core.data.rule_study_result import STUDY_SCHEMA, RuleStudy

    return read_result(run_dir / STUDY_NAME, RuleStudy, STUDY_SCHEMA)


@dataclass(frozen=True, slots=True, eq=False)
class StoredRun:
    """A run whose signals are read when they are drawn."""

    result: AuditResult
    signals: StoredSignals
    study: RuleStudy | None = None


def open_run(run_dir: Path) -> StoredRun:
    """A run's folder for a report: the result as written, and its signals joint by joint.

    Raises:
        CollauditError: as :func:`read_run`.
    """
    from collaudit.reports.files.signals_file import StoredSignals

    result = _result(run_dir)
    return StoredRun(result, StoredSignals(run_dir / SIGNALS_NAME, result.log.sha256), _study(run_dir))


def audits_json(audits: Sequence[Audit]) -> str:
    """The results as JSON.

    Args:
        audits: at least one.
    """
    results = [audit.result for audit in audits]
    if len(results) == 1:
        return result_json(results[0])
    return json_text({"schema": AUDITS_SCHEMA, "audits": results})
