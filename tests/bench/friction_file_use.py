"""What ``detect`` gains from each part of a friction file, on simulated logs: ``python friction_file_use.py [DOCS]``.

Each case takes something from the configuration that the simulated arm has (its tool, its drive constants, its
inertials), fits with and without asking for it, and judges another log with either friction file. DOCS is the page
whose table between ``<!-- friction-file-use -->`` marks is replaced.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

from tables import put

from collaudit.cli.main import run

TOOL = "mass_kg = 0.8\n"


@dataclass(frozen=True, slots=True)
class Case:
    """What is taken away (text in the configuration and what stands there instead), and what is asked for."""

    title: str
    robot: str
    taken: str
    instead: str
    estimate: tuple[str, ...]
    bias: bool = False
    mismatch: str = "0"


CASES = (
    Case("undeclared tool of 0.8 kg; from the torques", "paper6", TOOL, "mass_kg = 0.0\n", ("tool",)),
    Case("the same; from the wrist sensor", "paper6", TOOL, "mass_kg = 0.0\n", (), bias=True),
    Case("effort a current of unknown constants and signs", "seven", 'effort = "A"', 'effort = "raw"', ("gain",)),
    Case("inertials off by up to 15 %", "paper6", "", "", ("inertials",), mismatch="15"),
)


def said(*arguments: str) -> str:
    """Standard output of a command."""
    out, words = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(words):
        code = run([*arguments])
    if code == 2:
        raise SystemExit(f"{' '.join(arguments)}: {words.getvalue()}")
    return out.getvalue()


def without(text: str, case: Case) -> str:
    """The configuration with what the case takes away."""
    if case.instead.endswith('"raw"'):
        drop = ("torque_constant", "effort_sign")
        text = "".join(line for line in text.splitlines(True) if not line.startswith(drop))
    return text.replace(case.taken, case.instead) if case.taken else text


def levels(case: Case, folder: Path) -> tuple[dict[str, float | None], dict[str, float | None]]:
    """RMS of each joint's residual, N·m, with a friction file of friction alone and with one of all asked for."""
    logs = []
    for scenario, seed in (("friction", 1), ("free-clean", 2), ("tool-calibration", 3), ("free-clean", 4)):
        length = ("--duration", "60") if scenario == "free-clean" else ()
        log = folder / f"{case.robot}-{scenario}-{seed}.mcap"
        options = ("--robot", case.robot, "--seed", str(seed), "--mismatch", case.mismatch, *length)
        said("simulate", scenario, "-o", str(log), *options)
        logs.append(str(log))
    found = []
    for name, estimate, bias in (("plain", (), False), ("all", case.estimate, case.bias)):
        config = folder / f"{name}.toml"
        text = without(Path(logs[1]).with_suffix(".toml").read_text(encoding="utf-8"), case)
        if case.estimate == ("tool",):  # a sensor would feel the tool by itself
            text = "".join(line for line in text.splitlines(True) if not line.startswith("wrench"))
        if bias:
            text = text.replace("[log]\n", '[log]\nwrench_bias = "calibrated"\n')
        wanted = ", ".join(f'"{e}"' for e in ("friction", *estimate))
        config.write_text(f"{text}\n[fit]\nestimate = [{wanted}]\n", encoding="utf-8")
        friction = folder / f"{name}.json"
        said("fit", *logs[:3], "-c", str(config), "-o", str(friction))
        out = folder / name
        said("detect", logs[3], "-c", str(config), "--friction", str(friction), "-o", str(out))
        audit = json.loads((out / "audit.json").read_text(encoding="utf-8"))
        found.append({joint: facts["rms_nm"] for joint, facts in audit["residual"].items()})
    return found[0], found[1]


def table() -> Iterator[str]:
    """One row a case: residual of each joint without and with."""
    yield "| removed, and what it is identified from | joint 1 | 2 | 3 | 4 | 5 | 6 | 7 |"
    yield "|---|---|---|---|---|---|---|---|"
    for case in CASES:
        with TemporaryDirectory() as folder:
            before, after = levels(case, Path(folder))
        cells = [f"{_number(before[joint])} → {_number(after[joint])}" for joint in after]
        yield f"| {case.title} | {' | '.join(cells + ['–'] * (7 - len(cells)))} |"


def _number(value: float | None) -> str:
    return "not judged" if value is None else f"{value:.2f}"


def main(docs: Path | None) -> None:
    """Print the table; put it into the page when one is given."""
    lines = list(table())
    print("\n".join(lines))
    if docs is not None:
        put(docs, "friction-file-use", lines)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
