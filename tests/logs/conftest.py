"""Makes the log writers importable: tests are collected without their folder on the path."""

from __future__ import annotations

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

_SPEC = spec_from_file_location("log_writers", Path(__file__).with_name("log_writers.py"))
assert _SPEC is not None
assert _SPEC.loader is not None
sys.modules["log_writers"] = module_from_spec(_SPEC)
_SPEC.loader.exec_module(sys.modules["log_writers"])
