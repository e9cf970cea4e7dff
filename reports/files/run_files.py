"""Files of results: a run's (``audit.json``, ``signals.parquet``, ``friction.json``, ``cycles.npz``), ``plan.json``."""

from __future__ import annotations

import hashlib
import io
import shlex
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from collaudit.core.data.audit_result import AUDIT_SCHEMA, FRICTION_SCHEMA, Audit, AuditResult, FrictionFile
from collaudit.core.data.plan_result import PlanFile
from collaudit.core.data.signals import CycleReference
from collaudit.core.errors import CollauditError, similar_file
from collaudit.core.numeric.arrays import LARGEST
from collaudit.core.small_files import read_small
from collaudit.reports.files.written_files import (
    atomic_write,
    json_text,
    read_result,
    refuse_link,
    staged,
    write_synced,
)

if TYPE_CHECKING:
    from collaudit.reports.files.signals_file import StoredSignals

AUDIT_NAME = "audit.json"
SIGNALS_NAME = "signals.parquet"
FRICTION_NAME = "friction.json"
#: The residual over the path of a program, for the store of nights.
CYCLES_NAME = "cycles.npz"
_CYCLE_ARRAYS = ("position_rad", "share", "speed", "median_nm", "spread_nm")
#: In the folder of an audit: friction files by their hash, each once however many logs were judged with it.
FRICTION_FOLDER = "friction"
#: Runs named in a message.
_OFFERED = 6


AUDITS_SCHEMA = "collaudit/audits/1"


def result_json(result: AuditResult | FrictionFile | PlanFile) -> str:
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


def write_friction(path: str | Path, file: FrictionFile) -> None:
    """Write a friction file whole or not at all.

    Raises:
        CollauditError: the file cannot be written.
    """
    atomic_write(Path(path), result_json(file))


def read_friction(path: str | Path) -> FrictionFile:
    """Read and check a friction file.

    Raises:
        CollauditError: it is missing, damaged, of another kind or version, does not fit, or holds numbers that no fit
            gives.
    """
    path = Path(path)
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


def keep_friction(out: Path, files: Sequence[Path]) -> None:
    """Copy friction files into an audit's folder, named by their hash: ``provenance.friction_sha256`` of each run.

    Raises:
        CollauditError: one cannot be written. OSError: one cannot be read.
    """
    for file in files:
        content = read_small(file, 1 << 30)
        atomic_write(out / FRICTION_FOLDER / f"{hashlib.sha256(content).hexdigest()}.json", content)


def friction_of_run(run_dir: Path) -> Path | None:
    """The friction file that a run was judged with, its own or the audit's; None where it was fitted on the log."""
    own = run_dir / FRICTION_NAME
    shared = run_dir.absolute().parent / FRICTION_FOLDER / f"{_result(run_dir).provenance.friction_sha256}.json"
    return next((path for path in (own, shared) if path.is_file()), None)


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
    hint = (
        None if folder.exists() else similar_file(folder)
    ) or "make one with: collaudit detect LOG -c collaudit.toml -o RUN/"
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


def read_run(run_dir: str | Path) -> Audit:
    """Read a run's folder back.

    Args:
        run_dir: a folder made by :func:`write_run`.

    Returns:
        The result as written, and its signals.

    Raises:
        CollauditError: no run there, or a file is damaged, of another version, or of another log.
    """
    run_dir = Path(run_dir)
    from collaudit.reports.files.signals_file import read_signals

    result = _result(run_dir)
    return Audit(result, read_signals(run_dir / SIGNALS_NAME, result.log.sha256))


def _result(run_dir: Path) -> AuditResult:
    if not (run_dir / AUDIT_NAME).is_file():
        raise no_run(run_dir)
    return read_result(run_dir / AUDIT_NAME, AuditResult, AUDIT_SCHEMA)


@dataclass(frozen=True, slots=True, eq=False)
class StoredRun:
    """A run whose signals are read when they are drawn."""

    result: AuditResult
    signals: StoredSignals


def open_run(run_dir: Path) -> StoredRun:
    """A run's folder for a report: the result as written, and its signals joint by joint.

    Raises:
        CollauditError: as :func:`read_run`.
    """
    from collaudit.reports.files.signals_file import StoredSignals

    result = _result(run_dir)
    return StoredRun(result, StoredSignals(run_dir / SIGNALS_NAME, result.log.sha256))


def audits_json(audits: Sequence[Audit]) -> str:
    """The results as JSON.

    Args:
        audits: at least one.
    """
    results = [audit.result for audit in audits]
    if len(results) == 1:
        return result_json(results[0])
    return json_text({"schema": AUDITS_SCHEMA, "audits": results})


def write_run(run_dir: str | Path, audit: Audit, friction: FrictionFile | None) -> None:
    """Write a run's folder: all files are complete before the first one appears, ``audit.json`` last.

    Args:
        run_dir: folder, made when missing; the files of an earlier run in it are replaced.
        audit: the result and its signals.
        friction: what the run was judged with; without it an earlier ``friction.json`` is removed.

    Raises:
        CollauditError: a file cannot be written.
    """
    run_dir = Path(run_dir)
    from collaudit.reports.files.signals_file import write_signals

    refuse_link(run_dir)
    texts = {AUDIT_NAME: result_json(audit.result), FRICTION_NAME: None if friction is None else result_json(friction)}
    with ExitStack() as stack:  # renames run in reverse order of entering
        for name, text in texts.items():
            if text is not None:
                write_synced(stack.enter_context(staged(run_dir / name)), text.encode())
        file = stack.enter_context(stack.enter_context(staged(run_dir / SIGNALS_NAME)).open("wb"))
        write_signals(file, audit.signals, audit.result.log.sha256)
        if friction is None:
            (run_dir / FRICTION_NAME).unlink(missing_ok=True)


def reference_bytes(reference: CycleReference) -> bytes:
    """The file's content: arrays in 32 bits, and the version as text."""
    arrays = {name: getattr(reference, name).astype(np.float32) for name in _CYCLE_ARRAYS}
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, version=np.array(reference.version), **arrays)
    return buffer.getvalue()


def read_reference(content: bytes, night: str, log: str) -> CycleReference:
    """What :func:`reference_bytes` wrote.

    Args:
        content: of the file.
        night, log: ISO date, and first digits of the log's hash.

    Raises:
        CollauditError: it cannot be read.
    """
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            arrays = {name: file[name].astype(np.float64) for name in _CYCLE_ARRAYS}
            return CycleReference(version=str(file["version"]), night=night, log=log, **arrays)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CollauditError("the cycles of an earlier night cannot be read", found=str(error)) from error
