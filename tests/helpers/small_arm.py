"""The arm of the command line's tests for scripts, which pytest does not give its fixtures to."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from collaudit.cli import main as entry
from collaudit.core.data.audit_result import FrictionFile
from collaudit.reports.files.run_files import read_friction

_CONFTEST = Path(__file__).parents[1] / "cli" / "conftest.py"


def arm_module() -> ModuleType:
    """``CONFIG`` and ``write_arm_csv`` of the command line's tests."""
    spec = importlib.util.spec_from_file_location("arm_of_tests", _CONFTEST)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def small_arm(folder: Path) -> tuple[str, FrictionFile]:
    """Settings of the arm and friction fitted on a log of it; their files stay in ``folder``."""
    arm = arm_module()
    folder.mkdir(parents=True)
    config, log, friction = folder / "arm.toml", folder / "clean.csv", folder / "friction.json"
    config.write_text(arm.CONFIG)
    arm.write_arm_csv(log)
    code = entry.run(["fit", str(log), "-c", str(config), "-o", str(friction)])
    assert code == 0, f"fit ended with {code}"
    return arm.CONFIG, read_friction(friction)
