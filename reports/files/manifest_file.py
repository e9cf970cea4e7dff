"""``manifest.json``: the hashes of all that an audit read and wrote, with settings and versions; and comparing them.

A signature over it is in minisign's format, which minisign and signify check, too.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path, PurePosixPath
from types import ModuleType
from typing import Any, Literal

from collaudit.core.errors import CollauditError, ConfigError
from collaudit.core.small_files import check_regular, read_small
from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.files.json_files import read_result

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
    """

    log: str
    robot: str | None
    folder: str
    verdict: str
    log_sha256: str | None
    config_sha256: str
    friction_sha256: str | None
    model_sha256: str | None


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


def signing_key(path: Path, password: str | None) -> Any:
    """The secret key of a file made by ``minisign -G``, ready to sign.

    Args:
        path: the key file.
        password: of an encrypted key.

    Raises:
        ConfigError: the extra is missing, or the key cannot be read or opened.
    """
    minisign = _library()
    try:
        check_regular(path)
        key = minisign.SecretKey.from_file(path)
        if key.is_encrypted():
            if password is None:
                raise ConfigError(
                    "the key has a password", where=str(path), hint="set COLLAUDIT_SIGN_PASSWORD, from a CI secret, say"
                )
            key.decrypt(password)
    except (minisign.Error, OSError, ValueError) as error:
        raise ConfigError(f"this key cannot be used: {error}", where=str(path)) from error
    return key


def write_signature(out: Path, key: Any) -> None:
    """Sign the manifest of a folder; the trusted comment names its hash and no time.

    Args:
        out: folder of an audit.
        key: as :func:`signing_key` gives it.

    Raises:
        CollauditError: it cannot be written.
    """
    content = read_small(out / MANIFEST_NAME)
    digest = hashlib.sha256(content).hexdigest()
    signature = key.sign(content, untrusted_comment="collaudit manifest", trusted_comment=f"sha256:{digest}")
    atomic_write(out / SIGNATURE_NAME, bytes(signature))


def check_signature(out: Path, public_key: Path) -> str | None:
    """Why the signature of a folder's manifest is not by this key; None where it is.

    Args:
        out: folder of an audit.
        public_key: file of the public key.

    Raises:
        ConfigError: the extra is missing, or the key cannot be read.
        CollauditError: there is no manifest.
    """
    minisign = _library()
    try:
        check_regular(public_key)
        key = minisign.PublicKey.from_file(public_key)
    except (minisign.Error, OSError, ValueError) as error:
        raise ConfigError(f"this key cannot be used: {error}", where=str(public_key)) from error
    if not (out / SIGNATURE_NAME).is_file():
        return f"there is no {SIGNATURE_NAME}"
    try:
        signature = minisign.Signature.from_file(out / SIGNATURE_NAME)
        key.verify(read_small(out / MANIFEST_NAME), signature)
    except (minisign.Error, ValueError) as error:
        return f"the signature does not fit: {error or type(error).__name__}"
    except OSError as error:
        raise CollauditError(f"cannot be read: {error.strerror}", where=str(out)) from error
    return None


def _library() -> ModuleType:
    try:
        return import_module("minisign")
    except ImportError as error:
        raise ConfigError(
            "signatures need the extra sign", where="--sign, --key", hint="pip install 'collaudit[sign]'"
        ) from error
