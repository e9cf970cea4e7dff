"""One simulated arm in each vocabulary, and in each format: what init writes reads the same log: the same audit."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from same_audit import alike
from table_formats import FORMATS, text
from vocabularies import CURRENTS, DEGREES, TORQUE_CONSTANT, VOCABULARIES, table_of

from collaudit.cli import main as entry

Columns = dict[str, Any]
CONSTANTS = f"log.units.torque_constant_nm_per_a={{ joint1 = {TORQUE_CONSTANT}, joint2 = {TORQUE_CONSTANT} }}"
#: Findings of reading differ with the names of columns; those of everything behind it do not.
OF_READING = ("log-guessed", "log-labels", "log-joint")


#: MATLAB's names of a controller's columns lose what tells its name from a role: these are asked about.
ASKED = [("controller state", "run.mat"), ("controller state", "run73.mat")]

#: Each vocabulary once and each format once at least; what is read of every pair of them, and with what init writes, is
#: compared by tests/logs/test_wrong_guesses.py.
PAIRS = [
    pair
    for k, vocabulary in enumerate(VOCABULARIES)
    if (pair := (vocabulary, list(FORMATS)[k % len(FORMATS)])) not in ASKED
]
#: The first vocabulary of each kind of columns: unit of angles, of efforts, and whether there are velocities.
KINDS = {
    (name in DEGREES, name in CURRENTS, bool(stems[1])): name for name, (_, stems, _) in reversed(VOCABULARIES.items())
}


@dataclass(frozen=True)
class Runs:
    """The arm's two logs, without and with a push, as time and (position, velocity, effort).

    Attributes:
        robot: configuration that names the robot and the rule only.
        expected: whether velocities are logged to the audit of the plain table.
    """

    clean: tuple[Any, tuple[Any, ...]]
    pushed: tuple[Any, tuple[Any, ...]]
    robot: Path
    friction: Path
    expected: dict[bool, Any]


def told(folder: Path) -> Any:
    """What audit.json says of everything but the file and the names of its columns."""
    result = json.loads((folder / "audit.json").read_text(encoding="utf-8"))
    for key in ("name", "sha256", "format", "topic"):
        result["log"].pop(key)
    result.pop("provenance")
    for contact in result["contacts"]:
        contact.pop("id")  # it names the file as well
    kept = [one for one in result["findings"] if not one["code"].startswith(OF_READING)]
    result["findings"] = [{key: one.get(key) for key in ("code", "severity", "joint")} for one in kept]
    return result


@pytest.fixture(scope="module")
def runs(arm: Any, once: Any) -> Runs:
    return Runs(*once(("logs of the matrix",), lambda folder: _made(arm, folder)))


def _made(arm: Any, folder: Path) -> tuple[Any, ...]:
    made = []
    for log in (arm.clean, arm.pushed):
        rows = np.loadtxt(log, delimiter=",", skiprows=1)[:: 3 if log == arm.pushed else 4]
        rows = rows[(rows[:, 0] > 33.5) & (rows[:, 0] < 54)] if log == arm.pushed else rows
        # Without noise samples lie on the bounds of speeds, and the last digit of a unit's conversion decides.
        rows[:, 1:5] += np.random.default_rng(2).normal(0, [1e-6, 1e-6, 1e-5, 1e-5], (len(rows), 4))
        made.append((rows[:, 0], (rows[:, 1:3], rows[:, 3:5], rows[:, 5:7])))
    whole = arm.config.read_text(encoding="utf-8")
    robot = folder / "robot.toml"
    robot.write_text(whole.partition("[log.csv]")[0] + "[detect]" + whole.partition("[detect]")[2], encoding="utf-8")
    expected = {}
    for logged in (True, False):
        config = folder / f"plain-{logged}.toml"
        config.write_text(whole if logged else whole.replace('velocity = "dq{i}"\n', ""), encoding="utf-8")
        for name, (time_s, (q, dq, tau)) in zip(("clean", "pushed"), made, strict=True):
            columns = {"t": time_s, "q1": q[:, 0], "q2": q[:, 1], "tau1": tau[:, 0], "tau2": tau[:, 1]}
            text(folder / f"{name}-{logged}.csv", columns | ({"dq1": dq[:, 0], "dq2": dq[:, 1]} if logged else {}))
        friction = folder / f"friction-{logged}.json"
        assert run("fit", folder / f"clean-{logged}.csv", "-c", config, "-o", friction) == 0
        out = folder / f"out-{logged}"
        assert run("detect", folder / f"pushed-{logged}.csv", "-c", config, "--friction", friction, "-o", out) == 1
        expected[logged] = told(out)
        assert [one["joint"] for one in expected[logged]["collisions"]] == ["joint1"]
    return made[0], made[1], robot, folder / "friction-{}.json", expected


def run(*args: object) -> int:
    return entry.run([str(arg) for arg in args])


def drafted(runs: Runs, log: Path, vocabulary: str, friction: Path | None = None) -> Path:
    """What init writes for a log, told nothing but the robot and, where efforts are currents, the constants.

    With friction that is known already its trial needs no fit of the log, which would take most of the time.
    """
    config = log.with_name("written.toml")
    stated = ("--set", CONSTANTS) if vocabulary in CURRENTS else ()
    stated += ("--set", f'friction.file="{friction}"') if friction is not None else ()
    run("init", log, "-c", runs.robot, *stated, "-o", config, "--force")
    return config


@pytest.mark.parametrize(("vocabulary", "form"), PAIRS)
def test_each_vocabulary_and_each_format_gives_the_same_audit(
    runs: Runs, vocabulary: str, form: str, tmp_path: Path
) -> None:
    logged = bool(VOCABULARIES[vocabulary][1][1])
    base = (list(VOCABULARIES).index(vocabulary) + list(FORMATS).index(form)) % 2
    log = tmp_path / form
    FORMATS[form](log, table_of(vocabulary, base, *runs.pushed))
    friction = Path(str(runs.friction).format(logged))
    config = drafted(runs, log, vocabulary, friction)
    assert run("detect", log, "-c", config, "--friction", friction, "-o", tmp_path / "out") == 1
    alike(told(tmp_path / "out"), runs.expected[logged])


@pytest.mark.parametrize(("vocabulary", "form"), ASKED)
def test_what_is_not_recognised_names_the_line(
    runs: Runs, vocabulary: str, form: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    FORMATS[form](tmp_path / form, table_of(vocabulary, 0, *runs.pushed))
    assert run("init", tmp_path / form, "-c", runs.robot) == 3
    assert '[log.csv] time = "…", position = "q{i}"' in capfd.readouterr().err


@pytest.mark.parametrize("vocabulary", KINDS.values())
def test_friction_fitted_with_what_init_writes(runs: Runs, vocabulary: str, tmp_path: Path) -> None:
    """Names do not matter to a fit, units do and whether velocities are logged."""
    logged = bool(VOCABULARIES[vocabulary][1][1])
    form = list(FORMATS)[list(VOCABULARIES).index(vocabulary) % len(FORMATS)]
    log, friction = tmp_path / form, tmp_path / "friction.json"
    FORMATS[form](log, table_of(vocabulary, 1, *runs.clean))
    assert run("fit", log, "-c", drafted(runs, log, vocabulary), "-o", friction) == 0
    expected = json.loads(Path(str(runs.friction).format(logged)).read_text(encoding="utf-8"))["joints"]
    alike(json.loads(friction.read_text(encoding="utf-8"))["joints"], expected)
