"""The delimiter of a table: our first-lines rule beside CleverCSV's data-consistency measure, on tables of numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from clevercsv import Sniffer

from collaudit.core.config.schema import CsvConfig
from collaudit.core.logs.tables.csv_text import dialect_of

HEADERS = {
    "names": ["time", "q1", "q2", "tau1", "tau2"],
    "spaces in names": ["time", "Wrist 1", "Wrist 2", "effort Wrist 1", "effort Wrist 2"],
    "units": ["t [s]", "q1 [rad]", "q2 [rad]", "tau1 [Nm]", "tau2 [Nm]"],
}


def text_of(header: list[str], delimiter: str, decimal: str, seed: int) -> str:
    rows = np.random.default_rng(seed).normal(size=(30, len(header)))
    rows[:, 0] = 0.002 * np.arange(30)
    lines = [delimiter.join(f"{x:.6f}".replace(".", decimal) for x in row) for row in rows]
    return "\n".join([delimiter.join(header), *lines]) + "\n"


@pytest.mark.parametrize("names", HEADERS)
@pytest.mark.parametrize("written", [",.", ";.", ";,", "\t.", "\t,", "|."])
def test_both_find_the_delimiter(tmp_path: Path, names: str, written: str) -> None:
    delimiter, decimal = written
    for seed in range(3):
        text = text_of(HEADERS[names], delimiter, decimal, seed)
        path = tmp_path / f"{seed}.csv"
        path.write_text(text, encoding="utf-8")
        found = dialect_of(path, CsvConfig())
        sniffed = Sniffer().sniff(text, delimiters=[",", ";", "\t", "|", " "])
        assert sniffed is not None
        assert found.delimiter == sniffed.delimiter == delimiter
        assert found.decimal == decimal
        assert list(found.names) == HEADERS[names]
