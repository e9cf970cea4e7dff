"""Wrong guesses counted: format, vocabulary, joint count, numbering and robot in every combination."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from table_formats import FORMATS
from vocabularies import CURRENTS, TORQUE_CONSTANT, VOCABULARIES, table_of

from collaudit.core.config.schema import CsvConfig, LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.log_formats import LogFormat
from collaudit.core.logs.log_guess import guess_csv_columns
from collaudit.core.logs.log_reading import read_log
from collaudit.core.logs.storage.readers import TableColumns, TableReader
from collaudit.core.logs.tables import joined_tables

#: What a joint's name leaves open is settled by its order in the robot, which is not the alphabet's here.
ROBOT = ("pan", "lift", "elbow", "roll", "bend", "turn", "flange", "extra")
COUNTS = (1, 2, 6, 7)
TIME_S = 0.01 * np.arange(6)
#: Formats in which names are counted, and those that hold the same names: MATLAB renames what is no word.
ALIKE = {
    "run.csv": [form for form in FORMATS if form != "run.csv" and not form.endswith(".mat")],
    "run.mat": ["run73.mat"],
}
DOCS = Path(__file__).resolve().parents[2] / "docs" / "real-logs.md"
Log = tuple[str, Path, tuple[Any, ...], list[tuple[str, ...]]]


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


def logs_of(form: str, folder: Path, read_once: ReadOnce, counts: tuple[int, ...]) -> Iterator[Log]:
    """The log of every vocabulary, count of joints and numbering in one format; a file lasts until the next."""
    for vocabulary in VOCABULARIES:
        for joints, base in ((joints, base) for joints in counts for base in (0, 1)):
            path, truth = folder / f"{joints}-{base}-{form}", signals(joints)
            FORMATS[form](path, table_of(vocabulary, base, TIME_S, truth))
            read_once.forget()
            known = (*truth[:2], truth[2] / (TORQUE_CONSTANT if vocabulary in CURRENTS else 1.0))
            yield f"{vocabulary}, {joints} joints from {base}", path, known, robots(joints)


@pytest.mark.parametrize("form", ALIKE)
def test_no_joint_is_mapped_wrongly(form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    counted: Counter[str] = Counter()
    read_once = ReadOnce(monkeypatch)  # a file's robots differ, its numbers do not
    for name, path, known, asked in logs_of(form, tmp_path, read_once, COUNTS):
        guess = guess_csv_columns([path])
        for robot in asked:
            found = outcome(path, known, robot, {})
            counted[found] += 1
            assert found in ("read", "asked"), f"{name}, {robot}"
            if guess is not None and not guess.open:
                assert outcome(path, known, robot, {"csv": guess.csv}) == found, "as init writes it"
    row = f"| `{form}` | {counted.total()} | {counted['read']} | {counted['asked']} | {counted['wrong']} |"
    print(row)
    assert row in DOCS.read_text(encoding="utf-8"), "the page states another count"


def answers(form: str, folder: Path, read_once: ReadOnce) -> list[tuple[str, ...]]:
    """What comes out for seven joints on both robots of theirs, as ``init`` writes it where it leaves nothing open."""
    told = []
    for name, path, known, asked in logs_of(form, folder, read_once, (7,)):
        guess = guess_csv_columns([path])
        settings = {} if guess is None or guess.open else {"csv": guess.csv}
        told.append((name, *(outcome(path, known, robot, settings) for robot in asked[:2])))
    return told


@pytest.fixture(scope="module")
def answers_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], list[tuple[str, ...]]]:
    """The same for a format in which names are counted, found once."""

    @cache
    def found(form: str) -> list[tuple[str, ...]]:
        with pytest.MonkeyPatch.context() as patch:
            return answers(form, tmp_path_factory.mktemp("alike"), ReadOnce(patch))

    return found


@pytest.mark.parametrize(("form", "alike"), [(form, known) for known, forms in ALIKE.items() for form in forms])
def test_a_format_with_the_same_names_is_guessed_alike(
    form: str,
    alike: str,
    answers_of: Callable[[str], list[tuple[str, ...]]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Joints are told from names and numbers, which these formats hold alike: one count of joints stands for all."""
    known = answers_of(alike)
    assert answers(form, tmp_path, ReadOnce(monkeypatch)) == known
    assert {"read", "asked"} == {outcome for row in known for outcome in row[1:]}
