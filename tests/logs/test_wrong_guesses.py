"""Wrong guesses counted: format, vocabulary, joint count, numbering and robot in every combination."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from table_formats import FORMATS
from vocabularies import CURRENTS, TORQUE_CONSTANT, VOCABULARIES, table_of

from collaudit.core.config.schema import CsvConfig, LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs import guess_csv_columns, read_log
from collaudit.core.logs.log_formats import LogFormat
from collaudit.core.logs.storage.table_reader import TableColumns, TableReader
from collaudit.core.logs.tables import joined_tables

#: What a joint's name leaves open is settled by its order in the robot, which is not the alphabet's here.
ROBOT = ("pan", "lift", "elbow", "roll", "bend", "turn", "flange", "extra")
COUNTS = (1, 2, 6, 7)
TIME_S = 0.01 * np.arange(6)
DOCS = Path(__file__).resolve().parents[2] / "docs" / "real-logs.md"


def signals(joints: int) -> tuple[Any, Any, Any]:
    """Values that tell every joint and quantity from every other."""
    number = np.arange(joints)
    return tuple(np.add.outer(TIME_S, 0.1 * number + shift) for shift in (0.0, 2.0, 4.0))  # type: ignore[return-value]


def outcome(path: Path, truth: tuple[Any, ...], robot: tuple[str, ...], settings: dict[str, Any]) -> str:
    """``read`` rightly, ``wrong``, or ``asked`` where the log is refused with the line that settles it."""
    settings = {"units": {"effort": "raw", "time": "s"}, **settings}
    try:
        log = read_log((path,), LogConfig.of(settings), robot_joints=robot)
    except LogError as error:
        return "asked" if re.search(r"\[log(\.csv)?\] \w+ =", str(error.hint)) else f"refused without a line: {error}"
    held = (log.position_rad, log.velocity_rad_s, log.effort)
    same = all(v is None or float(np.abs(v - t).max()) < 1e-9 for v, t in zip(held, truth, strict=True))
    return "read" if same and log.joint_names == robot else "wrong"


def robots(joints: int) -> list[tuple[str, ...]]:
    """As many joints as the log, in two orders; one more, one less."""
    own = ROBOT[:joints]
    found = [own, tuple(sorted(own)), ROBOT[: joints + 1], ROBOT[: joints - 1]]
    return [robot for robot in found if robot]


class ReadOnce:
    """Opens a table and reads its columns once for equal questions, until the file is written anew; gives copies."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.kept: dict[str, TableColumns] = {}
        self.opened: dict[str, TableReader] = {}
        plain, opening = joined_tables._read_one, LogFormat.open_table

        def open_table(form: LogFormat, path: Path, settings: CsvConfig) -> TableReader:
            key = repr((form.name, path, settings))
            if key not in self.opened:
                self.opened[key] = opening(form, path, settings)
            return self.opened[key]

        monkeypatch.setattr(LogFormat, "open_table", open_table)
        monkeypatch.setattr(
            joined_tables, "_read_one", lambda file, how: plain(replace(file, reader=self._reader(file.reader)), how)
        )

    def forget(self) -> None:
        """The files are others now."""
        self.kept.clear()
        self.opened.clear()

    def _reader(self, reader: TableReader) -> Any:
        def read(*asked: Any) -> TableColumns:
            key = repr((reader.path, *asked))
            if key not in self.kept:
                self.kept[key] = reader.read(*asked)
            kept = self.kept[key]
            return replace(kept, values={name: values.copy() for name, values in kept.values.items()})

        return SimpleNamespace(path=reader.path, names=reader.names, read=read)


@pytest.mark.parametrize("form", FORMATS)
def test_no_joint_is_mapped_wrongly(form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    counted: Counter[str] = Counter()
    read_once = ReadOnce(monkeypatch)  # a file's robots differ, its numbers do not
    for vocabulary in VOCABULARIES:
        for joints, base in ((joints, base) for joints in COUNTS for base in (0, 1)):
            path, truth = tmp_path / f"{joints}-{base}-{form}", signals(joints)
            FORMATS[form](path, table_of(vocabulary, base, TIME_S, truth))
            read_once.forget()
            known = (*truth[:2], truth[2] / (TORQUE_CONSTANT if vocabulary in CURRENTS else 1.0))
            guess = guess_csv_columns([path])
            for robot in robots(joints):
                found = outcome(path, known, robot, {})
                counted[found] += 1
                assert found in ("read", "asked"), f"{vocabulary}, {joints} joints from {base}, {robot}"
                if guess is not None and not guess.open:
                    assert outcome(path, known, robot, {"csv": guess.csv}) == found, "as init writes it"
    row = f"| `{form}` | {counted.total()} | {counted['read']} | {counted['asked']} | {counted['wrong']} |"
    print(row)
    assert row in DOCS.read_text(encoding="utf-8"), "the page states another count"
