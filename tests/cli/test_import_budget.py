"""What ``detect`` imports: nothing large that it does not use, within a budget of time."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from statistics import median

from collaudit.core.data.audit_result import FrictionFile
from collaudit.fixtures.simulation import SimulatedFiles
from collaudit.reports.files.run_files import write_friction

#: Not needed to judge a recording: tables, reports, the simulator, fitting with constraints, guesses of columns,
#: descriptions. SciPy is needed, and its half a second is the price of plain code.
HEAVY = (
    "rosbags.typesys.stores.ros2_humble", "pandas", "jinja2", "clarabel", "tsdownsample", "tomlkit", "IPython",
    "pebble", "pydantic",
    "collaudit.core.logs.tables.column_assignment", "collaudit.core.logs.log_description",
)  # fmt: skip
#: Not needed to draw the page of a log that has been judged.
COMPUTING = ("pinocchio", "collaudit.core.prepare.prepared", "collaudit.core.config", "scipy.signal", "pandas")
#: Processor time of importing all modules of ``detect``, in imports of NumPy (with the start of Python both times).
BUDGET = 10.0

#: Modules are compiled once, as an installation does, also where the environment forbids to keep them.
_COMPILED = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}

DETECT = """
import sys
from collaudit.cli.main import run
code = run(sys.argv[2:])
print(code, *sorted(set(sys.argv[1].split(",")) & set(sys.modules)), file=sys.stderr)
"""
IMPORTS = """
import collaudit.core.audit, collaudit.cli.shared_steps, collaudit.core.logs.inputs, collaudit.core.logs.log_reading
import collaudit.reports.files.signals_file
"""


def test_detect_imports_nothing_heavy(
    made: Callable[..., SimulatedFiles], friction_of: Callable[[str], FrictionFile], tmp_path: Path
) -> None:
    files = made("free-clean", "seven", fmt="mcap", duration_s=30.0)
    write_friction(tmp_path / "friction.json", friction_of("seven"))
    arguments = [*map(str, files.log), "-c", str(files.config), "--friction", str(tmp_path / "friction.json")]
    command = [sys.executable, "-c", DETECT, ",".join(HEAVY), "detect", *arguments, "-o", str(tmp_path / "run")]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
    assert (tmp_path / "run" / "signals.parquet").exists(), done.stderr
    assert done.stderr.splitlines()[-1].split()[1:] == []
    command = [sys.executable, "-c", DETECT, ",".join(COMPUTING), "report", str(tmp_path / "run")]
    done = subprocess.run([*command, "-o", str(tmp_path / "page.html")], capture_output=True, text=True, check=True)
    assert (tmp_path / "page.html").exists(), done.stderr
    assert done.stderr.splitlines()[-1].split()[1:] == []


def _processor_s(code: str) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-c", code], check=True, env=_COMPILED)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def test_the_imports_of_detect_are_within_their_budget() -> None:
    """In turns, since a shared machine changes its speed: the median of three ratios, or of nine where it is more."""
    ratios: list[float] = []
    for count in (3, 6):
        for _ in range(count):
            base = _processor_s("import numpy")
            ratios.append(_processor_s(IMPORTS) / base)
        if median(ratios) <= BUDGET:
            return
    raise AssertionError(f"imports of detect take {median(ratios):.2f} imports of NumPy, budget {BUDGET:g}")
