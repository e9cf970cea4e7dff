"""JSON of finished runs: ``audit.json`` of one, a list of them of several."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.audit_result import Audit
from collaudit.reports.files.json_writer import json_text
from collaudit.reports.files.run_files import audit_json

AUDITS_SCHEMA = "collaudit/audits/1"


def audits_json(audits: Sequence[Audit]) -> str:
    """The results as JSON.

    Args:
        audits: at least one.
    """
    results = [audit.result for audit in audits]
    if len(results) == 1:
        return audit_json(results[0])
    return json_text({"schema": AUDITS_SCHEMA, "audits": results})
