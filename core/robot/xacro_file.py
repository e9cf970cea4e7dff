"""Descriptions written as xacro, expanded to the URDF they stand for."""

from __future__ import annotations

from pathlib import Path

from collaudit.core.errors import RobotError

#: How a tag of xacro begins; its namespace alone is left in many expanded files.
_TAG = b"<xacro:"


def expanded(data: bytes, path: Path, where: str) -> bytes:
    """The URDF of a description; unchanged where it is no xacro.

    Files that it includes are looked for beside it, and in packages among the folders above.

    Args:
        data: the file's bytes.
        path: the file.
        where: what messages call it.

    Raises:
        RobotError: xacrodoc is not installed, or the file cannot be expanded.
    """
    if _TAG not in data:
        return data
    try:
        from xacrodoc import XacroDoc, packages
    except ImportError as error:
        raise RobotError(
            "the file is an unexpanded xacro",
            where=where,
            hint="install what expands it: pip install 'collaudit[xacro]'; or run: xacro arm.urdf.xacro > arm.urdf",
        ) from error
    try:
        packages.walk_up_from(str(path))
        # included, not read: what it includes itself is then looked for beside it
        whole = XacroDoc.from_includes([str(path.resolve())], resolve_packages=False)
        return bytes(whole.to_urdf_string(), "utf-8")
    except Exception as error:  # xacro raises what the fault happens to cause
        raise RobotError(
            "the xacro cannot be expanded", where=where, found=f"{type(error).__name__}: {str(error)[:200]}"
        ) from error
