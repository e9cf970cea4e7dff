"""Ingest: log files in, joint signals out."""

from __future__ import annotations

from collaudit.core.logs.csv.csv_guess import guess_csv_columns
from collaudit.core.logs.inputs import expand_inputs, group_inputs
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log
from collaudit.core.logs.log_summary import LogSummary, TopicInfo

__all__ = [
    "LogSummary",
    "TopicInfo",
    "describe",
    "expand_inputs",
    "group_inputs",
    "guess_csv_columns",
    "read_log",
]
