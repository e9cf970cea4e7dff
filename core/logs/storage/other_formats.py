"""Formats that are not read, each with the line that converts its files."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from collaudit.core.logs.storage.file_content import head_of, unpacked_name, workbook_in


@dataclass(frozen=True, slots=True)
class OtherFormat:
    """A format that is not read.

    Attributes:
        title: with its article.
        why: it is not read, as the end of "which …".
        suffixes: of its files, lower case.
        recognises: tells from the first bytes whether a file is one; its name alone says so, too.
        code: Python that writes a file that is read, ``{old}`` and ``{new}`` for the names, quoted.
        becomes: the suffix of what is written.
        first: what is to be done before.
    """

    title: str
    why: str
    suffixes: tuple[str, ...]
    recognises: Callable[[bytes], bool]
    code: str
    becomes: str = ".csv"
    first: str = ""

    def hint(self, path: Path) -> str:
        """What to do with a file of it."""
        names = {
            "old": quoted(path),
            "new": repr(str(path.with_name(unpacked_name(path.name)).with_suffix(self.becomes))),
        }
        return f"{self.first}{python_line(self.code.format(**names))}"


def quoted(path: Path) -> str:
    """A path as text in a line of Python, between quotes that a shell leaves alone."""
    return json.dumps(str(path), ensure_ascii=False)


def python_line(code: str) -> str:
    """The line for a shell that runs some Python."""
    return f"python -c {shlex.quote(code)}"


_TRUSTED = "where you trust who wrote it: "
_SAVED = "numpy.savez({new}, **{load}({old}))"
_OTHERS = (
    OtherFormat("an Excel workbook", "is not read", (".xlsx", ".xls", ".xlsm"), workbook_in,
                "import pandas; pandas.read_excel({old}).to_csv({new}, index=False)",
                first="in Excel or LibreOffice, File > Save As > CSV UTF-8 (.csv); or with pandas and openpyxl: "),
    OtherFormat("a TDMS file", "is not read", (".tdms",), lambda head: head.startswith(b"TDSm"),
                "import nptdms; nptdms.TdmsFile.read({old}).as_dataframe().to_csv({new}, index=False)",
                first="pip install npTDMS, then "),
    OtherFormat("a file of joblib", "is never loaded: that could run any program", (".joblib",), lambda _: False,
                "import joblib, numpy; " + _SAVED.replace("{load}", "joblib.load"), ".npz", _TRUSTED),
    OtherFormat("a pickle", "is never loaded: that could run any program", (".pkl", ".pickle"),
                lambda head: head[:1] == b"\x80" and head[1:2] in (b"\x02", b"\x03", b"\x04", b"\x05"),
                "import numpy, pandas; " + _SAVED.replace("{load}", "pandas.read_pickle"), ".npz", _TRUSTED),
)  # fmt: skip


def named_other(name: str) -> OtherFormat | None:
    """The format, of those that are not read, that a file's name states."""
    plain = unpacked_name(name.lower())
    return next((other for other in _OTHERS if plain.endswith(other.suffixes)), None)


def other_format(path: Path) -> OtherFormat | None:
    """The format of a file, of those that are not read: by its name, else by its content."""
    head = head_of(path)
    return named_other(path.name) or next((other for other in _OTHERS if other.recognises(head)), None)
