"""What a CSV looks like: encoding, comment lines, delimiter, decimal mark, header, by its first lines."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, zip_longest
from pathlib import Path

from collaudit.core.config.schema import CsvConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.storage.file_content import head_of
from collaudit.core.vendors.vendor_words import UNIT_WORDS

HEAD_BYTES = 1 << 18
_SAMPLE_LINES = 64
COMMENT = ("#", "%")
#: What may stand around a number; the blanks of other scripts are no part of one.
BLANKS = " \t\r\n"
NULLS = ("", "nan", "NaN", "NAN", "null", "NULL", "None", "NA", "N/A", "n/a")
_NUMBER = re.compile(r"[+-]?(\d+([.]\d*)?|[.]\d+)([eE][+-]?\d+)?|[+-]?(inf|nan|infinity)", re.IGNORECASE | re.ASCII)
_ISO = re.compile(r"\d{4}-\d{2}-\d{2}([T ]\d{2}:\d{2}(:\d{2}([.,]\d+)?)?\s*(Z|[+-]\d{2}:?\d{2})?)?")


#: A time of day.
_OF_DAY = re.compile(r"\d{1,2}:\d{2}:\d{2}([.]\d+)?")
#: Units that a row below the names of columns holds, in lower case.
_UNITS = frozenset({*UNIT_WORDS, "s", "ms", "us", "µs", "ns", "sec", "m", "mm", "n", "m/s", "mm/s", "°", "°/s", "deg/s",
                    "rad/s", "1/s", "hz", "n·m", "n*m", "n.m", "c", "°c", "%", "‰", "-"})  # fmt: skip


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a CSV is written.

    Attributes:
        names: column names, stripped, with the unit in brackets that a row below states; of a headerless file "1", "2".
        delimiter: one character; a space stands for any run of white space.
        decimal: "." or ",".
        header: whether there is a line of names.
        skip: lines before the first row of data.
        encoding: of the text.
        comment: beginnings of lines that are no rows.
        head: the cells of the line of names, as it is written; empty without.
        before: lines before the line of names that are neither empty nor comments.
        lists: how many values each cell of a row holds, 0 for one that is no list; empty where none is.
    """

    names: tuple[str, ...]
    delimiter: str
    decimal: str
    header: bool
    skip: int
    encoding: str
    comment: tuple[str, ...] = COMMENT
    head: tuple[str, ...] = ()
    before: int = 0
    lists: tuple[int, ...] = ()


def encoding_of(head: bytes) -> str:
    """The encoding of a text: by its byte order mark, else UTF-8, else Latin-1."""
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "utf-16"
    if head.startswith(codecs.BOM_UTF8):
        return "utf-8-sig"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)  # the last character may be cut
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def is_number(cell: str, decimal: str = ".") -> bool:
    """Whether a cell is a number (or not a number, said so)."""
    text = cell.strip(BLANKS)
    if decimal != ".":
        if "." in text:
            return False
        text = text.replace(decimal, ".")
    return _NUMBER.fullmatch(text) is not None


def is_iso(cell: str) -> bool:
    """Whether a cell is an ISO 8601 time."""
    return _ISO.fullmatch(cell.strip()) is not None


def is_time_of_day(cell: str) -> bool:
    """Whether a cell is a time of day, as 23:59:58.001."""
    return _OF_DAY.fullmatch(cell.strip()) is not None


def split(line: str, delimiter: str) -> list[str]:
    """The cells of one line."""
    if delimiter == " ":
        return line.split()
    try:
        return next(csv.reader([line], delimiter=delimiter), [])
    except csv.Error:  # a cell longer than the module takes: no table that could be quoted
        return line.split(delimiter)


def dialect_of(path: Path, settings: CsvConfig) -> Dialect:
    """Find out how a CSV is written.

    Args:
        path: the file.
        settings: what the configuration states about it.

    Raises:
        LogError: it has no rows of data.
    """
    head = head_of(path, HEAD_BYTES)
    encoding = encoding_of(head)
    text = head.decode(encoding, errors="replace")
    lines = list(io.StringIO(text, newline=None))
    if len(head) == HEAD_BYTES and len(lines) > 1:
        lines.pop()
    comment = (*COMMENT, *settings.comment)
    of_data = (
        i
        for i, line in enumerate(lines)
        if i >= settings.lines_before and line.strip() and not line.lstrip().startswith(comment)
    )
    rows = [(i, lines[i].rstrip("\n")) for i in islice(of_data, _SAMPLE_LINES)]
    if not rows:
        raise LogError("the file holds no rows of data", where=str(path), found=f"{len(lines)} lines")
    sample = [line for _, line in rows]
    stated = settings.delimiter.replace("\\t", "\t")
    delimiter = stated if stated != "auto" else _delimiter(sample)
    cut = [split(line, delimiter) for line in sample]
    decimal = settings.decimal if settings.decimal != "auto" else _decimal(cut)
    before = _before(cut, decimal) if settings.header == "auto" else 0
    rows, cut = rows[before:], cut[before:]
    first_cells = cut[0]
    header = _has_header(first_cells, decimal) if settings.header == "auto" else bool(settings.header)
    if header and len(rows) < 2:
        raise LogError("the file holds no rows of data", where=str(path), found="only a line of column names")
    start, cells = rows[1 if header else 0][0], cut[1 if header else 0]
    names = first_cells if header else _commented_names(lines[:start], delimiter, len(cells))
    units: list[str] = []
    if header and len(rows) > 2 and _are_units(cells, len(names), decimal, settings.units_row):
        start, units = rows[2][0], cells
    lists = _lists(cut[1 if header else 0 :], len(names or cells))
    counted = [str(i + 1) for i in range(len(unpacked(cells, lists)))]
    return Dialect(
        names=_numbered(_with_units(_clean(names), units), lists) if names else tuple(counted),
        delimiter=delimiter,
        decimal=decimal,
        header=header or bool(names),
        skip=start,
        encoding=encoding,
        comment=comment,
        head=tuple(first_cells) if header else (),
        before=before,
        lists=lists,
    )


def unpacked(cells: list[str], lists: Sequence[int]) -> list[str]:
    """The cells of a row, with the values of lists such as ``[0.1, -2.0]`` as cells of their own.

    Args:
        cells: of the row.
        lists: from :class:`Dialect`; a cell that should be a list and is none stays as it is.
    """
    if not lists:
        return cells
    wide: list[str] = []
    for cell, count in zip_longest(cells, lists[: len(cells)], fillvalue=0):
        wide += (_values(str(cell)) if count else None) or [str(cell)]
    return wide


def _values(cell: str) -> list[str] | None:
    """The numbers of a list; None where the cell is none."""
    text = cell.strip()
    if not (text.startswith("[") and text.endswith("]")):
        return None
    values = [one for one in re.split(r"[,;\s]+", text[1:-1].strip()) if one]
    return values if values and all(map(is_number, values)) else None


def _lists(rows: Sequence[Sequence[str]], columns: int) -> tuple[int, ...]:
    """How many values each cell of the first rows holds that is a list of as many in all of them."""
    counts = []
    for k in range(columns):
        held = {len(_values(row[k]) or ()) for row in rows if k < len(row) and row[k].strip()}
        counts.append(held.pop() if len(held) == 1 else 0)
    return tuple(counts) if any(counts) else ()


def _numbered(names: Sequence[str], lists: Sequence[int]) -> tuple[str, ...]:
    """Names of columns, those of lists numbered from 1."""
    counts = lists or [0] * len(names)
    wide: list[str] = []
    for name, count in zip(names, counts, strict=True):
        wide += [f"{name}{i + 1}" for i in range(count)] or [name]
    return tuple(wide)


def _before(cells: Sequence[Sequence[str]], decimal: str) -> int:
    """How many of the first lines, cut into cells, stand before the names of the columns.

    These are the line above the first row of numbers, or above a row of units, with as many cells as most rows; what
    comes before has another number of cells.
    """
    counts = [len(row) for row in cells]
    usual = max(set(counts), key=counts.count)
    first = counts.index(usual)
    named = first > 0 and usual > 1 and _has_header(cells[first], decimal)
    below = [row for row in cells[first + 1 : first + 3] if not _has_header(row, decimal)]
    return first if named and below and len(below[-1]) == usual else 0


def _are_units(cells: Sequence[str], count: int, decimal: str, stated: bool | str) -> bool:
    """Whether the row below the names of so many columns states their units."""
    if stated != "auto":
        return bool(stated)
    filled = [cell.strip(" []()").lower() for cell in cells if cell.strip()]
    return len(cells) == count and bool(filled) and _has_header(cells, decimal) and {*filled} <= _UNITS


def _with_units(names: Sequence[str], units: Sequence[str]) -> tuple[str, ...]:
    """Names with their units in brackets."""
    bare = [unit.strip(" []()") for unit in units]
    bare += [""] * (len(names) - len(bare))
    return tuple(f"{name} [{unit}]" if unit else name for name, unit in zip(names, bare, strict=False))


def _clean(names: Sequence[str]) -> tuple[str, ...]:
    return tuple(name.strip().strip("\"'").lstrip("\ufeff").strip() for name in names)


def _commented_names(lines: Sequence[str], delimiter: str, count: int) -> list[str]:
    """Column names in the last comment line, as numpy.savetxt writes them."""
    for line in (raw.rstrip("\n") for raw in reversed(lines)):
        if line.lstrip().startswith(COMMENT):
            cells = split(line.lstrip().lstrip("#% "), delimiter)
            if len(cells) == count and not any(is_number(cell) for cell in cells):
                return cells
            return []
    return []


def _has_header(cells: Sequence[str], decimal: str) -> bool:
    filled = [cell for cell in cells if cell.strip() and cell.strip() not in NULLS]
    return not any(
        is_number(cell, decimal) or is_number(cell) or is_iso(cell) or is_time_of_day(cell) for cell in filled
    )


def _delimiter(sample: Sequence[str]) -> str:
    """The character that cuts most sample lines into the same number of cells.

    A comma may be the decimal mark: a semicolon, tab or bar that does as well, between numbers, comes before it. Blanks
    come last.
    """
    best, most = "", 0.0
    for candidate in (",", ";", "\t", "|", " "):
        counts = [len(split(line, candidate)) for line in sample]
        usual = max(set(counts), key=counts.count)
        share = counts.count(usual) / len(counts)
        if usual < 2 or share <= 0.5:
            continue
        if not best or (candidate != " " and share >= most - 0.05 and _between_numbers(sample, candidate)):
            best, most = candidate, share
    return best or ","


def _between_numbers(sample: Sequence[str], delimiter: str) -> bool:
    """Whether half of the cells of data are numbers, or lists of them."""
    cells = [cell for line in sample[1:] for cell in split(line, delimiter) if cell.strip()]
    return sum(is_number(cell) or is_number(cell, ",") or _values(cell) is not None for cell in cells) >= 0.5 * max(
        len(cells), 1
    )


def _decimal(rows: Sequence[Sequence[str]]) -> str:
    cells = [cell.strip() for row in rows[-max(len(rows) - 1, 1) :] for cell in row]
    commas = sum(1 for cell in cells if "," in cell and is_number(cell, ","))
    points = sum(1 for cell in cells if "." in cell and is_number(cell))
    return "," if commas > points else "."


def rows_as_text(file: Path, where: str, dialect: Dialect) -> Iterator[tuple[int, list[str]]]:
    """(number from 1 of its first line, cells) of the data rows; slow, for the first of them and odd files.

    Args:
        file: the text.
        where: what messages call it.
        dialect: how it is written.

    Raises:
        LogError: what should be UTF-16 is not; it cannot be cut into cells.
    """
    errors = "strict" if dialect.encoding == "utf-16" else "replace"
    try:
        with file.open(encoding=dialect.encoding, errors=errors, newline="") as text:
            for _ in range(dialect.skip):
                text.readline()
            blanks = dialect.delimiter == " "
            quoted = csv.reader(text, delimiter=dialect.delimiter)
            before = 0  # a quote that is never closed takes the lines below into its cell
            for cells in map(str.split, text) if blanks else quoted:
                empty = not any(cells) or (len(cells) == 1 and not cells[0].strip())
                if not empty and not cells[0].lstrip().startswith(dialect.comment):
                    yield dialect.skip + before + 1, cells
                before = before + 1 if blanks else quoted.line_num
    except csv.Error as error:
        raise LogError(f"cannot be cut into cells: {error}", where=where) from error
    except UnicodeError as error:
        raise LogError(f"begins as UTF-16 text and does not go on so: {error}", where=where) from error
