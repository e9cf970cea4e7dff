"""A signature over ``manifest.json`` in minisign's format, which minisign and signify check, too."""

from __future__ import annotations

import hashlib
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from collaudit.core.errors import CollauditError, ConfigError
from collaudit.core.small_files import check_regular, read_small
from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.files.manifest_file import MANIFEST_NAME, SIGNATURE_NAME


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
