"""Whose a log is, with what it is judged, and how the logs of a night get here.

In: arguments, configuration, fleet file. Out: jobs, each with its robot and its own settings, or the reason why not.
Elsewhere: judging them (batch), deciding over what came out (core.verdict).
"""
