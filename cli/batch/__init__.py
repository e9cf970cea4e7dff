"""Audits of many logs: judged here or in worker processes, and the folder they are written into.

In: logs, settings, limits. Out: an outcome a log, never an exception that one of them raised.
Elsewhere: judging one log (``core``), index and summaries (``reports``).
"""
