"""Audits of many logs: how they get here, whose they are, how they are judged, and the folder they are written into.

In: arguments, settings, fleet file, limits. Out: an outcome a log, never an exception that one of them raised.
Elsewhere: judging one log (``core``), index and summaries (``reports``).
"""
