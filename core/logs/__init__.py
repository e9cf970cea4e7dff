"""Log files in, joint signals out.

In: paths and ``[log]`` of the configuration. Out: a JointLog, or a LogSummary of what is in a log; a new format is one
line in ``log_formats`` and one file. Elsewhere: an even time base and gaps (conditioning).
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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

#: Where each name comes from; imported when it is asked for, so that reading a log imports no descriptions or guesses.
_HOMES = {
    "LogSummary": "log_summary",
    "TopicInfo": "log_summary",
    "describe": "log_description",
    "expand_inputs": "inputs",
    "group_inputs": "inputs",
    "guess_csv_columns": "column_guess",
    "read_log": "log_reading",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
