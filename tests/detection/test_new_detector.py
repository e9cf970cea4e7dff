"""Adding a detector the way docs/architecture.md says: its line and its name; a log is then judged with it."""

from __future__ import annotations

import importlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import get_args

import pytest

from collaudit.core.config.schema_judging import DetectorName
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.errors import ConfigError
from collaudit.core.residual.detector import DETECTORS, detector_named
from collaudit.reports.files.run_files import result_json

LINE = """    Detector(
        "bare", "r = tau - tau_s - (M ddq + C dq + f + G)", "eq. (5)",
        lambda _, config: Kernel((0.002, 1.0), config.causal), from_acceleration,
    ),
"""


@pytest.fixture
def program(tmp_path: Path) -> Path:
    """A copy of the program in a folder for ``PYTHONPATH``."""
    for room in ("cli", "core", "reports"):
        source = Path(str(importlib.import_module(f"collaudit.{room}").__file__)).parent
        shutil.copytree(source, tmp_path / "collaudit" / room, ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def collaudit(program: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    code = (
        "import collaudit.core, sys\n"
        f"assert collaudit.core.__file__.startswith({str(program)!r}), collaudit.core.__file__\n"
        "from collaudit.cli.main import main\nmain()"
    )
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        cwd=program,
        env=dict(os.environ, PYTHONPATH=str(program), NO_COLOR="1"),
        capture_output=True,
        text=True,
    )


def test_a_new_detector_is_a_line_and_its_name(program: Path, hits: Path, friction: FrictionFile) -> None:
    (program / "friction.json").write_text(result_json(friction), encoding="utf-8")
    command = ["detect", hits, "-c", hits.with_suffix(".toml"), "--friction", "friction.json", "-o", "run"]
    unknown = collaudit(program, *command, "--set", "detect.detector=bare")
    assert unknown.returncode == 2
    assert "eso" in unknown.stderr, "the message names the detectors there are"

    core = program / "collaudit" / "core"
    for file, old, new in (
        (core / "residual" / "detector.py", "DETECTORS = (\n", f"DETECTORS = (\n{LINE}"),
        (core / "config" / "schema_judging.py", '"filtered", "eso"]', '"filtered", "eso", "bare"]'),
    ):
        text = file.read_text(encoding="utf-8")
        assert text.count(old) == 1
        file.write_text(text.replace(old, new), encoding="utf-8")

    assert collaudit(program, *command).returncode == 1
    usual = len(json.loads((program / "run" / "audit.json").read_text(encoding="utf-8"))["collisions"])
    done = collaudit(program, *command, "--set", "detect.detector=bare")
    assert done.returncode == 1, done.stderr
    audit = json.loads((program / "run" / "audit.json").read_text(encoding="utf-8"))
    assert audit["rule"]["detector"] == "bare"
    assert audit["detection"]["equation"].startswith("r = tau")
    assert 0.0 < audit["detection"]["delay"]["noise_gain"] < 1.0
    assert 0.7 * usual <= len(audit["collisions"]) <= 1.1 * usual
    assert all(contact["force"] for contact in audit["contacts"])


def test_every_name_has_its_line_and_every_line_its_name() -> None:
    assert tuple(detector.name for detector in DETECTORS) == get_args(DetectorName)
    for detector in DETECTORS:
        assert detector.equation.startswith(("r = ", "dp^/dt = "))
        assert detector.source
    with pytest.raises(ConfigError, match="no such detector"):
        detector_named("absent")
