"""Log files in, joint signals out.

In: paths and ``[log]`` of the configuration. Out: a JointLog, or a LogSummary of what is in a log; a new format is one
line in ``log_formats`` and one file. Elsewhere: an even time base and gaps (conditioning).
"""
