"""Ingest: log files in, joint signals out."""

from __future__ import annotations

from collaudit.core.logs.csv_guess import guess_csv_columns
from collaudit.core.logs.describe import describe
from collaudit.core.logs.inputs import expand_inputs, group_inputs
from collaudit.core.logs.read import read_log
from collaudit.core.logs.summary import LogSummary, TopicInfo

__all__ = [
    "LogSummary",
    "TopicInfo",
    "describe",
    "expand_inputs",
    "group_inputs",
    "guess_csv_columns",
    "read_log",
]
