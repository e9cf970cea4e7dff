"""Adding a detector the way docs/architecture.md says: one file and its name; a log is then judged with it."""

from __future__ import annotations

import importlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from collaudit.core.config.detector_names import DETECTOR_NAMES
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.errors import ConfigError
from collaudit.core.residual import detectors
from collaudit.core.residual.detector import detector_named
from collaudit.reports.files.run_files import friction_json

FILE = '''"""Eq. (5) as it is, without a filter."""

from collaudit.core.config.schema import DetectConfig
from collaudit.core.numeric.kernel import identity
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.balance import balance_from_acceleration
from collaudit.core.residual.detector import Detector
from collaudit.core.residual.residual import Residual, ResidualInputs, joint_residuals


def bare_residual(prepared: Prepared, inputs: ResidualInputs, config: DetectConfig) -> Residual:
    return joint_residuals(prepared, balance_from_acceleration(prepared, identity(config.causal)), inputs, config)


DETECTOR = Detector("bare", "r = tau - tau_s - (M ddq + C dq + f + G)", "eq. (5)", bare_residual)
'''


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


def test_a_new_detector_is_one_file_and_its_name(program: Path, hits: Path, friction: FrictionFile) -> None:
    (program / "friction.json").write_text(friction_json(friction), encoding="utf-8")
    command = ["detect", hits, "-c", hits.with_suffix(".toml"), "--friction", "friction.json", "-o", "run"]
    unknown = collaudit(program, *command, "--set", "detect.detector=bare")
    assert unknown.returncode == 2
    assert "energy" in unknown.stderr, "the message names the detectors there are"

    core = program / "collaudit" / "core"
    (core / "residual" / "detectors" / "bare.py").write_text(FILE, encoding="utf-8")
    names = core / "config" / "detector_names.py"
    text = names.read_text(encoding="utf-8")
    assert text.count('"combined"]') == 1
    names.write_text(text.replace('"combined"]', '"combined", "bare"]'), encoding="utf-8")

    assert collaudit(program, *command).returncode == 1
    usual = len(json.loads((program / "run" / "audit.json").read_text(encoding="utf-8"))["collisions"])
    done = collaudit(program, *command, "--set", "detect.detector=bare")
    assert done.returncode == 1, done.stderr
    audit = json.loads((program / "run" / "audit.json").read_text(encoding="utf-8"))
    assert audit["rule"]["detector"] == "bare"
    assert audit["detection"]["equation"].startswith("r = tau")
    assert audit["detection"]["delay"]["noise_gain"] == 1.0
    assert 0.7 * usual <= len(audit["collisions"]) <= 1.1 * usual
    assert all(contact["force"] for contact in audit["contacts"])


def test_every_name_has_its_file_and_every_file_its_name() -> None:
    files = {path.stem for path in Path(str(detectors.__file__)).parent.glob("*.py")} - {"__init__"}
    assert files == set(DETECTOR_NAMES)
    for name in DETECTOR_NAMES:
        detector = detector_named(name)
        assert detector.name == name
        assert detector.equation.startswith(("r = ", "dp^/dt = "))
        assert detector.source
    with pytest.raises(ConfigError, match="no such detector"):
        detector_named("absent")
