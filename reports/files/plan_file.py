"""``plan.json``: a planned motion's facts, written and read back."""

from __future__ import annotations

from pathlib import Path

from collaudit.core.data.plan_result import PLAN_SCHEMA, PlanFile
from collaudit.reports.files.json_reader import checked, read_result
from collaudit.reports.files.json_writer import json_text


def plan_json(plan: PlanFile) -> str:
    """``plan.json`` of a plan; the same plan gives the same text.

    Raises:
        msgspec.ValidationError: the plan breaks its own types: a bug.
    """
    text = json_text(plan)
    checked(text, PlanFile)
    return text


def read_plan(path: Path) -> PlanFile:
    """Read and check a plan.

    Raises:
        CollauditError: it is missing, damaged, of another kind or version, or does not fit.
    """
    return read_result(path, PlanFile, PLAN_SCHEMA)
