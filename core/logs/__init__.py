"""Log files in, joint signals out.

In: paths and ``[log]`` of the configuration. Out: a JointLog, or a LogSummary of what is in a log; a new format is one
line in ``log_formats`` and one file. Elsewhere: an even time base and gaps (conditioning).
"""

from __future__ import annotations

from collaudit.core.logs.column_guess import guess_csv_columns
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
