"""The folder of an audit: whose it is, and that no verdict of an earlier night stands in it."""

from __future__ import annotations

import os
import socket
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from collaudit.cli.batch.audit_one import FINISHED, read_note, remove_run
from collaudit.core.errors import CollauditError
from collaudit.core.small_files import read_object
from collaudit.reports.files.run_files import FRICTION_FOLDER
from collaudit.reports.files.written_files import CHECKSUMS_NAME, atomic_write, json_text
from collaudit.reports.formats.registry import FORMATS, formats_of_many
from collaudit.reports.page.environment import ASSETS_FOLDER, asset_names

MARKER = "AUDIT-UNDER-WAY.txt"
_SCHEMA = "collaudit/summary/"


@contextmanager
def audit_under_way(out: Path, folders: Sequence[str], kept: Collection[str]) -> Iterator[None]:
    """Make ``out`` ready for an audit; while it runs, and where it never ends, a marker stands in place of a verdict.

    Index, summaries, assets and all runs of earlier audits are removed before the first log is judged: those
    that were finished, and those that the marker of an ended audit names. The marker goes when the block ends well,
    which is after the new summaries were written.

    Args:
        out: folder of the audit, made when missing.
        folders: names of the run folders.
        kept: those of them whose runs stay.

    Raises:
        CollauditError: the folder is not ours, another audit writes into it, or it cannot be written.
    """
    _check_owner(out)
    marker = out / MARKER
    finished = [note.parent.name for note in out.glob(f"*/{FINISHED}") if read_note(note.parent) is not None]
    runs = {*folders, *_marked(marker), *finished}
    note = "An audit is under way here, or was ended before it finished. There is no verdict yet."
    owner = {"host": socket.gethostname(), "process": os.getpid()}
    atomic_write(marker, json_text({"note": note, **owner, "runs": sorted(runs)}))
    assets = (f"{ASSETS_FOLDER}/{file.name}" for file in (out / ASSETS_FOLDER).glob("*-*.js"))
    frictions = (f"{FRICTION_FOLDER}/{file.name}" for file in (out / FRICTION_FOLDER).glob("*.json"))
    for name in (*own_files(), *assets, *frictions, CHECKSUMS_NAME):
        _remove(out / name)
    for folder in sorted(runs.difference(kept)):
        remove_run(out / folder)
    yield
    marker.unlink(missing_ok=True)


def own_files() -> list[str]:
    """Names of what an audit may write into its folder itself, its checksums aside."""
    return [
        "index.html",
        "summary.json",
        *(f"summary{FORMATS[name].suffix}" for name in formats_of_many()),
        *asset_names(),
    ]


def _remove(path: Path) -> None:
    """Remove a file or a link, never what a link points to."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise CollauditError(
            "an earlier result cannot be removed", where=str(path), found=error.strerror or str(error)
        ) from error


def _marked(marker: Path) -> list[str]:
    """Run folders of an audit that was ended, as its marker names them."""
    named = read_object(marker, 1 << 30).get("runs")
    texts = [name for name in named if isinstance(name, str)] if isinstance(named, list) else []
    return [name for name in texts if Path(name).name == name != ".."]


def _check_owner(out: Path) -> None:
    try:
        content = sorted(entry.name for entry in out.iterdir()) if out.exists() else []
    except OSError as error:
        raise CollauditError(
            "not a folder that can be written", where=str(out), found=error.strerror or str(error)
        ) from error
    summary = out / "summary.json"
    is_audit = not summary.is_symlink() and str(read_object(summary, 1 << 30).get("schema")).startswith(_SCHEMA)
    if MARKER in content:
        _check_idle(out / MARKER)
    elif content and not is_audit:
        raise CollauditError(
            "the output folder holds something else than an audit",
            where=str(out),
            found=", ".join(content[:3]) + (f" and {len(content) - 3} more" if len(content) > 3 else ""),
            expected="a new or empty folder, or one that collaudit audit wrote",
            hint="name another folder",
        )


def _check_idle(marker: Path) -> None:
    """Refuse where the marker's process still lives; a marker that tells nothing was left by a killed one."""
    owner = read_object(marker)
    process = owner.get("process")
    here = owner.get("host") == socket.gethostname() and isinstance(process, int)
    if here and process != os.getpid() and Path(f"/proc/{process}").exists():
        raise CollauditError(
            "another audit is writing into this folder",
            where=str(marker.parent),
            found=f"process {process}",
            hint="wait for it, or name another folder",
        )
