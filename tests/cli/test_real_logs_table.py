"""The table of what_init_writes.md is what ``init`` does: each row is run, and compared with it.

``COLLAUDIT_WRITE_TABLE=1`` writes the page's rows anew.
"""

from __future__ import annotations

import os
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from init_rows import ROWS, Motion, Row

PAGE = Path(__file__).with_name("what_init_writes.md")
BEGIN, END = "<!-- rows of init -->", "<!-- end of rows -->"
#: Keys of the file that say how a log is read, in the order of the table.
CSV_KEYS = ("time", "rate_hz", "position", "velocity", "effort", "delimiter", "decimal", "header")
USUAL = {"delimiter": ",", "decimal": ".", "position": "q{i}", "velocity": "dq{i}", "effort": "tau{i}", "time": "t"}
#: Rows whose log the trial of ``init`` fits, as it does where no friction is known.
FITTED = (
    "CSV, decimal point",
    "currents, no torque constants",
    "an inverted effort",
    "two arms, a topic each, the same names",
)
OFFERED = ("labels", "wrench", "effort_sign")


@pytest.fixture(scope="module")
def motion(arm: Any) -> Motion:
    rows = np.loadtxt(arm.clean, delimiter=",", skiprows=1)[::4]
    return Motion(rows[:, 0], (rows[:, 1:3], rows[:, 3:5], rows[:, 5:7]))


@pytest.fixture(scope="module")
def robot(arm: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("robot") / "robot.toml"
    path.write_text(arm.config.read_text(encoding="utf-8").partition("[log.csv]")[0], encoding="utf-8")
    return path


def line_of(row: Row, outcome: Any, written: Path) -> str:
    """One row of the table: the case, what the file holds, and what init says of it."""
    holds = _held(written.read_text(encoding="utf-8")) if written.exists() else ""
    holds = holds or ("the usual columns" if outcome.code == 0 else "")
    said = "judged" if outcome.code == 0 else _missing(outcome.err)
    said += f"; finding `{row.finding}`" if row.finding else ""
    return f"| {row.case} | {holds} | {said} |".replace("\n", " ")


def _held(text: str) -> str:
    if arms := tomllib.loads(text).get("fleet", {}).get("robots"):
        return f"a configuration for each of {', '.join(arms)}"
    log = tomllib.loads(text).get("log", {})
    csv, units = log.get("csv", {}), log.get("units", {})
    parts = [f"`{key} = {_toml(csv[key])}`" for key in CSV_KEYS if key in csv and csv[key] != USUAL.get(key)]
    if "joint_states" in log:
        parts.append(f"`joint_states = {_toml(log['joint_states'])}`")
    parts += [f"`units.{quantity} = {_toml(units[quantity])}`" for quantity in ("time", "position", "velocity") if
              units.get(quantity, "auto") not in ("auto", "rad", "rad/s")]  # fmt: skip
    parts += [f"`units.effort = {_toml(units['effort'])}`"] if units.get("effort", "Nm") != "Nm" else []
    parts += ["`effort_delay_ms` as measured"] if "effort_delay_ms" in log else []
    parts += [
        f"offered: `{match[1]}`"
        for key in OFFERED
        if (match := re.search(rf"^# ({key} = [\[{{].*?[\]}}])", text, re.MULTILINE)) and _meant(key, text)
    ]
    passed = _passed_over(text)
    parts += [f"passed over: {passed}"] if passed else []
    return "; ".join(parts)


def _passed_over(text: str) -> str:
    found = re.findall(r"(?:Passed over|Not offered)[^:#]*: (.*?)\.(?= |\n)", text.replace("\n# ", " "))
    return re.sub(r"(\S+) (\([a-zA-Z ]+\))", r"`\1` \2", ", ".join(found))


def _meant(key: str, text: str) -> bool:
    """Whether a line behind # is more than the example that every file has."""
    return key != "effort_sign" or "these run against the model" in text


def _missing(err: str) -> str:
    lines = err.splitlines()
    start = next((k + 1 for k, line in enumerate(lines) if line.endswith("missing:")), 0)
    cause = re.sub(r"^(- )?(\S*[/+]\S*: )?(\S*\.csv: )?", "", lines[start])
    hints = [line.partition(": ")[2] for line in lines[start:] if line.startswith(("  expected:", "  try:"))]
    hint = next((text for text in hints if "[log" in text or "[robot" in text), "")
    found = re.search(r"((\[[a-z._]+\] )?\w+ = (\".*?\"|\[.*?\]|\{.*?\}|[^\s,;]+))", hint)
    return f"asks: {cause}" + (f" (`{found[1]}`)" if found else "")


def _toml(value: object) -> str:
    return "[…]" if isinstance(value, list) else f'"{value}"' if isinstance(value, str) else str(value)


def _page_rows() -> list[str]:
    return PAGE.read_text(encoding="utf-8").partition(BEGIN)[2].partition(END)[0].splitlines()


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.case)
def test_a_row_is_what_init_does(
    row: Row, motion: Motion, robot: Path, arm: Any, collaudit: Any, tmp_path: Path
) -> None:
    files = row.build(tmp_path, motion)
    given = (*(("-c", robot) if row.robot else ()), *row.given)
    if row.robot and row.case not in FITTED:  # init's trial judges with it instead of fitting the log
        given += ("--set", f'friction.file="{arm.friction}"')
    outcome = collaudit("init", *files, *given, "-o", tmp_path / "written.toml")
    assert outcome.code in (0, 3), outcome.err
    line = line_of(row, outcome, tmp_path / "written.toml").replace(str(tmp_path) + "/", "")
    if os.environ.get("COLLAUDIT_WRITE_TABLE"):
        _write(row, line)
    assert line in _page_rows(), f"{line}\nCOLLAUDIT_WRITE_TABLE=1 writes it"
    if row.finding:
        assert row.finding in collaudit("inspect", "-v", *files, "-c", tmp_path / "written.toml").out
    if outcome.code == 0 and row.group == "Trap":  # the others are audited by test_same_audit_matrix.py
        # init's trial fitted the log itself; to fit it again, or to keep thresholds of its own, takes a fit a row.
        stated = ("--friction", arm.friction, "--set", "detect.gamma_nm=4")
        arms = sorted(tmp_path.glob("written.*.toml")) or [tmp_path / "written.toml"]
        codes = {collaudit("detect", *files, "-c", config, *stated).code for config in arms}
        assert codes <= {0, 1}, "what init calls judged is judged by detect"


def test_the_page_has_no_other_rows() -> None:
    listed = [line.split(" | ")[0].removeprefix("| ") for line in _page_rows() if line.startswith("| ")]
    assert [case for case in listed if case not in ("vocabulary", "format", "trap")] == [row.case for row in ROWS]


def _write(row: Row, line: str) -> None:
    """Put the row into the page, the rows in their order."""
    text = PAGE.read_text(encoding="utf-8")
    head, _, rest = text.partition(BEGIN)
    old, _, tail = rest.partition(END)
    kept = {one.split(" | ")[0].removeprefix("| "): one for one in old.splitlines() if one.startswith("| ")}
    kept[row.case] = line
    lines: list[str] = []
    for group in dict.fromkeys(one.group for one in ROWS):
        own = [kept[one.case] for one in ROWS if one.group == group and one.case in kept]
        lines += ["", f"| {group.lower()} | `init` writes | outcome |", "|---|---|---|", *own] if own else []
    PAGE.write_text(f"{head}{BEGIN}\n" + "\n".join(lines) + f"\n\n{END}{tail}", encoding="utf-8")
