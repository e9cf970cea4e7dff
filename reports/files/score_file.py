"""``score.json``: the scores of an audit against known events."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.detection_result import Score
from collaudit.reports.files.json_writer import json_text

SCORE_SCHEMA = "collaudit/score/1"


def score_json(scores: Sequence[Score]) -> str:
    """``score.json``."""
    return json_text({"schema": SCORE_SCHEMA, "scores": list(scores)})
