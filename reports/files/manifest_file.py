"""``manifest.json``: the hashes of all that an audit read and wrote, with settings and versions; and comparing them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Literal

from collaudit.core.errors import CollauditError
from collaudit.core.small_files import check_regular
from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.files.json_files import json_text, read_result

MANIFEST_SCHEMA = "collaudit/manifest/1"
MANIFEST_NAME = "manifest.json"
SIGNATURE_NAME = f"{MANIFEST_NAME}.minisig"
Role = Literal["output", "log", "configuration", "fleet", "friction", "robot"]


@dataclass(frozen=True, slots=True)
class ManifestFile:
    """A file that was written, or read.

    Attributes:
        path: of an output relative to the folder, with ``/``; of an input as it was given.
        sha256: of its bytes; None where an input could not be read.
        size_bytes: its length; None likewise.
        role: ``output``, ``log``, ``configuration``, ``fleet``, ``friction`` or ``robot``.
    """

    path: str
    sha256: str | None
    size_bytes: int | None
    role: Role


@dataclass(frozen=True, slots=True)
class ManifestLog:
    """Inputs of the result of one log; hashes are None where there was none, or the log was not audited.

    Attributes:
        log: its name.
        robot: whose it is; None without a fleet.
        folder: of its run.
        verdict: as decided.
        log_sha256, config_sha256, friction_sha256, model_sha256: hashes of log, effective settings, friction, robot.
        log_hash_of: what ``log_sha256`` is of: ``file``, its bytes; of a remote log also ``stated``, its bytes by the
            word of its store, of which only parts were fetched; or ``parts``, size, places and bytes of these parts.
    """

    log: str
    robot: str | None
    folder: str
    verdict: str
    log_sha256: str | None
    config_sha256: str
    friction_sha256: str | None
    model_sha256: str | None
    log_hash_of: Literal["file", "stated", "parts"] = "file"


@dataclass(frozen=True, slots=True)
class Manifest:
    """``manifest.json`` of an audit.

    Attributes:
        schema: ``collaudit/manifest/1``.
        collaudit: version of this program.
        packages: name to version of what computes.
        inputs: files that were read.
        logs: inputs of each result.
        outputs: files that were written, but for this one and its signature.
    """

    schema: str
    collaudit: str
    packages: dict[str, str]
    inputs: tuple[ManifestFile, ...]
    logs: tuple[ManifestLog, ...]
    outputs: tuple[ManifestFile, ...]


@dataclass(frozen=True, slots=True)
class Difference:
    """A file that is not what the manifest says; ``unknown`` where it could not be compared."""

    path: str
    what: Literal["changed", "missing", "added", "unknown"]
    text: str


def file_entry(path: Path, name: str, role: Role) -> ManifestFile:
    """Hash and size of a file; None of both where it cannot be read."""
    try:
        check_regular(path)
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        return ManifestFile(name, digest, path.stat().st_size, role)
    except OSError:
        return ManifestFile(name, None, None, role)


def written_files(out: Path, top: Iterable[str], folders: Iterable[str]) -> tuple[ManifestFile, ...]:
    """What stands in an audit's folder, sorted by path.

    Args:
        out: the folder.
        top: names of its own files; those that are absent are left out.
        folders: names of folders in it, of which everything counts.
    """
    files = [out / name for name in top] + [file for name in folders for file in (out / name).rglob("*")]
    there = sorted({file.relative_to(out).as_posix() for file in files if file.is_file() and not file.is_symlink()})
    return tuple(file_entry(out / name, name, "output") for name in there)


def write_manifest(out: Path, manifest: Manifest) -> None:
    """Write ``manifest.json``; the same audit gives the same bytes.

    Raises:
        CollauditError: it cannot be written.
    """
    atomic_write(out / MANIFEST_NAME, json_text(manifest))


def read_manifest(out: Path) -> Manifest:
    """The manifest of an audit's folder.

    Raises:
        CollauditError: there is none, or it is damaged, or names files outside the folder.
    """
    path = out / MANIFEST_NAME
    if out.is_dir() and not path.is_file():
        raise CollauditError(
            "there is no manifest here", where=str(out), expected=f"the folder of an audit, with {MANIFEST_NAME}"
        )
    manifest = read_result(path, Manifest, MANIFEST_SCHEMA)
    for item in manifest.outputs:
        pure = PurePosixPath(item.path)
        if pure.is_absolute() or ".." in pure.parts or not pure.parts:
            raise CollauditError("the manifest names a file outside its folder", where=str(path), found=item.path)
    return manifest


def compare_outputs(out: Path, manifest: Manifest) -> list[Difference]:
    """Outputs that are missing or changed, and every file of the folder that the manifest does not name.

    Args:
        out: folder of the audit.
        manifest: what stood in it.
    """
    known = {item.path for item in manifest.outputs} | {MANIFEST_NAME, SIGNATURE_NAME}
    found = [difference for item in manifest.outputs if (difference := _compared(out / item.path, item)) is not None]
    for file in sorted(out.rglob("*")):
        name = file.relative_to(out).as_posix()
        if (file.is_symlink() or not file.is_dir()) and name not in known:
            found.append(Difference(name, "added", "was not written by this audit"))
    return found


def compare_inputs(manifest: Manifest, root: Path) -> list[Difference]:
    """Inputs that are changed, or that cannot be compared because they are not found.

    Args:
        manifest: what was read.
        root: folder from which the audit was run, for relative paths.
    """
    out = []
    for item in manifest.inputs:
        if item.sha256 is None:
            out.append(Difference(item.path, "unknown", "could not be read when the audit ran"))
        elif "://" in item.path:
            out.append(Difference(item.path, "unknown", "is remote, and is not fetched again"))
        elif (difference := _compared(root / item.path, item)) is not None:
            absent = difference.what == "missing"
            out.append(Difference(item.path, "unknown", "is not there to compare") if absent else difference)
    return out


def _compared(path: Path, item: ManifestFile) -> Difference | None:
    if path.is_symlink() and item.role == "output":
        return Difference(item.path, "changed", "is a symbolic link now")
    now = file_entry(path, item.path, item.role)
    if now.sha256 is None:
        return Difference(item.path, "missing", "is missing, or cannot be read")
    if now.sha256 == item.sha256:
        return None
    return Difference(item.path, "changed", f"has the hash {now.sha256[:12]}… and not {(item.sha256 or 'none')[:12]}…")


def summed(differences: Sequence[Difference]) -> dict[str, int]:
    """How many differences there are of each kind."""
    kinds = ("changed", "missing", "added", "unknown")
    return {kind: sum(one.what == kind for one in differences) for kind in kinds}
